// The filter against the textbook, its Jacobians, its covariance, and what it does with bad
// samples.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

#include "estimation/test_models.hpp"
#include "estimation/textbook_filter.hpp"
#include "photocoag/estimation/ekf.hpp"
#include "support/heap_guard.hpp"

namespace photocoag::testing {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool same_bits(const ExtendedKalmanFilter& a, const ExtendedKalmanFilter& b) {
  return a.state() == b.state() && a.absorption_factor() == b.absorption_factor() &&
         a.covariance() == b.covariance() && a.matrices().input == b.matrices().input &&
         a.matrices().volume == b.matrices().volume;
}

/// Largest difference of two covariances, entry (i, j) relative to sqrt(P_ii P_jj): no unit enters.
double covariance_difference(const ExtendedKalmanFilter& filter, const TextbookFilter& book) {
  double worst = 0.0;
  for (int i = 0; i < book.P.rows(); ++i) {
    for (int j = 0; j < book.P.cols(); ++j) {
      const Real scale = std::sqrt(book.P(i, i) * book.P(j, j));
      if (scale == 0) continue;
      const Real error = std::abs(filter.covariance()(i, j) - book.P(i, j)) / scale;
      worst = std::max(worst, static_cast<double>(error));
    }
  }
  return worst;
}

/// A filter that has seen 30 noisy samples of a reduced eye.
ExtendedKalmanFilter warm_filter(const EstimatorSettings& settings = {}, double alpha = 1.0) {
  ExtendedKalmanFilter filter(model_1khz(), settings);
  ReducedPlant plant(model_1khz(), alpha);
  Draw draw(4);
  for (int k = 0; k < 30; ++k) {
    const double power = draw.between(0.0, 0.05);
    plant.step(power);
    filter.predict(power);
    filter.update(plant.outputs().volume + 0.288 * draw.normal());
  }
  return filter;
}

TEST(Filter, MatchesTheTextbookInLongDouble) {
  for (const bool normalized : {false, true}) {
    ReducedModel model = model_1khz();
    model.volume_normalized = normalized;
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      Draw draw(seed);
      ExtendedKalmanFilter filter(model, {});
      TextbookFilter book(model, {});
      ReducedPlant plant(model, draw.between(0.35, 1.5));
      for (int k = 0; k < 300; ++k) {
        const double power = draw.chance(0.2) ? 0.0 : draw.between(0.0, 0.1);
        plant.step(power);
        filter.predict(power);
        book.predict(power);
        if (!draw.chance(0.1)) {
          const double sample = plant.outputs().volume + 0.288 * draw.normal();
          ASSERT_EQ(filter.update(sample), UpdateStatus::kUpdated);
          book.update(sample);
        }
        // Rounding of some 1e-16, which the filter forgets about as fast as it makes it: 1e-14 of
        // each quantity was seen over these runs.
        ASSERT_NEAR(filter.absorption_factor(), static_cast<double>(book.z[model.order()]), 1e-12);
        ASSERT_NEAR(filter.outputs().peak, static_cast<double>(book.peak()), 1e-11) << k;
        ASSERT_NEAR(filter.outputs().volume, static_cast<double>(book.volume()), 1e-11) << k;
        ASSERT_LT(covariance_difference(filter, book), 1e-12) << "cycle " << k;
      }
    }
  }
}

TEST(Filter, JacobiansAreThoseOfTheNonlinearMap) {
  Draw draw(11);
  ExtendedKalmanFilter filter(model_1khz(), {});
  TextbookFilter book(model_1khz(), {}, Jacobians::kDifferences);
  ReducedPlant plant(model_1khz(), 1.2);
  for (int k = 0; k < 60; ++k) {
    const double power = draw.between(0.0, 0.1);
    plant.step(power);
    filter.predict(power);
    book.predict(power);
    const double sample = plant.outputs().volume + 0.288 * draw.normal();
    filter.update(sample);
    book.update(sample);
    // The differences are good to about 1e-11 (textbook_filter.hpp); a Jacobian that is wrong by
    // 1e-8 of its size would show here.
    ASSERT_LT(covariance_difference(filter, book), 1e-10) << "cycle " << k;
    ASSERT_NEAR(filter.absorption_factor(), static_cast<double>(book.z[6]), 1e-10);
  }
}

TEST(Filter, CovarianceStaysSymmetricAndPositive) {
  Draw draw(3);
  ExtendedKalmanFilter filter(model_1khz(), {});
  ReducedPlant plant(model_1khz(), 1.1);
  for (int k = 0; k < 10000; ++k) {
    const double power = draw.chance(0.3) ? 0.0 : draw.between(0.0, 0.1);
    plant.step(power);
    filter.predict(power);
    // Most samples honest, some missing, some far off.
    const double wild = draw.chance(0.02) ? 100.0 * draw.normal() : 0.0;
    filter.update(draw.chance(0.1) ? kNaN : plant.outputs().volume + 0.288 * draw.normal() + wild);
    const auto& P = filter.covariance();
    ASSERT_TRUE(P == P.transpose()) << "cycle " << k;
    // As correlations, so that no unit enters. Rounding of a 7 x 7 eigenvalue problem: 1e-15.
    const Eigen::VectorXd sigma = P.diagonal().cwiseSqrt();
    ASSERT_TRUE((sigma.array() > 0.0).all()) << "cycle " << k;
    const Eigen::MatrixXd correlation =
        sigma.cwiseInverse().asDiagonal() * P * sigma.cwiseInverse().asDiagonal();
    const double least =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(correlation, Eigen::EigenvaluesOnly)
            .eigenvalues()[0];
    ASSERT_GT(least, -1e-12) << "cycle " << k;
  }
}

TEST(Filter, AlphaStaysInsideItsBoundsAndMovesTheStateAlongTheCovariance) {
  // The textbook has no gate.
  const EstimatorSettings settings{
      .absorption_min = 0.6, .absorption_max = 0.9, .outlier_sigma = 0.0};
  int moved = 0;
  for (const double alpha : {0.3, 1.6}) {
    ExtendedKalmanFilter filter(model_1khz(), settings);
    TextbookFilter book(model_1khz(), settings);
    ReducedPlant plant(model_1khz(), alpha);
    Draw draw(8);
    for (int k = 0; k < 200; ++k) {
      const double power = draw.between(0.0, 0.1);
      plant.step(power);
      filter.predict(power);
      book.predict(power);
      const double sample = plant.outputs().volume + 0.288 * draw.normal();
      filter.update(sample);
      book.update(sample);
      ASSERT_GE(filter.absorption_factor(), settings.absorption_min);
      ASSERT_LE(filter.absorption_factor(), settings.absorption_max);
      const bool at_bound = filter.absorption_factor() == settings.absorption_min ||
                            filter.absorption_factor() == settings.absorption_max;
      moved += at_bound ? 1 : 0;
      ASSERT_NEAR(filter.outputs().peak, static_cast<double>(book.peak()), 1e-7) << k;
      // The matrices in use are those of the bounded alpha.
      ParametricMatrices matrices;
      model_1khz().evaluate(filter.absorption_factor(), matrices);
      ASSERT_TRUE(filter.matrices().input == matrices.input);
      ASSERT_TRUE(filter.matrices().volume_slope == matrices.volume_slope);
    }
  }
  EXPECT_GT(moved, 100) << "the bounds hardly ever acted: the test tests nothing";
}

TEST(Filter, AStateMovedWithAlphaDiffersFromOneLeftBehind) {
  // The eye absorbs far less than the bound allows: the state must take the blame that alpha may
  // not.
  const EstimatorSettings bounded{.absorption_min = 0.7};
  ExtendedKalmanFilter filter(model_1khz(), bounded);
  filter.predict(0.05);
  TextbookFilter book(model_1khz(), bounded);
  book.predict(0.05);
  book.update_unbounded(0.5);
  ASSERT_LT(book.z[6], 0.7L) << "the bound is not reached";
  filter.update(0.5);
  EXPECT_EQ(filter.absorption_factor(), 0.7);
  EXPECT_GT(std::abs(filter.outputs().peak - static_cast<double>(book.peak())), 0.05);
}

TEST(Filter, AMissingSampleIsAPredictionBitForBit) {
  for (const double missing : {kNaN, -kNaN, kInfinity, -kInfinity}) {
    ExtendedKalmanFilter with = warm_filter();
    ExtendedKalmanFilter without = with;
    for (int k = 0; k < 5; ++k) {
      with.predict(0.03);
      without.predict(0.03);
      EXPECT_EQ(with.update(missing), UpdateStatus::kNoSample);
      ASSERT_TRUE(same_bits(with, without));
    }
    // And the next sample is used as if nothing had happened.
    EXPECT_EQ(with.update(12.0), UpdateStatus::kUpdated);
    without.update(12.0);
    EXPECT_TRUE(same_bits(with, without));
  }
}

TEST(Filter, WithoutLightAlphaIsNotLearned) {
  // Cold tissue, no power, no unknown power: a sample tells nothing about alpha.
  ExtendedKalmanFilter filter(model_1khz(), {.power_process_noise = 0.0});
  Draw draw(2);
  for (int k = 0; k < 500; ++k) {
    filter.predict(0.0);
    ASSERT_EQ(filter.update(0.288 * draw.normal()), UpdateStatus::kUpdated);
    ASSERT_EQ(filter.absorption_factor(), 0.7363);
    ASSERT_EQ(filter.outputs().peak, 0.0);
    // Nor does it become surer of it: the variance grows by the process noise alone.
    ASSERT_NEAR(filter.absorption_sigma(), std::sqrt(0.0625 + (k + 1) * 1e-10), 1e-12);
  }
}

TEST(Filter, WithoutLightAlphaHardlyMovesUnderTheDefaultTuning) {
  // The default admits an unknown power of 0.2 mW, which alpha scales: second order in the noise.
  ExtendedKalmanFilter filter(model_1khz(), {});
  Draw draw(2);
  for (int k = 0; k < 250; ++k) {
    filter.predict(0.0);
    filter.update(0.288 * draw.normal());
    // A tenth of its own standard deviation of 0.25.
    ASSERT_NEAR(filter.absorption_factor(), 0.7363, 0.025) << k;
  }
  EXPECT_GT(filter.absorption_sigma(), 0.23);
}

TEST(Filter, PoisonedSamplesLeaveFiniteNumbers) {
  for (const double poison : {1e30, -1e30, 1e150, -1e150, 1e300, -1e300, 1.7e308, -1.7e308}) {
    ExtendedKalmanFilter filter = warm_filter();
    filter.predict(0.02);
    filter.update(poison);
    for (int k = 0; k < 50; ++k) {
      ASSERT_TRUE(filter.state().allFinite()) << poison;
      ASSERT_TRUE(filter.covariance().allFinite()) << poison;
      ASSERT_TRUE(filter.matrices().input.allFinite()) << poison;
      ASSERT_GE(filter.absorption_factor(), 0.2);
      ASSERT_LE(filter.absorption_factor(), 2.0);
      ASSERT_TRUE(std::isfinite(filter.absorption_sigma()));
      ASSERT_TRUE(std::isfinite(filter.peak_sigma()));
      ASSERT_TRUE(std::isfinite(filter.outputs().peak)) << poison;
      filter.predict(0.02);
      filter.update(10.0);
    }
  }
}

TEST(Filter, ImpossibleSamplesAreMissingSamples) {
  // -1e6 K taken at face value keeps the laser at full power to the end of a treatment.
  for (const double impossible : {-50.1, -1000.0, -1e6, 300.1, 1e30, -1.7e308}) {
    ExtendedKalmanFilter filter = warm_filter();
    filter.predict(0.02);
    ExtendedKalmanFilter without = filter;
    EXPECT_EQ(filter.update(impossible), UpdateStatus::kNoSample) << impossible;
    EXPECT_TRUE(same_bits(filter, without)) << impossible;
  }
  ExtendedKalmanFilter filter = warm_filter({.outlier_sigma = 0.0});
  EXPECT_EQ(filter.update(-49.9), UpdateStatus::kUpdated);
  EXPECT_EQ(filter.update(299.9), UpdateStatus::kUpdated);
}

TEST(Filter, ANonFinitePowerIsRestartedByTheNextSample) {
  ExtendedKalmanFilter filter = warm_filter();
  filter.predict(kNaN);
  EXPECT_EQ(filter.update(10.0), UpdateStatus::kRestarted);
  const ExtendedKalmanFilter fresh(model_1khz(), {});
  EXPECT_TRUE(same_bits(filter, fresh));
}

TEST(Filter, RefusesBadSettings) {
  EXPECT_THROW(ExtendedKalmanFilter(model_1khz(), {.absorption_initial = 3.0}), std::exception);
  EXPECT_THROW(ExtendedKalmanFilter(model_1khz(), {.measurement_noise = 0.0}), std::exception);
  EXPECT_THROW(ExtendedKalmanFilter(model_1khz(), {.absorption_sigma_initial = kNaN}),
               std::exception);
}

TEST(Filter, AllocatesNothing) {
  ExtendedKalmanFilter filter(model_1khz(), {});
  double sum = 0.0;
  HeapUse use;
  {
    const HeapGuard guard;
    for (int k = 0; k < 20; ++k) {
      filter.predict(0.03);
      filter.update(k == 7 ? kNaN : k == 9 ? 1e300 : 5.0);
      sum += filter.outputs().peak + filter.peak_sigma() + filter.absorption_sigma();
    }
    filter.reset();
    use = guard.use();
  }
  EXPECT_EQ(use, HeapUse{});
  EXPECT_TRUE(std::isfinite(sum));
}

}  // namespace
}  // namespace photocoag::testing
