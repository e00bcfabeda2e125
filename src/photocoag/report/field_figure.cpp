#include "photocoag/report/field_figure.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace photocoag {
namespace {

constexpr double kMicro = 1e6;

double center_um(const std::vector<double>& faces, std::size_t cell) {
  return 0.5 * kMicro * (faces[cell] + faces[cell + 1]);
}

struct View {
  double radius, front, back;  // um
};

// The values between the centers of the cells in view, mirrored at the axis.
GridField grid_of(const TemperatureField& field, const View& view) {
  GridField grid;
  std::vector<std::size_t> radial, axial;
  for (std::size_t i = 0; i < field.radial_cells(); ++i)
    if (center_um(field.radius_m, i) <= view.radius) radial.push_back(i);
  std::vector<std::size_t> across(radial.rbegin(), radial.rend());
  across.insert(across.end(), radial.begin(), radial.end());
  for (std::size_t n = 0; n < across.size(); ++n) {
    const double radius = center_um(field.radius_m, across[n]);
    grid.x.push_back(n < radial.size() ? -radius : radius);
  }
  for (std::size_t j = 0; j < field.axial_cells(); ++j) {
    const double depth = center_um(field.depth_m, j);
    if (depth < view.front || depth > view.back) continue;
    grid.y.push_back(depth);
    for (const std::size_t i : across) grid.values.push_back(field.at(i, j));
  }
  return grid;
}

// A line where each layer begins, its name below; layers too thin for one share the line above the
// first of them.
std::vector<Level> layers(const TemperatureField& field, const View& view) {
  const double room = 25.0 * view.radius / 232.0;  // of a name, um
  std::vector<Level> levels;
  double front = 0.0, thin_at = 0.0;
  std::string thin;
  const auto flush = [&] {
    if (!thin.empty()) levels.push_back({thin, thin_at, Ink::kMuted, Dash::kSolid});
    thin.clear();
  };
  for (std::size_t k = 0; k < field.layer_names.size(); ++k) {
    const double top = std::clamp(front * kMicro, view.front, view.back);
    front = field.layer_back_m[k];
    const double height = std::min(front * kMicro, view.back) - top;
    if (height <= 0.0) continue;
    if (height < room) {
      levels.push_back({"", top, Ink::kMuted, Dash::kSolid});
      if (thin.empty()) thin_at = top;
      thin += (thin.empty() ? "" : ", ") + field.layer_names[k];
      continue;
    }
    flush();
    levels.push_back({field.layer_names[k], top, Ink::kMuted, Dash::kSolid, true});
  }
  flush();
  return levels;
}

}  // namespace

Figure field_figure(const TemperatureField& field) {
  std::size_t peak = 0;
  for (std::size_t j = 0; j < field.axial_cells(); ++j)
    if (field.at(0, j) > field.at(0, peak)) peak = j;
  const double highest = field.at(0, peak), depth = center_um(field.depth_m, peak);
  const double spot = field.spot_radius_m * kMicro;
  const View view{std::min(4.0 * spot, field.radius_m.back() * kMicro),
                  std::max(field.depth_m.front() * kMicro, depth - 300.0),
                  std::min(field.depth_m.back() * kMicro, depth + 450.0)};
  Panel panel{.title = fmt::format("Temperature rise in K after {:g} ms", field.time_s * 1e3),
              .levels = layers(field, view),
              .y_min = view.front,
              .y_max = view.back,
              .y_down = true};
  const GridField grid = grid_of(field, view);
  for (const double level : isoline_levels(highest, 8.0))
    panel.contours.push_back({fmt::format("{:g}", level), isolines(grid, level)});
  for (const double edge : {-spot, spot})
    panel.series.push_back({.legend = edge < 0.0 ? "" : "edge of the laser spot",
                            .x = {edge, edge},
                            .y = {view.front, depth},
                            .ink = Ink::kNeutral,
                            .dash = Dash::kDashed,
                            .width = 1.0});
  return {.description = fmt::format("Isotherms over radius and depth after {:g} ms: highest cell "
                                     "{:.2f} K at a depth of {:.0f} micrometres",
                                     field.time_s * 1e3, highest, depth),
          .x_label = "radius; depth downwards, in µm",
          .x_min = -view.radius,
          .x_max = view.radius,
          .panels = {std::move(panel)},
          .mirrored = true,
          .equal_scale = true};
}

}  // namespace photocoag
