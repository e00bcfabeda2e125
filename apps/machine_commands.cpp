#include "machine_commands.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <string_view>

#include "commands.hpp"
#include "options.hpp"
#include "photocoag/core/build_info.hpp"

namespace photocoag {
void add_machine_commands(CLI::App& app, int& exit_code) {
  const auto doctor_options = std::make_shared<DoctorOptions>();
  CLI::App* doctor_app = app.add_subcommand(
      "doctor", "what on this machine stands in the way of real time, and what to do about it");
  doctor_app
      ->add_option("--json", doctor_options->json, "also write it; - is standard output alone")
      ->type_name("FILE");
  doctor_app->footer(footer("  photocoag doctor\n  photocoag doctor --json -"));
  doctor_app->callback(
      [doctor_options, &exit_code] { exit_code = doctor_command(*doctor_options); });

  const auto latency_options = std::make_shared<LatencyOptions>();
  CLI::App* latency_app = app.add_subcommand(
      "latency", "how late this machine wakes a real-time thread, beside cyclictest");
  latency_app->add_option("--seconds", latency_options->seconds, "how long to measure")
      ->check(number_from(0.01, 1e6))
      ->type_name("S");
  latency_app->add_option("--period-ms", latency_options->period_ms, "from deadline to deadline")
      ->check(number_from(0.05, 100.0))
      ->type_name("T");
  latency_app
      ->add_option("--json", latency_options->json, "also write it; - is standard output alone")
      ->type_name("FILE");
  latency_app->footer(
      footer("  photocoag latency --seconds 60\n"
             "  photocoag latency --seconds 10 --period-ms 0.1\n"
             "If cyclictest (Debian: rt-tests) is installed it runs at the same time."));
  latency_app->callback(
      [latency_options, &exit_code] { exit_code = latency_command(*latency_options); });
}

}  // namespace photocoag
