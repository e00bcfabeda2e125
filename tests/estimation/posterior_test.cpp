// The posterior of several quantities: against a batch computation, its honesty, what it survives.
#include <gtest/gtest.h>

#include <limits>

#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/core/random.hpp"
#include "photocoag/estimation/posterior.hpp"
#include "support/heap_guard.hpp"
#include "support/uncertain_eyes.hpp"

namespace photocoag::testing {
namespace {

/// An eye that is one of the model's.
struct Eye {
  QuantityVector logs;
  StateVector x, decay, gain, peak, volume;
  ResidueSlopes unused;

  explicit Eye(const QuantityVector& at) : logs(at) {
    const UncertainModel& model = *seven_quantity_model();
    model.step_of(model.period, decay, gain);
    model.evaluate(logs, peak, unused, volume, unused);
    x.setZero(model.order());
  }
  void step(double power) { x = decay.cwiseProduct(x) + gain * power; }
  double sample() const { return std::exp(logs[6]) * volume.dot(x); }
  double true_peak() const { return peak.dot(x); }
};

double power_of(int k) { return k % 7 < 3 ? 0.05 : 0.02; }

// Gauss-Newton on every sample of the record by itself, to the end: shares no sums with the code.
QuantityVector batch_estimate(const std::vector<double>& samples, double noise) {
  const Belief belief = seven_quantities();
  const UncertainModel& model = *seven_quantity_model();
  StateVector decay, gain, peak, volume;
  ResidueSlopes peak_slope, volume_slope;
  model.step_of(model.period, decay, gain);
  const Eigen::MatrixXd information = inverse(belief.covariance_matrix());
  const Eigen::VectorXd mean = Eigen::Map<const Eigen::VectorXd>(belief.mean.data(), 7);
  Eigen::VectorXd at = mean;
  for (int step = 0; step < 60; ++step) {
    QuantityVector logs = at;
    model.evaluate(logs, peak, peak_slope, volume, volume_slope);
    const double factor = std::exp(at[6]);
    Eigen::MatrixXd H = information;
    Eigen::VectorXd g = information * (at - mean);
    StateVector x = StateVector::Zero(model.order());
    for (std::size_t k = 0; k < samples.size(); ++k) {
      x = decay.cwiseProduct(x) + gain * power_of(static_cast<int>(k));
      Eigen::VectorXd row = factor * (volume_slope.transpose() * x);
      row[6] = factor * volume.dot(x);
      const double residual = factor * volume.dot(x) - samples[k];
      H += row * row.transpose() / (noise * noise);
      g += row * residual / (noise * noise);
    }
    at -= solve(H, g);
  }
  return at;
}

TEST(Posterior, IsTheBatchEstimateOfTheWholeRecord) {
  PosteriorEstimator estimator(model_of_seven(), believing());
  Eye eye(logs_at({0.6, 0.3, 0.6, 0.4, 0.7, 0.6, 0.6}));
  std::vector<double> samples;
  for (int k = 0; k < 60; ++k) {
    eye.step(power_of(k));
    samples.push_back(eye.sample() + 0.288 * standard_normal(3, static_cast<std::uint64_t>(k),
                                                             RandomStream::kTest));
    estimator.predict(power_of(k));
    ASSERT_EQ(estimator.update(samples.back()), UpdateStatus::kUpdated);
  }
  const QuantityVector batch = batch_estimate(samples, 0.288);
  for (Eigen::Index q = 0; q < 7; ++q) {
    const double sigma = std::sqrt(estimator.covariance_of_logs()(q, q));
    // One Gauss-Newton step per sample is always a little behind.
    EXPECT_NEAR(estimator.log_quantities()[q], batch[q], 0.02 * sigma) << q;
  }
}

TEST(Posterior, TheInnovationsVarianceIsTheSamplesAndThatOfWhatIsBelieved) {
  const EstimatorSettings settings = believing();
  PosteriorEstimator estimator(model_of_seven(), settings);
  const UncertainModel& model = *seven_quantity_model();
  Eye eye(logs_at({0.6, 0.3, 0.6, 0.4, 0.7, 0.6, 0.6}));
  StateVector decay, gain, peak, volume;
  ResidueSlopes peak_slope, volume_slope;
  model.step_of(model.period, decay, gain);
  StateVector x = StateVector::Zero(model.order());
  for (int k = 0; k < 60; ++k) {
    x = decay.cwiseProduct(x) + gain * power_of(k);
    eye.step(power_of(k));
    estimator.predict(power_of(k));
    const QuantityVector at = estimator.log_quantities();
    const Eigen::MatrixXd covariance = estimator.covariance_of_logs();
    model.evaluate(at, peak, peak_slope, volume, volume_slope);
    Eigen::VectorXd row = volume_slope.transpose() * x;
    row[6] = volume.dot(x);
    row *= std::exp(at[6]);
    estimator.update(eye.sample() + 0.288 * standard_normal(3, static_cast<std::uint64_t>(k),
                                                            RandomStream::kTest));
    const double sigma = std::sqrt(0.288 * 0.288 + row.dot(covariance * row));
    // The estimator keeps its slopes while the estimate moves little.
    EXPECT_NEAR(estimator.innovation_sigma(), sigma, 0.01 * sigma) << k;
  }
}

TEST(Posterior, IsHonestOverEyesOfThePrior) {
  // 150 eyes of the prior; the model is exact here, so that what is tested is the inference.
  constexpr int kEyes = 150;
  const Belief belief = seven_quantities();
  const std::vector<int> at = {1, 5, 20, 60};
  std::vector<double> squares(at.size(), 0.0);
  std::vector<double> covered(at.size(), 0.0);
  PosteriorEstimator estimator(model_of_seven(), believing());
  for (std::uint64_t i = 0; i < kEyes; ++i) {
    QuantityVector logs(7);
    for (std::size_t q = 0; q < 7; ++q) {
      const double sigma = std::sqrt(belief.covariance[q * 8]);
      const double score = standard_normal(11, i * 7 + q, RandomStream::kTest);
      logs[static_cast<Eigen::Index>(q)] =
          std::clamp(belief.mean[q] + sigma * score, std::log(belief.quantities[q].low),
                     std::log(belief.quantities[q].high));
    }
    Eye eye(logs);
    estimator.reset();
    for (int k = 1; k <= 60; ++k) {
      eye.step(0.03);
      estimator.predict(0.03);
      estimator.update(eye.sample() +
                       0.288 * standard_normal(12, i * 100 + static_cast<std::uint64_t>(k),
                                               RandomStream::kTest));
      for (std::size_t a = 0; a < at.size(); ++a) {
        if (k != at[a]) continue;
        const double z = (estimator.outputs().peak - eye.true_peak()) / estimator.peak_sigma();
        squares[a] += z * z;
        covered[a] += std::abs(z) < 1.96 ? 1.0 : 0.0;
      }
    }
  }
  for (std::size_t a = 0; a < at.size(); ++a) {
    // Standard deviation of the mean of 150 chi-squares: 0.115; of the share: 0.018.
    EXPECT_NEAR(squares[a] / kEyes, 1.0, 0.35) << at[a];
    EXPECT_NEAR(covered[a] / kEyes, 0.95, 0.06) << at[a];
  }
}

TEST(Posterior, ConsideredQuantitiesKeepTheirPrior) {
  EstimatorSettings settings = believing();
  settings.prior.quantities[2].estimated = false;
  auto uncertain = std::make_shared<UncertainModel>(*seven_quantity_model());
  uncertain->quantities = settings.prior.quantities;
  ReducedModel model = model_of_seven();
  model.uncertain = uncertain;
  PosteriorEstimator estimator(model, settings);
  PosteriorEstimator all(model_of_seven(), believing());
  Eye eye(logs_at({0.6, 0.3, 0.9, 0.4, 0.7, 0.6, 0.6}));
  for (int k = 0; k < 100; ++k) {
    eye.step(0.04);
    estimator.predict(0.04);
    estimator.update(eye.sample());
    all.predict(0.04);
    all.update(eye.sample());
  }
  EXPECT_EQ(estimator.log_quantities()[2], settings.prior.mean[2]);
  EXPECT_EQ(estimator.covariance_of_logs()(2, 2), 0.3 * 0.3);
  EXPECT_NE(all.log_quantities()[2], settings.prior.mean[2]);
  EXPECT_GE(estimator.peak_sigma(), all.peak_sigma());
  EXPECT_GT(*cholesky(estimator.covariance_of_logs()).value().data(), 0.0);
}

TEST(Posterior, LearnsTheNoise) {
  EstimatorSettings settings = believing();
  settings.prior.noise_spread = 0.3;
  PosteriorEstimator estimator(model_of_seven(), settings);
  Eye eye(logs_at({0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5}));
  for (int k = 0; k < 400; ++k) {
    eye.step(0.03);
    estimator.predict(0.03);
    estimator.update(eye.sample() +
                     0.6 * standard_normal(4, static_cast<std::uint64_t>(k), RandomStream::kTest));
  }
  EXPECT_NEAR(estimator.noise(), 0.6, 0.06);  // 1 / sqrt(800) of it, and the prior's pull
}

TEST(Posterior, WithoutASampleItPredicts) {
  PosteriorEstimator estimator(model_of_seven(), believing());
  estimator.predict(0.03);
  const QuantityVector before = estimator.log_quantities();
  for (const double sample : {std::numeric_limits<double>::quiet_NaN(), 1e6, -1e6,
                              std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(estimator.update(sample), UpdateStatus::kNoSample);
  }
  EXPECT_EQ(estimator.log_quantities(), before);
  EXPECT_GT(estimator.outputs().peak, 0.0);
  estimator.predict(1e300);
  EXPECT_EQ(estimator.update(20.0), UpdateStatus::kRestarted);
  EXPECT_TRUE(std::isfinite(estimator.outputs().peak));
  EXPECT_EQ(estimator.outputs().peak, 0.0);
}

TEST(Posterior, AllocatesNothing) {
  PosteriorEstimator estimator(model_of_seven(), believing());
  HeapUse used;
  {
    const HeapGuard guard;
    for (int k = 0; k < 50; ++k) {
      estimator.predict(0.03);
      estimator.update(10.0);
    }
    used = guard.use();
  }
  EXPECT_EQ(used, HeapUse{});
}

TEST(Posterior, RefusesAModelForOtherQuantities) {
  EstimatorSettings settings = believing();
  settings.prior.quantities[0].high = 1.6;
  EXPECT_THROW(PosteriorEstimator(model_of_seven(), settings), Error);
  settings = believing();
  settings.prior = {};
  EXPECT_THROW(PosteriorEstimator(model_of_seven(), settings), Error);
  ReducedModel without = model_of_seven();
  without.uncertain = nullptr;
  EXPECT_THROW(PosteriorEstimator(without, believing()), Error);
}

}  // namespace
}  // namespace photocoag::testing
