// `photocoag doctor`: checks whether this machine is fit for real time.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "command.hpp"
#include "console.hpp"
#include "options.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/realtime_check/doctor.hpp"

namespace photocoag {
namespace {

using Json = nlohmann::ordered_json;

struct DoctorOptions {
  std::string json;  ///< file; - is standard output
};

int doctor_command(const DoctorOptions& options) {
  const std::vector<Finding> findings = examine(own_privileges());
  Json json = Json::array();
  const bool table = options.json != "-";
  bool bad = false;
  for (const Finding& finding : findings) {
    bad = bad || finding.health == Health::kBad;
    json.push_back({{"topic", finding.topic},
                    {"health", to_string(finding.health)},
                    {"found", finding.found},
                    {"advice", finding.advice}});
    if (!table) continue;
    print("{:<4}  {:<21} {}\n", to_string(finding.health), finding.topic, finding.found);
    if (!finding.advice.empty()) print("{:29}{}\n", "", finding.advice);
  }
  write_output(options.json, json.dump(2) + "\n");
  return bad ? 1 : 0;
}

const Command kDoctor("doctor",
                      "check what prevents real-time operation on this machine, and how to fix it",
                      doctor_command, [](CommandLine& command, DoctorOptions& options) {
                        command
                            .add_option("--json", options.json,
                                        "also write it as JSON; -: only that, on standard output")
                            .type_name("FILE");
                        command.footer(footer("  photocoag doctor\n  photocoag doctor --json -"));
                      });

}  // namespace

}  // namespace photocoag
