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
  const Figure figure = field_figure(cone());
  ASSERT_EQ(figure.panels.at(0).contours.size(), 7U);
  for (int n = 1; n <= 7; ++n) {
    const Contour& contour = figure.panels[0].contours[static_cast<std::size_t>(n - 1)];
    EXPECT_EQ(contour.label, std::to_string(5 * n));
    ASSERT_EQ(contour.lines.size(), 1U);
    std::size_t on_line = 0;
    for (std::size_t k = 0; k < contour.lines[0].x.size(); ++k) {
      const double r = std::abs(contour.lines[0].x[k]);
      const double z = std::abs(contour.lines[0].y[k] - 302.5);
      // Linear between centers but for the float and the kinks at the axis and the middle: 2.5 um
      // there. What is at the border of the view is at least as hot.
      const bool border = r > 392.0 || z > 290.0;
      EXPECT_NEAR(border ? std::min(40.0 - 0.1 * (r + z), 5.0 * n) : 40.0 - 0.1 * (r + z), 5.0 * n,
                  border ? 40.0 : 0.26);
      on_line += !border && std::abs(40.0 - 0.1 * (r + z) - 5.0 * n) < 1e-4 ? 1 : 0;
    }
    EXPECT_GT(on_line, 10U) << contour.label;
  }
}

TEST(FieldFigure, IsWellFormedAndNamesWhatItShows) {
  const std::string svg = figure_svg(field_figure(cone()), SvgKind::kInline);
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
  const std::string svg = figure_svg(field_figure(field), SvgKind::kPicture);
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
