// The .vtr file: read back, and taken apart by hand as VTK's documents describe it.
#include "photocoag/core/vtk.hpp"

#include <gtest/gtest.h>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

TemperatureField small_field() {
  TemperatureField field;
  field.radius_m = {0.0, 1e-5, 3e-5};
  field.depth_m = {0.0, 1e-6, 2e-6, 5e-6};
  field.temperature_rise_K = {1.0F, 2.0F, 3.5F, -4.0F, 5.0F, 6.25F};
  field.time_s = 0.25;
  field.spot_radius_m = 1e-5;
  field.layer_back_m = {2e-6, 5e-6};
  field.layer_names = {"RPE", "a<b"};
  return field;
}

TEST(Vtk, ReadsBackWhatItWrote) {
  const TemperatureField field = small_field();
  const TemperatureField back = from_vtr(to_vtr(field), "here");
  EXPECT_EQ(back.radius_m, field.radius_m);
  EXPECT_EQ(back.depth_m, field.depth_m);
  EXPECT_EQ(back.temperature_rise_K, field.temperature_rise_K);
  EXPECT_EQ(back.time_s, field.time_s);
  EXPECT_EQ(back.spot_radius_m, field.spot_radius_m);
  EXPECT_EQ(back.layer_back_m, field.layer_back_m);
  EXPECT_EQ(back.layer_names, field.layer_names);
  EXPECT_EQ(back.at(1, 1), -4.0);
}

TEST(Vtk, IsTheFormatOfTheDocuments) {
  const std::string text = to_vtr(small_field());
  // Points 3 x 4 x 1, so extents of cells 0 2 0 3 0 0, the same in grid and piece.
  EXPECT_NE(text.find("<RectilinearGrid WholeExtent=\"0 2 0 3 0 0\">"), std::string::npos);
  EXPECT_NE(text.find("<Piece Extent=\"0 2 0 3 0 0\">"), std::string::npos);
  EXPECT_NE(text.find("header_type=\"UInt64\""), std::string::npos);
  // UInt64 8, then the double 0.25: 08 00 … 00 | 00 … 00 d0 3f, encoded by another program.
  EXPECT_NE(text.find(">CAAAAAAAAAAAAAAAAADQPw==<"), std::string::npos) << text;
  // Names as character codes: no markup can get in.
  EXPECT_NE(text.find(">82 80 69 0 97 60 98 0 <"), std::string::npos);
}

TEST(Vtk, RefusesWhatIsNoField) {
  const std::string good = to_vtr(small_field());
  EXPECT_THROW(from_vtr("", "here"), Error);
  EXPECT_THROW(from_vtr(good.substr(0, good.size() / 2), "here"), Error);
  std::string shorter = good;  // one group of base64 less than the header says
  shorter.erase(shorter.find("</DataArray>\n</CellData>") - 8, 4);
  EXPECT_THROW(from_vtr(shorter, "here"), Error);
  std::string wrong = good;
  wrong[wrong.find("</DataArray>\n</CellData>") - 6] = '*';
  EXPECT_THROW(from_vtr(wrong, "here"), Error);
}

TEST(Vtk, ListsFilesWithTheirTimes) {
  const std::string text = to_pvd({"a.vtr", "b.vtr"}, {0.001, 0.25});
  EXPECT_NE(text.find("<DataSet timestep=\"0.25\" part=\"0\" file=\"b.vtr\"/>"), std::string::npos);
}

}  // namespace
}  // namespace photocoag
