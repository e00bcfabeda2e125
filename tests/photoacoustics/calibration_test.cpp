// The calibration curve from heating data, and its file.
#include "photocoag/photoacoustics/calibration.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "photocoag/core/files.hpp"
#include "photocoag/core/random.hpp"
#include "photocoag/run/calibration_file.hpp"
#include "support/temporary_folder.hpp"
#include "support/thrown.hpp"

namespace photocoag::testing {
namespace {

CurveData quadratic() {
  return {.source = "a test",
          .coefficients = {0.02, 0.004, 2e-5},
          .temperatures = {},
          .values = {},
          .valid_from_celsius = 1.0,
          .valid_to_celsius = 90.0};
}

std::vector<CalibrationPoint> data(const CurveData& truth, double relative_noise, int count = 400) {
  const GrueneisenCurve curve(truth);
  std::vector<CalibrationPoint> points;
  for (int i = 0; i < count; ++i) {
    const double celsius = 22.0 + 50.0 * i / (count - 1);
    const double energy = 2e-6 + 1e-6 * (i % 3);
    const double noise = 1.0 + relative_noise * standard_normal(3, static_cast<std::uint64_t>(i),
                                                                RandomStream::kTest);
    points.push_back({celsius, 5e9 * energy * curve.value(celsius) * noise, energy});
  }
  return points;
}

// What a thermometer would get wrong: temperatures by the fitted curve from true ratios to 22 deg
// C.
double worst_error(const CurveData& fitted, const CurveData& truth) {
  const GrueneisenCurve f(fitted);
  const GrueneisenCurve t(truth);
  double worst = 0.0;
  for (double celsius = 23.0; celsius < 71.0; celsius += 1.0) {
    const double ratio = t.value(celsius) / t.value(22.0);
    worst = std::max(worst, std::abs(f.temperature(ratio * f.value(22.0)) - celsius));
  }
  return worst;
}

TEST(Calibration, FindsTheCurveWithoutNoiseExactly) {
  for (const CurveData& truth : {water_like_curve(), quadratic()}) {
    const int degree = static_cast<int>(truth.coefficients.size()) - 1;
    const Calibration found = fit_calibration(data(truth, 0.0), degree);
    EXPECT_LT(worst_error(found.curve, truth), 1e-8);
    EXPECT_LT(found.residual, 1e-9);
    EXPECT_EQ(found.curve.valid_from_celsius, 22.0);
    EXPECT_EQ(found.curve.valid_to_celsius, 72.0);
  }
}

TEST(Calibration, ChoosesTheDegreeAndReportsHonestResiduals) {
  // 2 % noise, as of single pulses; the fit's own error is 2 % / sqrt(400 / parameters), in K.
  const Calibration line = fit_calibration(data(water_like_curve(), 0.02), 0);
  EXPECT_EQ(line.degree, 1);
  EXPECT_NEAR(line.residual_relative, 0.02, 0.002);
  EXPECT_LT(worst_error(line.curve, water_like_curve()), 0.4);
  const Calibration parabola = fit_calibration(data(quadratic(), 0.01), 0);
  EXPECT_EQ(parabola.degree, 2);
  EXPECT_LT(worst_error(parabola.curve, quadratic()), 0.4);
  const Calibration too_simple = fit_calibration(data(quadratic(), 0.0), 1);
  EXPECT_GT(too_simple.residual_max, 0.5) << "and the report says so";
  std::size_t points = 0;
  for (const CalibrationBin& bin : too_simple.bins) points += bin.points;
  EXPECT_EQ(points, 400u);
}

TEST(Calibration, BadDataIsRefused) {
  const auto message = [](auto change) {
    std::vector<CalibrationPoint> points = data(water_like_curve(), 0.0);
    change(points);
    return message_of([&] { fit_calibration(points, 1); });
  };
  EXPECT_NE(message([](auto& p) { p.resize(7); }).find("7 rows"), std::string::npos);
  EXPECT_NE(message([](auto& p) { p[3].energy = 0.0; }).find("row 4"), std::string::npos);
  EXPECT_NE(message([](auto& p) { p[3].amplitude = NAN; }).find("row 4"), std::string::npos);
  EXPECT_NE(message([](auto& p) { p.resize(30); }).find("5 K"), std::string::npos);
  EXPECT_NE(message([](auto& p) {
              for (auto& point : p) point.celsius = 94.0 - point.celsius;
            }).find("rises"),
            std::string::npos)
      << "a falling curve";
}

TEST(CalibrationFile, ReadsBackWhatItWrites) {
  const TemporaryFolder folder;
  const CurveData table{.source = "a \"table\"",
                        .coefficients = {},
                        .temperatures = {10.0, 30.0, 90.0},
                        .values = {0.05, 0.13, 0.4},
                        .valid_from_celsius = 10.0,
                        .valid_to_celsius = 85.5};
  for (const CurveData& curve : {water_like_curve(), quadratic(), table}) {
    write_file(folder.file("curve.toml"), to_toml(curve));
    EXPECT_EQ(load_curve(folder.file("curve.toml")), curve);
  }
  EXPECT_EQ(load_curve(""), water_like_curve());
}

TEST(CalibrationFile, BadFilesAreRefusedByName) {
  const TemporaryFolder folder;
  const std::string file = folder.file("curve.toml");
  const auto message = [&](const std::string& text) {
    write_file(file, text);
    return message_of([&] { load_curve(file); });
  };
  const std::string good = "[curve]\ncoefficients = [0.1, 0.004]\n";
  EXPECT_EQ(message(good + "valid_C = [0, 90]\n"), "");
  EXPECT_NE(message(good).find("curve.valid_C"), std::string::npos);
  EXPECT_NE(message(good + "valid_C = [90, 0]\n").find("curve.valid_C"), std::string::npos);
  EXPECT_NE(message(good + "valid_C = [0, 90]\ncolour = 1\n").find("curve.colour"),
            std::string::npos);
  EXPECT_NE(message("[curve]\ncoefficients = [0.1, \"x\"]\nvalid_C = [0, 90]\n").find("a number"),
            std::string::npos);
  EXPECT_NE(message("[curve]\ncoefficients = [100, 4]\nvalid_C = [0, nan]\n").find("curve.valid_C"),
            std::string::npos);
  EXPECT_NE(message("").find("[curve]"), std::string::npos);
  EXPECT_NE(message_of([] { load_curve("/no/such.toml"); }).find("/no/such.toml"),
            std::string::npos);
}

TEST(CalibrationFile, TheExampleGivesItsCurveBack) {
  const TemporaryFolder folder;
  write_file(folder.file("heating.csv"), example_heating_data(quadratic(), 22.0, 0.91, 2000, 1));
  const auto points = load_heating_data(folder.file("heating.csv"));
  ASSERT_EQ(points.size(), 2000u);
  const Calibration found = fit_calibration(points, 0);
  EXPECT_EQ(found.degree, 2);
  // 0.91 K per pulse over 2000 pulses and 3 parameters: some 0.1 K.
  EXPECT_LT(worst_error(found.curve, quadratic()), 0.3);
  EXPECT_NEAR(found.residual, 0.91, 0.1);
  write_file(folder.file("bad.csv"), "temperature_C,amplitude,energy_uJ\n22,1,2\n23,x,2\n");
  EXPECT_NE(message_of([&] { load_heating_data(folder.file("bad.csv")); }).find("bad.csv:3"),
            std::string::npos);
  write_file(folder.file("bad.csv"), "temperature_C,amplitude\n22,1\n");
  EXPECT_NE(message_of([&] { load_heating_data(folder.file("bad.csv")); }).find("energy_uJ"),
            std::string::npos);
}

}  // namespace
}  // namespace photocoag::testing
