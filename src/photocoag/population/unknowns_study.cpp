#include "photocoag/population/unknowns_study.hpp"

#include <cmath>

#include "photocoag/core/error.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/population/draws.hpp"
#include "photocoag/population/plain_loop.hpp"

namespace photocoag {
namespace {

constexpr double kLowestBeta = 0.5;
constexpr double kHighestBeta = 2.0;

using Cycle = UnknownsCycle;
constexpr CycleNumber<Cycle> kNumbers[] = {{&Cycle::alpha, true}, {&Cycle::beta, true},
                                           {&Cycle::peak, true},  {&Cycle::nees_alpha},
                                           {&Cycle::nees_beta},   {&Cycle::at_bound}};

double square(double value) { return value * value; }

bool at_bound(const EstimatorSettings& s, const Estimate& estimate) {
  const bool alpha = estimate.absorption_factor <= s.absorption_min ||
                     estimate.absorption_factor >= s.absorption_max;
  const bool beta =
      s.unknowns == Unknowns::kRpeAndChoroid &&
      (estimate.choroid_factor <= s.choroid_min || estimate.choroid_factor >= s.choroid_max);
  return alpha || beta;
}

}  // namespace

UnknownsResult unknowns_study(const Config& config, ModelStore& models, const UnknownsCase& which,
                              int seeds) {
  const ReducedModel& model = models.reduced();
  if (model.parameters.size() != 2) {
    throw Error(ErrorParts{.key = "tissue.layers",
                           .problem = "this comparison needs a model with two absorption factors",
                           .found = "no absorbing layer with scaled_by = \"beta\"",
                           .accepted = "for example --config configs/two-unknowns.toml"});
  }
  const bool two = which.estimator.unknowns == Unknowns::kRpeAndChoroid;
  const Controller fresh(model, config.control, which.estimator);
  const auto full = models.plant_full();
  UnknownsResult result{
      .which = which, .cycles = std::vector<UnknownsCycle>(config.cycles()), .limit_exceeded = 0};
  for (int i = 1; i <= seeds; ++i) {
    const StudyDraws draws(i, 0);
    const StudyDraws noise(i, 1);
    const double alpha = SpotRange{}.alpha(draws.uniform(0));
    const double beta = which.choroid_varies
                            ? kLowestBeta * std::pow(kHighestBeta / kLowestBeta, draws.uniform(1))
                            : 1.0;
    Controller controller = fresh;
    FullOrderPlant eye(full, config.plant.discretization, config.control.period, {alpha, beta});
    bool exceeded = false;
    const auto sample = [&](double volume, std::size_t k) {
      return volume + config.plant.noise * noise.normal(k);
    };
    const auto look = [&](const Outputs& truth, const Estimate& estimate, std::size_t k) {
      UnknownsCycle& sum = result.cycles[k];
      sum.alpha += square(estimate.absorption_factor / alpha - 1.0);
      sum.beta += square(estimate.choroid_factor / beta - 1.0);
      sum.peak += square(estimate.outputs.peak - truth.peak);
      sum.nees_alpha += square((estimate.absorption_factor - alpha) / estimate.absorption_sigma);
      if (two) sum.nees_beta += square((estimate.choroid_factor - beta) / estimate.choroid_sigma);
      sum.at_bound += at_bound(which.estimator, estimate) ? 1.0 : 0.0;
      exceeded = exceeded || truth.peak > config.control.peak_max;
    };
    run_plain_loop(controller, eye, result.cycles.size(), which.dark, kAllPower, sample, look);
    result.limit_exceeded += exceeded ? 1 : 0;
  }
  for (Cycle& sum : result.cycles) divide(sum, kNumbers, seeds);
  return result;
}

UnknownsCycle UnknownsResult::over(std::size_t begin, std::size_t end) const {
  return mean_over(cycles, kNumbers, begin, end);
}

std::vector<UnknownsCase> unknowns_cases(const Config& config) {
  std::vector<UnknownsCase> cases;
  struct Change {
    bool vague = false;  // sigma of the priors 1
    bool wide = false;   // bounds that do not count
    bool dark = false;
  };
  const auto add = [&](const char* name, Unknowns unknowns, bool varies, const Change& change) {
    for (const EstimatorKind kind : {EstimatorKind::kEkf, EstimatorKind::kMhe}) {
      EstimatorSettings s = config.estimator;
      s.kind = kind;
      s.unknowns = unknowns;
      if (change.vague) s.absorption_sigma_initial = s.choroid_sigma_initial = 1.0;
      if (change.wide) {
        s.absorption_min = 0.05;
        s.absorption_max = 5.0;
        s.choroid_min = 0.05;
        s.choroid_max = 20.0;
      }
      cases.push_back({.name = std::string(kind == EstimatorKind::kEkf ? "ekf, " : "mhe, ") + name,
                       .estimator = s,
                       .choroid_varies = varies,
                       .dark = change.dark});
    }
  };
  add("one unknown, choroid known", Unknowns::kRpe, false, {});
  add("one unknown, choroid assumed 1", Unknowns::kRpe, true, {});
  constexpr Unknowns kBoth = Unknowns::kRpeAndChoroid;
  add("two unknowns", kBoth, true, {});
  add("two unknowns, wide bounds", kBoth, true, {.wide = true});
  add("two, vague prior", kBoth, true, {.vague = true});
  add("two, vague prior, wide bounds", kBoth, true, {.vague = true, .wide = true});
  add("two unknowns, no light", kBoth, true, {.dark = true});
  return cases;
}

}  // namespace photocoag
