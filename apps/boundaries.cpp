// `photocoag boundaries`: checks that the tissue is large enough.

#include <cmath>
#include <vector>

#include "command.hpp"
#include "configured.hpp"
#include "console.hpp"
#include "options.hpp"
#include "photocoag/run/boundaries.hpp"

namespace photocoag {
namespace {

int boundaries(const CommonOptions& options) {
  const Config config = configured(Use::kBoundaries, options.config, options.set);
  constexpr double kSteady =
      1000.0;  // s: many times the slowest time constant of any sensible domain
  constexpr double kLarge = 0.01;
  const std::vector<double> times = {0.1, 0.4, kSteady};
  const std::vector<BoundaryEffect> effects =
      boundary_effects(config.tissue, config.grid, config.plant.absorption(), times);
  print("Change of the peak gain when a boundary (zero temperature rise) moves out, %\n");
  print("{:<8} {:<30} {:>8} {:>8} {:>8}\n", "boundary", "moved", "100 ms", "400 ms", "steady");
  bool large = false;
  for (const BoundaryEffect& effect : effects) {
    print("{:<8} {:<30}", effect.boundary, effect.moved);
    for (const double change : effect.change) {
      print(" {:8.2f}", 100.0 * change);
      large = large || std::abs(change) > kLarge;
    }
    print("\n");
  }
  if (large) {
    say("warning   a change above 1 %: the model's long treatments are too cold by so much, and "
        "its "
        "reference power too high; move that boundary out (the front: a layer of vitreous)\n");
  }
  return 0;
}

const Command kBoundaries(
    "boundaries", "tell whether [tissue] is large enough: move each boundary out, compare the peak",
    boundaries, [](CommandLine& command, CommonOptions& options) {
      add_common(command, options);
      command.footer(
          footer("  photocoag boundaries\n"
                 "  photocoag boundaries --set tissue.domain_radius_um=1000"));
    });

}  // namespace

}  // namespace photocoag
