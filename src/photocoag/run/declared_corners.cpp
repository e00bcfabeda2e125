#include "photocoag/run/declared_corners.hpp"

#include <algorithm>
#include <numeric>

#include "photocoag/core/parallel.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kCombined = 7;    // most quantities of which all combinations are tried
constexpr double kLeastEffect = 0.001;  // of the limit: least effect of such a quantity alone

using Signs = std::vector<int>;

struct Effect {
  double size = 0.0;  // K, largest change of the peak
  int early = 1;      // sign that raises the first peak
  int late = 1;       // and the last
};

Effect effect_of(std::size_t quantity, const Config& config, const ReducedModel& model,
                 const std::vector<DeclaredQuantity>& quantities, const std::vector<double>& alphas,
                 std::size_t cells, std::size_t periods) {
  const Eigen::MatrixXd none = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(periods), 1);
  const auto moved = [&](int sign) {
    Signs signs(quantities.size(), 0);
    signs[quantity] = sign;
    return DeclaredEye(config, declared_tissue(config, quantities, signs), cells, periods);
  };
  const DeclaredEye less = moved(-1);
  const DeclaredEye more = moved(1);
  Effect effect;
  for (const double alpha : alphas) {
    const Eigen::VectorXd change =
        more.treat(config, model, alpha, none) - less.treat(config, model, alpha, none);
    effect.size = std::max(effect.size, change.cwiseAbs().maxCoeff());
    effect.early = change[0] > 0.0 ? 1 : -1;
    effect.late = change[change.size() - 1] > 0.0 ? 1 : -1;
  }
  return effect;
}

}  // namespace

std::vector<std::vector<int>> declared_corners(const Config& config, const ReducedModel& model,
                                               const std::vector<DeclaredQuantity>& quantities,
                                               const std::vector<double>& alphas, std::size_t cells,
                                               std::size_t periods) {
  const std::size_t count = quantities.size();
  std::vector<Effect> effects(count);
  for_each_in_parallel(count, [&](std::size_t i) {
    effects[i] = effect_of(i, config, model, quantities, alphas, cells, periods);
  });
  std::vector<std::size_t> combined(count);
  std::iota(combined.begin(), combined.end(), std::size_t{0});
  std::stable_sort(combined.begin(), combined.end(),
                   [&](std::size_t i, std::size_t j) { return effects[i].size > effects[j].size; });
  if (combined.size() > kCombined) combined.resize(kCombined);
  while (!combined.empty() &&
         effects[combined.back()].size < kLeastEffect * config.control.peak_max) {
    combined.pop_back();
  }
  Signs early(count);
  Signs late(count);
  for (std::size_t i = 0; i < count; ++i) {
    const bool both = std::find(combined.begin(), combined.end(), i) != combined.end();
    early[i] = both ? 0 : effects[i].early;
    late[i] = both ? 0 : effects[i].late;
  }
  std::vector<Signs> bases{late};
  if (early != late) bases.push_back(early);
  std::vector<Signs> corners;
  for (const Signs& base : bases) {
    for (std::size_t bits = 0; bits < std::size_t{1} << combined.size(); ++bits) {
      corners.push_back(base);
      for (std::size_t i = 0; i < combined.size(); ++i) {
        corners.back()[combined[i]] = (bits >> i & 1) ? 1 : -1;
      }
    }
  }
  return corners;
}

}  // namespace photocoag
