#include "photocoag/fom/grid.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "photocoag/core/error.hpp"
#include "photocoag/fom/full_order_model.hpp"
#include "support/thrown.hpp"
#include "support/tissues.hpp"

namespace photocoag {
namespace {

using testing::various_tissues;

bool has_face(const Axis& axis, double at) {
  return std::any_of(axis.faces.begin(), axis.faces.end(),
                     [at](double face) { return std::abs(face - at) <= 1e-12 * at; });
}

double largest_ratio(const Axis& axis) {
  double largest = 1.0;
  for (std::size_t i = 0; i + 1 < axis.cells(); ++i) {
    const double ratio = axis.width(i + 1) / axis.width(i);
    largest = std::max({largest, ratio, 1.0 / ratio});
  }
  return largest;
}

TEST(Grid, MeetsItsPromisesForManyTissuesAndSizes) {
  for (const auto& [name, tissue] : various_tissues()) {
    for (const std::size_t wanted : {1000U, 3000U, 10000U, 80000U, 300000U, 1000000U}) {
      SCOPED_TRACE(name + ", " + std::to_string(wanted));
      const Grid grid = make_grid(tissue, {.min_cells = wanted});
      EXPECT_GE(grid.cells(), wanted);
      // Not many more than asked for, or the user pays for what he did not order.
      EXPECT_LE(static_cast<double>(grid.cells()), 1.15 * static_cast<double>(wanted));
      for (const Axis* axis : {&grid.radial, &grid.axial}) {
        EXPECT_EQ(axis->faces.front(), 0.0);
        for (std::size_t i = 0; i < axis->cells(); ++i) ASSERT_GT(axis->width(i), 0.0) << i;
      }
      EXPECT_EQ(grid.radial.faces.back(), tissue.domain_radius);
      EXPECT_TRUE(has_face(grid.radial, tissue.spot_radius));
      double depth = 0.0;
      for (const Layer& layer : tissue.layers) {
        depth += layer.thickness;
        EXPECT_TRUE(has_face(grid.axial, depth)) << layer.name;
      }
      EXPECT_NEAR(grid.axial.faces.back(), depth, 1e-15);
      // Neighbours of much different width cost the second order. Grading alone gives 1.035 and
      // less; the rest is whole numbers of cells per layer (a layer of 4 um between two others).
      if (wanted >= 80000) {
        EXPECT_LE(largest_ratio(grid.radial), 1.06);
        EXPECT_LE(largest_ratio(grid.axial), 1.25);
      }
      if (wanted >= 1000000) {
        EXPECT_LE(largest_ratio(grid.axial), 1.05);
      }
    }
  }
}

TEST(Grid, RefinedHalvesEveryCell) {
  const Grid coarse = make_grid(Tissue{}, {.min_cells = 1000});
  const Grid fine = refined(coarse);
  EXPECT_EQ(fine.cells(), 4 * coarse.cells());
  for (std::size_t i = 0; i < coarse.axial.cells(); ++i) {
    EXPECT_EQ(fine.axial.faces[2 * i], coarse.axial.faces[i]);
    EXPECT_NEAR(fine.axial.width(2 * i), 0.5 * coarse.axial.width(i), 1e-18);
  }
}

TEST(Grid, RefusesSizesOutsideTheRange) {
  for (const std::size_t bad : {std::size_t{0}, std::size_t{999}, std::size_t{5000001}}) {
    EXPECT_EQ(testing::thrown_by([bad] { make_grid(Tissue{}, {.min_cells = bad}); }).key,
              "grid.min_cells");
  }
  Tissue bad;
  bad.peak_layer = "lens";
  EXPECT_EQ(testing::thrown_by([&bad] { make_grid(bad, {}); }).key, "tissue.peak_layer");
}

}  // namespace
}  // namespace photocoag
