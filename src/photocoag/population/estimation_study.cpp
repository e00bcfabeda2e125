#include "photocoag/population/estimation_study.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/population/draws.hpp"
#include "photocoag/population/plain_loop.hpp"

namespace photocoag {
namespace {

constexpr double kOutlierSize = 20.0;  // K

using Cycle = EstimationCycle;
constexpr CycleNumber<Cycle> kNumbers[] = {{&Cycle::nees},
                                           {&Cycle::nees_alpha},
                                           {&Cycle::nees_peak},
                                           {&Cycle::rms_alpha, true},
                                           {&Cycle::rms_peak, true},
                                           {&Cycle::sigma_alpha},
                                           {&Cycle::moved_alpha, true}};

double square(double value) { return value * value; }

// e' P^-1 e per dimension. Directions that the estimator knows exactly (variance below rounding, as
// those of a cold tissue) are left out. In correlations, so that no unit enters.
double normalized_square(const Eigen::MatrixXd& covariance, const Eigen::VectorXd& error) {
  constexpr double kKnown = 1e-9;
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseSqrt();
  if (!(sigma.array() > 0.0).all()) return std::numeric_limits<double>::quiet_NaN();
  const Eigen::VectorXd inverse = sigma.cwiseInverse();
  const SymmetricEigen<double> eigen =
      symmetric_eigen(Eigen::MatrixXd(inverse.asDiagonal() * covariance * inverse.asDiagonal()));
  const Eigen::VectorXd along = eigen.vectors.transpose() * error.cwiseProduct(inverse);
  double sum = 0.0;
  int dimensions = 0;
  for (Eigen::Index i = 0; i < along.size(); ++i) {
    if (eigen.values[i] < kKnown) continue;
    sum += square(along[i]) / eigen.values[i];
    ++dimensions;
  }
  return sum / dimensions;
}

template <typename P>
double state_nees(const Controller& controller, const P& plant, AbsorptionFactors truth) {
  if constexpr (requires { plant.state(); }) {
    const auto& filter = controller.filter();
    const Eigen::Index n = filter.state().size();
    Eigen::VectorXd error(filter.covariance().rows());
    error.head(n) = filter.state() - plant.state();
    error[n] = filter.absorption_factor() - truth.alpha;
    if (error.size() == n + 2) error[n + 1] = filter.choroid_factor() - truth.beta;
    return normalized_square(filter.covariance(), error);
  } else {
    return 0.0;
  }
}

void add_errors(const Config& config, const Estimate& estimate, const Outputs& truth, double alpha,
                Cycle& sum) {
  const double alpha_error = estimate.absorption_factor - alpha;
  sum.nees_alpha += square(alpha_error / estimate.absorption_sigma);
  const double peak_error = estimate.outputs.peak - truth.peak;
  if (estimate.peak_sigma > 0.0) sum.nees_peak += square(peak_error / estimate.peak_sigma);
  sum.rms_alpha += square(alpha_error / alpha);
  sum.rms_peak += square(peak_error);
  sum.sigma_alpha += estimate.absorption_sigma;
  sum.moved_alpha += square(estimate.absorption_factor - config.estimator.absorption_initial);
}

// The sample at the end of cycle k; NaN: none.
double disturbed(const EstimationScenario& scenario, double noisy, std::size_t k,
                 const StudyDraws& draws) {
  if (k >= scenario.gap_begin && k < scenario.gap_end) return Sample{}.volume_temperature;
  const double u = draws.uniform(k);
  if (u < scenario.missing) return Sample{}.volume_temperature;
  if (scenario.bias_begin > 0 && k >= scenario.bias_begin) noisy += scenario.bias;
  if (u > 1.0 - 0.5 * scenario.outliers) return noisy + kOutlierSize;
  if (u > 1.0 - scenario.outliers) return noisy - kOutlierSize;
  return noisy;
}

template <Plant P>
void treat_one(const Config& config, const EstimationScenario& scenario, Controller controller,
               P plant, double alpha, int seed, std::vector<Cycle>& sums) {
  const StudyDraws noise(seed, 1);
  const StudyDraws draws(seed, 2);
  const StudyDraws unknown_power(seed, 3);
  const double unknown =
      !scenario.full_order && scenario.matched_noise ? config.estimator.power_process_noise : 0.0;
  const auto emitted = [&](double power, std::size_t k) {
    return unknown > 0.0 ? power + unknown * unknown_power.normal(k) : power;
  };
  const auto sample = [&](double volume, std::size_t k) {
    return disturbed(scenario, volume + config.plant.noise * noise.normal(k), k, draws);
  };
  const auto look = [&](const Outputs& truth, const Estimate& estimate, std::size_t k) {
    add_errors(config, estimate, truth, alpha, sums[k]);
    sums[k].nees += state_nees(controller, plant, {alpha, config.plant.choroid_factor});
    if (estimate.status == UpdateStatus::kUpdated) {
      const auto& filter = controller.filter();
      sums[k].nis += square(filter.innovation() / filter.innovation_sigma());
      sums[k].used += 1.0;
    } else if (estimate.status == UpdateStatus::kOutlier) {
      sums[k].rejected += 1.0;
    }
  };
  run_plain_loop(controller, plant, sums.size(), scenario.dark, emitted, sample, look);
}

double draw_alpha(const Config& config, const EstimationScenario& scenario, int seed) {
  const StudyDraws draws(seed, 0);
  if (!scenario.matched_noise) {
    return SpotRange{}.alpha(draws.uniform(0));
  }
  const EstimatorSettings& s = config.estimator;
  double alpha = 0.0;
  std::uint64_t k = 0;
  do {
    alpha = s.absorption_initial + s.absorption_sigma_initial * draws.normal(k++);
  } while (alpha < s.absorption_min || alpha > s.absorption_max);
  return alpha;
}

}  // namespace

EstimationStatistics estimation_statistics(const Config& base, ModelStore& models,
                                           const EstimationScenario& scenario, int seeds) {
  Config config = base;
  if (scenario.prior_sigma > 0.0) {
    config.estimator.absorption_sigma_initial = scenario.prior_sigma;
  }
  std::vector<Cycle> sums(config.cycles());
  const ReducedModel& model = models.reduced();
  const Controller controller(model, config.control, config.estimator);
  for (int seed = 1; seed <= seeds; ++seed) {
    const double alpha = draw_alpha(config, scenario, seed);
    const AbsorptionFactors eye{alpha, config.plant.choroid_factor};
    if (scenario.full_order) {
      treat_one(config, scenario, controller,
                FullOrderPlant(models.plant_full(), config.plant.discretization,
                               config.control.period, eye),
                alpha, seed, sums);
    } else {
      treat_one(config, scenario, controller, ReducedPlant(model, eye), alpha, seed, sums);
    }
  }
  for (Cycle& sum : sums) {
    sum.nis /= std::max(1.0, sum.used);
    sum.rejected /= std::max(1.0, sum.used + sum.rejected);
    divide(sum, kNumbers, seeds);
  }
  return {.scenario = scenario, .cycles = std::move(sums)};
}

EstimationCycle EstimationStatistics::mean(std::size_t begin, std::size_t end) const {
  Cycle mean = mean_over(cycles, kNumbers, begin, end);
  end = std::min(end, cycles.size());
  for (std::size_t k = begin; k < end; ++k) {
    mean.nis += cycles[k].nis * cycles[k].used;
    mean.used += cycles[k].used;
    mean.rejected += cycles[k].rejected / static_cast<double>(end - begin);
  }
  mean.nis /= std::max(1.0, mean.used);
  return mean;
}

std::vector<EstimationScenario> estimation_scenarios(const Config& config) {
  const std::size_t cycles = config.cycles();
  return {{.name = "reduced eye, matched noise", .full_order = false, .matched_noise = true},
          {.name = "the same, prior sigma 0.002",
           .full_order = false,
           .matched_noise = true,
           .prior_sigma = 0.002},
          {.name = "reduced eye, no unknown power", .full_order = false},
          {.name = "full-order eye, alpha from the prior", .matched_noise = true},
          {.name = "full-order eye"},
          {.name = "full-order eye, no light", .dark = true},
          {.name = "full-order eye, 2 % outliers", .outliers = 0.02},
          {.name = "full-order eye, 20 % missing", .missing = 0.2},
          {.name = "full-order eye, gap of a fifth",
           .gap_begin = cycles / 5,
           .gap_end = 2 * (cycles / 5)},
          {.name = "full-order eye, +5 K from half on", .bias_begin = cycles / 2, .bias = 5.0}};
}

}  // namespace photocoag
