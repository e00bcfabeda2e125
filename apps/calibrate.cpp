// `photocoag calibrate`: a calibration curve from heating data.

#include "command.hpp"
#include "configured.hpp"
#include "console.hpp"
#include "options.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/run/calibration_file.hpp"

namespace photocoag {
namespace {

struct CalibrateOptions : CommonOptions {
  std::string data;     ///< CSV file
  std::string out;      ///< TOML file; empty: standard output
  std::string example;  ///< write example data there
  int degree = 0;       ///< 0: chosen
  int rows = 400;       ///< of the example
};

int calibrate_command(const CalibrateOptions& options) {
  if (!options.example.empty()) {
    const Config config = configured(Use::kCalibrate, options.config, options.set);
    constexpr double kPulseNoise = 0.91;  // K
    const std::string& curve = config.photoacoustics.eye_calibration.empty()
                                   ? config.photoacoustics.calibration
                                   : config.photoacoustics.eye_calibration;
    write_file(options.example,
               example_heating_data(load_curve(curve), config.tissue.ambient_celsius, kPulseNoise,
                                    options.rows, config.run.seed));
    say("written   {}: {} pulses of a simulated transducer\n", options.example, options.rows);
    if (options.data.empty()) return 0;
  }
  if (options.data.empty()) {
    throw Error(ErrorParts{.where = "DATA",
                           .problem = "missing",
                           .accepted = "a CSV file with temperature_C, amplitude, energy_uJ"});
  }
  say("photocoag {}: {}\n", version(), kResearchNotice);
  const std::vector<CalibrationPoint> points = load_heating_data(options.data);
  const Calibration found = fit_calibration(points, options.degree);
  print("{} pulses from {:g} to {:g} deg C\n", points.size(), found.curve.valid_from_celsius,
        found.curve.valid_to_celsius);
  for (std::size_t d = 0; d < found.left_out.size(); ++d) {
    print("degree {}: {:.2f} % rms of points left out of the fit{}\n", d + 1,
          100.0 * found.left_out[d], static_cast<int>(d) + 1 == found.degree ? "   <- used" : "");
  }
  print("residuals: {:.2f} % rms of amplitude/energy; {:.3f} K rms, {:.2f} K at most\n",
        100.0 * found.residual_relative, found.residual, found.residual_max);
  print("{:>16} {:>7} {:>8} {:>8}   measured minus true, K\n", "deg C", "pulses", "mean", "sigma");
  for (const CalibrationBin& bin : found.bins) {
    print("{:>7.1f} {:>8.1f} {:>7} {:>8.3f} {:>8.3f}\n", bin.from_celsius, bin.to_celsius,
          bin.points, bin.mean, bin.sigma);
  }
  const std::string curve = to_toml(found.curve);
  if (options.out.empty()) {
    print("\n{}", curve);
  } else {
    write_file(options.out, curve);
    say("written   {}: use it with --set photoacoustics.calibration={}\n", options.out,
        options.out);
  }
  return 0;
}

const Command kCalibrate(
    "calibrate", "fit the photoacoustic calibration curve to data of uniformly heated tissue",
    calibrate_command, [](CommandLine& command, CalibrateOptions& options) {
      add_common(command, options);
      command
          .add_option("DATA", options.data,
                      "CSV file with columns temperature_C, amplitude, energy_uJ")
          .type_name("FILE");
      command.add_option("--out", options.out, "TOML file for the curve").type_name("FILE");
      command
          .add_option("--degree", options.degree,
                      "of the polynomial; 0: the smallest of 1 to 3 that predicts well")
          .check(whole_number_from(0, 5))
          .type_name("d");
      command
          .add_option("--example", options.example,
                      "first write data of the simulated transducer to this file")
          .type_name("FILE");
      command.add_option("--rows", options.rows, "pulses of the example")
          .check(whole_number_from(8, 1000000))
          .type_name("n");
      command.footer(
          footer("  photocoag calibrate --example heating.csv\n"
                 "  photocoag calibrate heating.csv --out curve.toml\n"
                 "  photocoag treat --device eye --set photoacoustics.calibration=curve.toml"));
    });

}  // namespace

}  // namespace photocoag
