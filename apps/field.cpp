// `photocoag field`: temperatures in all cells as VTK files.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "command.hpp"
#include "configured.hpp"
#include "console.hpp"
#include "options.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/step_response.hpp"
#include "photocoag/report/run_log.hpp"
#include "photocoag/run/field.hpp"
#include "photocoag/run/run_folder.hpp"

namespace photocoag {
namespace {

struct FieldOptions : CommonOptions {
  std::string model = "full";
  std::optional<double> power;  ///< W, constant
  std::string run;              ///< or a run folder
  std::vector<double> times;    ///< s
  std::string out;              ///< folder, new or empty
};

namespace fs = std::filesystem;

constexpr std::size_t kMostBytes = 500'000'000;
constexpr std::size_t kMostPeriods = 10'000'000;

// Whole periods up to each time, ascending. Throws Error if a time is not a multiple of the period.
std::vector<std::size_t> periods_of(const std::vector<double>& times, double period) {
  std::vector<std::size_t> periods;
  for (const std::size_t index : ascending_times(times)) {
    const double count = std::round(times[index] / period);
    if (std::abs(times[index] - count * period) > 1e-6 * period ||
        count > static_cast<double>(kMostPeriods)) {
      throw Error(ErrorParts{
          .where = "--times",
          .found = fmt::format("{} s", times[index]),
          .accepted = fmt::format("whole multiples of control.period_ms, {:g} ms", period * 1e3)});
    }
    periods.push_back(static_cast<std::size_t>(count));
  }
  return periods;
}

int field_command(const FieldOptions& options) {
  const bool from_run = !options.run.empty();
  if (from_run != !options.power) {
    throw Error(ErrorParts{.where = "field", .accepted = "either --power W or --run DIR"});
  }
  if (from_run && !options.config.empty()) {
    throw Error(ErrorParts{.where = "--config",
                           .accepted = "no --config beside --run: the run has its own"});
  }
  const std::string config_file =
      from_run ? (fs::path(options.run) / "config.toml").string() : options.config;
  const Use use = options.model == "full" ? Use::kResponseFull : Use::kResponseReduced;
  const Config config =
      from_run ? load_config(config_file, options.set) : configured(use, config_file, options.set);
  const std::vector<std::size_t> after = periods_of(options.times, config.control.period);
  std::vector<double> powers;
  if (from_run) {
    const std::string log = (fs::path(options.run) / "run.csv").string();
    powers = parse_run_log(read_file(log, kMostBytes), log).power_W;
    if (after.back() > powers.size()) {
      throw Error(ErrorParts{
          .where = "--times",
          .found = fmt::format("{} s", static_cast<double>(after.back()) * config.control.period),
          .accepted = fmt::format("at most the run's {:g} s",
                                  static_cast<double>(powers.size()) * config.control.period)});
    }
  } else {
    powers.assign(after.back(), *options.power);
  }
  const fs::path folder = options.out;
  check_run_folder(folder);
  ModelStore models(config, false);
  const auto full = models.plant_full();
  const std::vector<TemperatureField> fields =
      temperature_fields(full, options.model == "full" ? FieldModel::kFull : FieldModel::kReduced,
                         config, powers, after);

  const ClaimedFolder claimed = open_run_folder(folder, config);
  std::vector<std::string> files;
  std::vector<double> times;
  for (const TemperatureField& field : fields) {
    files.push_back(fmt::format("field_{:04}.vtr", files.size()));
    times.push_back(field.time_s);
    write_file(folder / files.back(), to_vtr(field));
    float highest = 0.0F;
    for (const float value : field.temperature_rise_K) highest = std::max(highest, value);
    say("{}  {:g} s, highest cell {:.2f} K\n", files.back(), field.time_s, highest);
  }
  write_file(folder / "fields.pvd", to_pvd(files, times));
  say("written   {} (open in ParaView: x is the radius, y the depth)\n",
      (folder / "fields.pvd").string());
  return 0;
}

const Command kField(
    "field", "temperatures in all cells at chosen times as VTK files, for ParaView", field_command,
    [](CommandLine& command, FieldOptions& options) {
      add_common(command, options);
      command
          .add_option("--model", options.model,
                      "full, or reduced: the field of the reduced state, T = V x")
          .one_of({"full", "reduced"});
      command.add_option("--power", options.power, "constant laser power, W")
          .check(number_from(0.0, 1e6))
          .type_name("W");
      command.add_option("--run", options.run, "or the powers of this run folder").type_name("DIR");
      add_times(command, options.times,
                "times, s, comma-separated: whole multiples of control.period_ms");
      command.add_option("--out", options.out, "folder, new or empty").required().type_name("DIR");
      command.footer(
          footer("  photocoag field --power 0.03 --times 0.001,0.01,0.1 --out fields\n"
                 "  photocoag field --model reduced --power 0.03 --times 0.1 --out reduced-fields\n"
                 "  photocoag field --run runs/first --times 0.005,0.25 --out runs/first-fields\n"
                 "The eye is that of [plant]. fields.pvd is the series of all times."));
    });

}  // namespace

}  // namespace photocoag
