// Role: offline; lines of equal value of a field on a rectangular grid. Used by page, report.
// Source: marching squares. Differences: every line is closed, if necessary along the grid's
// border, so that it bounds an area. Units: the caller's. Real-time promise: none. Threads: none.
#pragma once

#include <cstddef>
#include <vector>

namespace photocoag {

/// Values at the crossings of x and y, both ascending, at least two each.
struct GridField {
  std::vector<double> x, y;
  std::vector<double> values;  ///< x fastest
};

/// A closed line; the last point joins the first. Higher values lie on its left as y goes up.
struct Isoline {
  std::vector<double> x, y;
};

/// The lines around all places with a value of at least `level`, linear between neighbours on the
/// grid; at a saddle the mean of its four corners decides. Precondition: finite values.
std::vector<Isoline> isolines(const GridField& field, double level);

/// Multiples of a round step below the highest value, about `wanted` of them; none if it is not
/// above 0.
std::vector<double> isoline_levels(double highest, double wanted);

}  // namespace photocoag
