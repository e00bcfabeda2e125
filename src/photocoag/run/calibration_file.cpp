#include "photocoag/run/calibration_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <string_view>

#include "photocoag/config/table_reader.hpp"
#include "photocoag/core/csv.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/random.hpp"
#include "photocoag/photoacoustics/thermometer.hpp"
#include "photocoag/photoacoustics/transducer.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kLargestData = std::size_t{1} << 26;  // bytes

}  // namespace

CurveData load_curve(const std::string& file) {
  if (file.empty()) return water_like_curve();
  const Value root = read_toml_file(file);
  const Value* table = root.find("curve");
  if (table == nullptr || table->kind != Value::Kind::kTable || root.entries.size() != 1) {
    throw Error(ErrorParts{.where = file,
                           .problem = "not a calibration curve",
                           .accepted = "one table [curve]; docs/photoacoustics.md"});
  }
  const TableReader keys(*table, "curve",
                         {"source", "coefficients", "temperatures_C", "values", "valid_C"});
  const std::vector<double> valid = keys.numbers("valid_C");
  if (valid.size() != 2) {
    throw Error(ErrorParts{.where = file,
                           .key = "curve.valid_C",
                           .found = "not two temperatures",
                           .accepted = "[lowest, highest], deg C"});
  }
  const CurveData curve{.source = keys.text("source"),
                        .coefficients = keys.numbers("coefficients"),
                        .temperatures = keys.numbers("temperatures_C"),
                        .values = keys.numbers("values"),
                        .valid_from_celsius = valid[0],
                        .valid_to_celsius = valid[1]};
  GrueneisenCurve(curve, file);  // refuses what is no curve
  return curve;
}

std::string to_toml(const CurveData& curve) {
  std::string text = "[curve]\n";
  text += fmt::format("source         = {}\n", toml_quoted(curve.source));
  if (!curve.coefficients.empty()) {
    text +=
        fmt::format("coefficients   = [{}]  # c_0 + c_1 T + ..., T in deg C; only ratios count\n",
                    fmt::join(curve.coefficients, ", "));
  } else {
    text += fmt::format("temperatures_C = [{}]\n", fmt::join(curve.temperatures, ", "));
    text += fmt::format("values         = [{}]  # linear between; only ratios count\n",
                        fmt::join(curve.values, ", "));
  }
  text += fmt::format("valid_C        = [{}, {}]  # no temperature is given out beyond\n",
                      curve.valid_from_celsius, curve.valid_to_celsius);
  return text;
}

std::vector<CalibrationPoint> load_heating_data(const std::string& file) {
  CsvReader table(read_file(file, kLargestData, "CSV file"), file);
  table.next();
  const std::vector<std::string> names(table.cells().begin(), table.cells().end());
  const auto column = [&](std::string_view name) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
    throw Error(ErrorParts{.where = file,
                           .key = std::string(name),
                           .problem = "no such column",
                           .found = shown(fmt::format("{}", fmt::join(names, ","))),
                           .accepted = "columns temperature_C, amplitude, energy_uJ"});
  };
  const std::size_t of_temperature = column("temperature_C");
  const std::size_t of_amplitude = column("amplitude");
  const std::size_t of_energy = column("energy_uJ");
  std::vector<CalibrationPoint> points;
  while (table.next()) {
    if (table.blank()) continue;
    const auto read = [&](std::size_t i) {
      const std::string_view cell = i < table.cells().size() ? table.cells()[i] : "";
      double value = 0.0;
      const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
      if (error != std::errc() || end != cell.data() + cell.size()) {
        throw Error(ErrorParts{
            .where = table.place(), .key = names[i], .found = shown(cell), .accepted = "a number"});
      }
      return value;
    };
    points.push_back({read(of_temperature), read(of_amplitude), read(of_energy) * 1e-6});
  }
  return points;
}

std::string example_heating_data(const CurveData& data, double ambient_celsius, double noise_K,
                                 int rows, std::uint64_t seed) {
  const GrueneisenCurve curve(data);
  const Transducer transducer;
  constexpr double kCodes = 3000.0;  // at the reference energy, cold
  // The curve must also be valid below ambient, where noise of cold tissue lies.
  constexpr double kBelow = 5.0;     // K
  constexpr double kWarming = 50.0;  // K
  const double cold = curve.value(ambient_celsius);
  std::uint64_t pulse = 0;
  const auto fire = [&](double celsius) {
    const auto normal = [&](RandomStream stream) { return standard_normal(seed, pulse, stream); };
    const double energy = 2.6e-6 * (1.0 + 0.05 * normal(RandomStream::kPulseEnergy));
    const double amplitude = kCodes * energy / 2.6e-6 * curve.value(celsius) / cold;
    const double noise =
        amplitude * noise_K * curve.slope(celsius) / curve.value(celsius) * transducer.gain();
    PulseReading reading;
    transducer.write(amplitude, 1.5 * normal(RandomStream::kArrivalTime), noise, seed, pulse,
                     reading.transient);
    reading.energy = energy * (1.0 + 0.002 * normal(RandomStream::kEnergyMeter));
    ++pulse;
    return reading;
  };
  std::vector<PulseReading> cold_pulses;
  for (int i = 0; i < 200; ++i) cold_pulses.push_back(fire(ambient_celsius));
  const Baseline baseline = measure_baseline(cold_pulses, {.ambient_celsius = ambient_celsius});
  const MatchedFilter filter(baseline.shape);
  std::string text = "temperature_C,amplitude,energy_uJ\n";
  for (int i = 0; i < rows; ++i) {
    const double celsius =
        ambient_celsius - kBelow + (kBelow + kWarming) * i / std::max(1, rows - 1);
    const PulseReading reading = fire(celsius);
    text += fmt::format("{:.3f},{:.6f},{:.5f}\n", celsius,
                        filter.match(reading.transient).amplitude, reading.energy * 1e6);
  }
  return text;
}

}  // namespace photocoag
