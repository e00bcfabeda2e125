#include "device_commands.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "options.hpp"
#include "photocoag/core/build_info.hpp"

namespace photocoag {
void add_device_commands(CLI::App& app, int& exit_code) {
  const auto eye_options = std::make_shared<EyeOptions>();
  CLI::App* eye_app = app.add_subcommand(
      "eye", "a simulated eye with its laser as a process of its own: pulses, pressure transients");
  add_common(*eye_app, *eye_options);
  eye_app->add_option("--socket", eye_options->socket, "where controllers connect")
      ->type_name("PATH");
  eye_app->add_option("--owner", eye_options->owner, "end with this process, the parent")
      ->type_name("PID");
  eye_app->add_flag("--once", eye_options->once, "end when the first controller has gone");
  eye_app
      ->add_option("--fault", eye_options->faults,
                   "ID@cycle[+count][*value] of docs/devices.md, or a file with one per line")
      ->type_name("FAULT")
      ->allow_extra_args(false);
  eye_app
      ->add_option("--tell", eye_options->tell,
                   "send this line to an eye that runs: status, cold, fault ID@cycle")
      ->type_name("TEXT");
  eye_app->footer(
      footer("  photocoag eye --socket /tmp/eye\n"
             "  photocoag treat --device eye:/tmp/eye\n"
             "  photocoag eye --socket /tmp/eye --tell 'fault M2@120'\n"
             "It is that of [plant], [photoacoustics] and control.period_ms."));
  eye_app->callback([eye_options, &exit_code] { exit_code = eye_command(*eye_options); });

  const auto calibrate_options = std::make_shared<CalibrateOptions>();
  CLI::App* calibrate_app = app.add_subcommand(
      "calibrate", "fit the photoacoustic calibration curve to data of evenly warmed tissue");
  add_common(*calibrate_app, *calibrate_options);
  calibrate_app
      ->add_option("DATA", calibrate_options->data,
                   "CSV file with columns temperature_C, amplitude, energy_uJ")
      ->type_name("FILE");
  calibrate_app->add_option("--out", calibrate_options->out, "TOML file for the curve")
      ->type_name("FILE");
  calibrate_app
      ->add_option("--degree", calibrate_options->degree,
                   "of the polynomial; 0: the smallest of 1 to 3 that predicts well")
      ->check(whole_number_from(0, 5))
      ->type_name("d");
  calibrate_app
      ->add_option("--example", calibrate_options->example,
                   "first write data of the simulated transducer to this file")
      ->type_name("FILE");
  calibrate_app->add_option("--rows", calibrate_options->rows, "pulses of the example")
      ->check(whole_number_from(8, 1000000))
      ->type_name("n");
  calibrate_app->footer(
      footer("  photocoag calibrate --example heating.csv\n"
             "  photocoag calibrate heating.csv --out curve.toml\n"
             "  photocoag treat --device eye --set photoacoustics.calibration=curve.toml"));
  calibrate_app->callback(
      [calibrate_options, &exit_code] { exit_code = calibrate_command(*calibrate_options); });
}

}  // namespace photocoag
