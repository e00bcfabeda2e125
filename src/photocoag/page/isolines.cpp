#include "photocoag/page/isolines.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "photocoag/page/layout.hpp"

namespace photocoag {
namespace {

// A crossing lies between two neighbours of the grid, the first one inside.
struct Crossing {
  std::size_t inside, outside;
  auto operator<=>(const Crossing&) const = default;
};

// The grid with a surrounding ring below every level, at the border's coordinates.
struct Padded {
  std::vector<double> x, y, values;
  double level;

  std::size_t at(std::size_t i, std::size_t j) const { return i + j * x.size(); }
  bool hot(std::size_t node) const { return values[node] >= level; }

  std::pair<double, double> place(const Crossing& crossing) const {
    const double high = values[crossing.inside], low = values[crossing.outside];
    const double share = std::isfinite(low) ? (high - level) / (high - low) : 0.0;
    const auto between = [&](const std::vector<double>& axis, std::size_t a, std::size_t b) {
      return axis[a] + share * (axis[b] - axis[a]);
    };
    return {between(x, crossing.inside % x.size(), crossing.outside % x.size()),
            between(y, crossing.inside / x.size(), crossing.outside / x.size())};
  }
};

Padded pad(const GridField& field, double level) {
  const auto widen = [](std::vector<double> axis) {
    axis.insert(axis.begin(), axis.front());
    axis.push_back(axis.back());
    return axis;
  };
  Padded padded{widen(field.x), widen(field.y), {}, level};
  padded.values.assign(padded.x.size() * padded.y.size(), -INFINITY);
  for (std::size_t j = 0; j < field.y.size(); ++j)
    std::copy_n(field.values.begin() + static_cast<std::ptrdiff_t>(j * field.x.size()),
                field.x.size(),
                padded.values.begin() + static_cast<std::ptrdiff_t>(padded.at(1, j + 1)));
  return padded;
}

// From crossing to crossing with the inside on the left.
using Links = std::map<Crossing, Crossing>;

void link_cell(const Padded& grid, std::size_t i, std::size_t j, Links& links) {
  const std::array<std::size_t, 4> corner = {grid.at(i, j), grid.at(i + 1, j),
                                             grid.at(i + 1, j + 1), grid.at(i, j + 1)};
  std::array<std::size_t, 2> leaves{}, enters{};  // sides on which the way round goes out and in
  std::size_t count = 0, entered = 0;
  double sum = 0.0;
  for (std::size_t k = 0; k < 4; ++k) {
    const bool here = grid.hot(corner[k]), next = grid.hot(corner[(k + 1) % 4]);
    if (here && !next) leaves[count++] = k;
    if (!here && next) enters[entered++] = k;
    sum += grid.values[corner[k]];
  }
  const bool joined = sum / 4.0 >= grid.level;  // at a saddle: the hot corners are one
  for (std::size_t n = 0; n < count; ++n) {
    const std::size_t from = leaves[n];
    std::size_t to = enters[0];
    // Apart: the side before the hot corner; joined: the one after the cold corner.
    if (count == 2) to = joined ? (from + 1) % 4 : (from + 3) % 4;
    links[{corner[from], corner[(from + 1) % 4]}] = {corner[(to + 1) % 4], corner[to]};
  }
}

}  // namespace

std::vector<Isoline> isolines(const GridField& field, double level) {
  const Padded grid = pad(field, level);
  Links links;
  for (std::size_t j = 0; j + 1 < grid.y.size(); ++j)
    for (std::size_t i = 0; i + 1 < grid.x.size(); ++i) {
      // Most cells have all corners on one side.
      const bool hot = grid.hot(grid.at(i, j));
      if (hot != grid.hot(grid.at(i + 1, j)) || hot != grid.hot(grid.at(i, j + 1)) ||
          hot != grid.hot(grid.at(i + 1, j + 1))) {
        link_cell(grid, i, j, links);
      }
    }
  std::vector<Isoline> lines;
  while (!links.empty()) {
    Isoline& line = lines.emplace_back();
    for (auto next = links.begin(); next != links.end();) {
      const auto [x, y] = grid.place(next->first);
      const Crossing to = next->second;
      line.x.push_back(x);
      line.y.push_back(y);
      links.erase(next);
      next = links.find(to);
    }
  }
  return lines;
}

std::vector<double> isoline_levels(double highest, double wanted) {
  if (!(highest > 0.0) || !std::isfinite(highest)) return {};
  const double step = figure_detail::choose_ticks(0.0, highest, wanted).step;
  std::vector<double> levels;
  for (int k = 1; k * step < highest; ++k) levels.push_back(k * step);
  return levels;
}

}  // namespace photocoag
