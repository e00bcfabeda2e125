#include "photocoag/population/information.hpp"

#include <algorithm>
#include <cmath>

#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/core/random.hpp"
#include "photocoag/population/plain_loop.hpp"

namespace photocoag {
namespace {

// Relative standard deviation of an exactly known quantity; 0 would make the covariance singular.
constexpr double kKnown = 1e-5;
constexpr std::uint64_t kSeed = 20260101;
constexpr std::uint64_t kMostAttempts = 1000;

// ln q of an eye: drawn from the belief, all redrawn if one is outside its box.
QuantityVector draw(const Belief& belief, const Eigen::MatrixXd& root, std::uint64_t eye) {
  const auto m = static_cast<Eigen::Index>(belief.quantities.size());
  QuantityVector logs(m);
  for (std::uint64_t attempt = 0; attempt < kMostAttempts; ++attempt) {
    Eigen::VectorXd score(m);
    for (Eigen::Index q = 0; q < m; ++q) {
      score[q] =
          standard_normal(kSeed + attempt, eye * kMaxQuantities + static_cast<std::uint64_t>(q),
                          RandomStream::kStudy);
    }
    logs = Eigen::Map<const Eigen::VectorXd>(belief.mean.data(), m) + root * score;
    bool inside = true;
    for (Eigen::Index q = 0; q < m; ++q) {
      const UncertainQuantity& quantity = belief.quantities[static_cast<std::size_t>(q)];
      inside = inside && logs[q] >= std::log(quantity.low) && logs[q] <= std::log(quantity.high);
    }
    if (inside) break;
  }
  return logs;
}

// The belief with quantity `known` at its mean; -1: as it is.
Belief with_known(Belief belief, int known) {
  if (known < 0) return belief;
  const std::size_t n = belief.quantities.size();
  const auto k = static_cast<std::size_t>(known);
  for (std::size_t i = 0; i < n; ++i) {
    belief.covariance[i * n + k] = belief.covariance[k * n + i] = 0.0;
  }
  belief.covariance[k * n + k] = kKnown * kKnown;
  return belief;
}

// The uncertain model at one ln q, as an eye.
struct UncertainPlant {
  UncertainPlant(const UncertainModel& model, double period, const QuantityVector& logs) {
    ResidueSlopes none;
    model.step_of(period, decay, gain);
    model.evaluate(logs, peak, none, volume, none);
    for (std::size_t q = 0; q < model.quantities.size(); ++q) {
      if (model.quantities[q].kind == QuantityKind::kCalibration) {
        calibration = std::exp(logs[static_cast<Eigen::Index>(q)]);
      }
    }
    x = StateVector::Zero(model.order());
  }
  void step(double power) noexcept { x = decay.cwiseProduct(x) + gain * power; }
  Outputs outputs() const noexcept { return {calibration * volume.dot(x), peak.dot(x)}; }

  StateVector decay, gain, peak, volume, x;
  double calibration = 1.0;
};

void treat(const Config& config, const ReducedModel& model, const EstimatorSettings& settings,
           const QuantityVector& logs, std::uint64_t eye, InformationCase& sums) {
  const double noise =
      settings.prior.noise > 0.0 ? settings.prior.noise : settings.measurement_noise;
  Controller controller(model, config.control, settings);
  UncertainPlant plant(*model.uncertain, config.control.period, logs);
  const std::size_t cycles = sums.peak_sigma.size();
  double late = 0.0;
  const auto sample = [&](double volume, std::size_t k) {
    return volume + noise * standard_normal(eye, k, RandomStream::kMeasurementNoise);
  };
  const auto look = [&](const Outputs& truth, const Estimate& estimate, std::size_t k) {
    const double scale = truth.peak > 0.0 ? config.control.peak_reference / truth.peak : 0.0;
    sums.peak_sigma[k] += estimate.peak_sigma * scale * estimate.peak_sigma * scale;
    const double error = (estimate.outputs.peak - truth.peak) * scale;
    sums.peak_error[k] += error * error;
    if (2 * k >= cycles) late += truth.peak;
  };
  run_plain_loop(controller, plant, cycles, false, kAllPower, sample, look);
  sums.held +=
      late / static_cast<double>(cycles - (cycles + 1) / 2) - config.control.peak_reference;
}

}  // namespace

std::string quantity_name(const UncertainQuantity& quantity) {
  std::string name(to_string(quantity.kind));
  std::replace(name.begin(), name.end(), '_', ' ');
  return quantity.layer.empty() ? name : name + " of " + quantity.layer;
}

Information information_of(const Config& config, const ReducedModel& model, std::size_t eyes) {
  if (!model.uncertain || !config.estimator.prior.declared()) {
    throw Error(ErrorParts{.key = "prior",
                           .problem = "nothing is uncertain",
                           .accepted = "a configuration with [[prior]] and control.robust = "
                                       "\"chance\" or estimator.kind = \"posterior\""});
  }
  Information information{.eyes = eyes, .period = config.control.period, .cases = {}};
  const auto count = static_cast<int>(config.estimator.prior.quantities.size());
  for (int known = -1; known < count; ++known) {
    EstimatorSettings settings = config.estimator;
    settings.prior = with_known(settings.prior, known);
    const Eigen::MatrixXd root = *cholesky(settings.prior.covariance_matrix());
    InformationCase one;
    if (known >= 0) {
      one.known = quantity_name(settings.prior.quantities[static_cast<std::size_t>(known)]);
    }
    one.peak_sigma.assign(config.cycles(), 0.0);
    one.peak_error.assign(config.cycles(), 0.0);
    for (std::uint64_t eye = 0; eye < eyes; ++eye) {
      treat(config, model, settings, draw(settings.prior, root, eye), eye, one);
    }
    const auto mean = [&](double sum) { return sum / static_cast<double>(eyes); };
    for (double& sum : one.peak_sigma) sum = std::sqrt(mean(sum));
    for (double& sum : one.peak_error) sum = std::sqrt(mean(sum));
    one.held = mean(one.held);
    information.cases.push_back(std::move(one));
  }
  return information;
}

}  // namespace photocoag
