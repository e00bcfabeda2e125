// `photocoag driver-check`: tests whether a vendor's driver keeps the promises of device/driver.h.
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "command.hpp"
#include "console.hpp"
#include "json_object.hpp"
#include "options.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/rt/driver_check.hpp"

namespace photocoag {
namespace {

std::string_view word_of(PromiseVerdict verdict) {
  switch (verdict) {
    case PromiseVerdict::kKept:
      return "kept";
    case PromiseVerdict::kBroken:
      return "BROKEN";
    case PromiseVerdict::kNotTried:
      break;
  }
  return "not tried";
}

nlohmann::ordered_json json_of(const DriverCheck& check) {
  nlohmann::ordered_json json;
  for (const PromiseResult& one : check.results) {
    json["promises"].push_back(
        {{"promise", one.promise}, {"verdict", word_of(one.verdict)}, {"why", one.why}});
  }
  if (!check.unopened.empty()) json["unopened"] = check.unopened;
  return json;
}

int run(const DriverCheckSettings& settings, bool json) {
  say("photocoag {}: {}\n", version(), kResearchNotice);
  const DriverCheck check = check_driver(settings);
  int broken = 0;
  for (const PromiseResult& one : check.results) {
    broken += one.verdict == PromiseVerdict::kBroken ? 1 : 0;
    const std::string line = fmt::format("{:<10} {:<10} {}\n", word_of(one.verdict), one.promise,
                                         one.why.empty() ? one.means : one.why);
    if (json) {
      say("{}", line);
    } else {
      print("{}", line);
    }
  }
  constexpr int kDeviceFault = 3;
  const int code = !check.unopened.empty() ? kDeviceFault : broken > 0 ? 1 : 0;
  if (code == kDeviceFault) say("photocoag: the device cannot be opened: {}\n", check.unopened);
  return with_json(json, "driver-check", code, {}, json_of(check));
}

const Command kDriverCheck(
    "driver-check", "try every promise of device/driver.h with a vendor's driver",
    [](CommandLine& command, int& exit_code) {
      const auto settings = std::make_shared<DriverCheckSettings>();
      const auto json = std::make_shared<bool>(false);
      const auto period_ms = std::make_shared<double>(1.0);
      const auto power_mW = std::make_shared<double>(1.0);
      command.add_option("LIBRARY", settings->library, "shared library of the driver")
          .required()
          .type_name("FILE");
      command
          .add_option("--settings", settings->settings,
                      "the driver's, as after the comma of "
                      "treat --device driver:LIBRARY,SETTINGS")
          .type_name("TEXT");
      command.add_option("--failing", settings->failing, "settings with which it must not open")
          .type_name("TEXT");
      command.add_option("--period-ms", *period_ms, "control period")
          .check(number_from(0.05, 100.0))
          .type_name("ms");
      command.add_option("--power-mW", *power_mW, "power where light is needed")
          .check(number_from(0.01, 1000.0))
          .type_name("mW");
      command.add_option("--patience", settings->patience, "for each promise; then it is killed")
          .check(number_from(0.1, 3600.0))
          .type_name("s");
      command.add_option("--only", settings->only, "one promise").type_name("PROMISE");
      command.add_flag("--light", settings->light_allowed,
                       "the driver is not simulated: light may come out while it is tried");
      add_json(command, *json);
      command.footer(
          footer("  photocoag driver-check build/driver/libphotocoag_example_driver.so\n"
                 "  photocoag driver-check ./libmy_driver.so --settings card=0 --failing card=99\n"
                 "  photocoag driver-check ./libmy_driver.so --only watchdog --period-ms 4\n"
                 "Each promise is tried in a process of its own. Here exit code 1: a promise is "
                 "broken; 3: the device\ncannot be opened."));
      command.callback([=, &exit_code] {
        settings->period = *period_ms * 1e-3;
        settings->power = *power_mW * 1e-3;
        exit_code = run(*settings, *json);
      });
    });

}  // namespace

}  // namespace photocoag
