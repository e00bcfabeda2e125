// The picture of the field: isotherms of a field whose isotherms are known, and the page with it.
#include "photocoag/report/field_figure.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "photocoag/report/report.hpp"
#include "report/run_folder.hpp"

namespace photocoag {
namespace {

// T = 40 - 0.1 r / um in the middle of the depth, falling by 0.1 K / um away from it.
TemperatureField cone() {
  TemperatureField field;
  for (int i = 0; i <= 100; ++i) field.radius_m.push_back(5e-6 * i);
  for (int j = 0; j <= 120; ++j) field.depth_m.push_back(5e-6 * j);
  for (std::size_t j = 0; j < 120; ++j) {
    for (std::size_t i = 0; i < 100; ++i) {
      const double r = 5.0 * (static_cast<double>(i) + 0.5);
      const double z = 5.0 * (static_cast<double>(j) + 0.5);
      field.temperature_rise_K.push_back(
          static_cast<float>(std::max(0.0, 40.0 - 0.1 * r - 0.1 * std::abs(z - 302.5))));
    }
  }
  field.time_s = 0.1;
  field.spot_radius_m = 1e-4;
  field.layer_back_m = {3e-4, 3.02e-4, 6e-4};
  field.layer_names = {"front & first", "thin", "rest"};
  return field;
}

TEST(FieldFigure, IsothermsLieWhereTheFieldSays) {
  const TemperatureField field = cone();
  // Linear between centers, so interpolation is exact but for the float.
  EXPECT_NEAR(isotherm_radius(field, 60, 30.0), 100e-6, 1e-10);
  EXPECT_NEAR(isotherm_radius(field, 60, 12.25), 277.5e-6, 1e-10);
  EXPECT_NEAR(isotherm_radius(field, 40, 20.0), 100e-6, 1e-10);
  EXPECT_EQ(isotherm_radius(field, 10, 20.0), 0.0);
  const std::vector<double> levels = isotherm_levels(field);
  EXPECT_EQ(levels, (std::vector<double>{5, 10, 15, 20, 25, 30, 35}));
}

TEST(FieldFigure, IsWellFormedAndNamesWhatItShows) {
  const std::string svg = field_svg(cone(), {.width = 520.0});
  EXPECT_EQ(testing::xml_problem(svg), "");
  for (const char* word : {">front &amp; first<", ">thin<", ">rest<", ">30<", "after 100 ms"}) {
    EXPECT_NE(svg.find(word), std::string::npos) << word;
  }
  EXPECT_EQ(testing::count_of(svg, "pc-area-series-2"), 7U) << "one area for each level";
  EXPECT_EQ(svg.find("nan"), std::string::npos);
}

TEST(FieldFigure, OfAColdEyeHasNoIsotherm) {
  TemperatureField field = cone();
  for (float& value : field.temperature_rise_K) value = 0.0F;
  const std::string svg = field_svg(field, {.width = 310.0});
  EXPECT_EQ(testing::xml_problem(svg), "");
  EXPECT_EQ(testing::count_of(svg, "pc-area-series-2"), 0U);
}

TEST(FieldFigure, IsOnThePageOfARunThatHasAField) {
  testing::RunFolder run;
  run.write();
  write_report(run.path);
  EXPECT_EQ(run.get("report.html").find("Isotherms over radius"), std::string::npos);
  run.put("field.vtr", to_vtr(cone()));
  write_report(run.path);
  EXPECT_EQ(testing::count_of(run.get("report.html"), "Isotherms over radius"), 2U)
      << "wide and narrow";
}

}  // namespace
}  // namespace photocoag
