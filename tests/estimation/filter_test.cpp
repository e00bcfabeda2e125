// The filter against the textbook, its Jacobians, its covariance, its bounds. What every estimator
// does with bad samples: every_estimator_test.cpp.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

#include "estimation/test_models.hpp"
#include "estimation/textbook_filter.hpp"
#include "estimation/two_unknowns_model.hpp"
#include "photocoag/estimation/ekf.hpp"

namespace photocoag::testing {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

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
          ASSERT_NEAR(filter.innovation_sigma(), static_cast<double>(book.innovation_sigma), 1e-12);
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

// The covariance of the next period with the whole of A, and with its diagonal alone.
template <int U>
void expect_same_prediction(const ReducedModel& model, const ExtendedMatrix& covariance,
                            const ParametricMatrices& m, double power) {
  const StateVector decay = diagonal_alone(model.A_d);
  ASSERT_EQ(decay.size(), model.order());
  SlopeMatrix b(model.order(), U);
  for (int q = 0; q < U; ++q) b.col(q) = m.input_slope[q] * power;
  ExtendedMatrix whole = covariance;
  ExtendedMatrix diagonal = covariance;
  predict_covariance<U>(model.A_d, {}, m.input, b, 1e-7, {1e-8, 1e-8}, whole);
  predict_covariance<U>(model.A_d, decay, m.input, b, 1e-7, {1e-8, 1e-8}, diagonal);
  ASSERT_EQ(whole, diagonal);
  ASSERT_EQ(diagonal, ExtendedMatrix(diagonal.transpose()));
}

TEST(Filter, ADiagonalTransitionGivesTheBitsOfTheWholeProduct) {
  for (const bool two : {false, true}) {
    const ReducedModel& model = two ? model_with_beta() : model_1khz();
    EstimatorSettings settings;
    if (two) settings.unknowns = Unknowns::kRpeAndChoroid;
    ExtendedKalmanFilter filter(model, settings);
    ReducedPlant plant(model, {1.1, 1.0});
    Draw draw(3);
    for (int k = 0; k < 500; ++k) {
      const double power = draw.chance(0.2) ? 0.0 : draw.between(0.0, 0.1);
      if (two) {
        expect_same_prediction<2>(model, filter.covariance(), filter.matrices(), power);
      } else {
        expect_same_prediction<1>(model, filter.covariance(), filter.matrices(), power);
      }
      const StateVector whole = model.A_d.lazyProduct(filter.state());
      ASSERT_EQ(next_free_state(model.A_d, diagonal_alone(model.A_d), filter.state()), whole);
      plant.step(power);
      filter.predict(power);
      filter.update(plant.outputs().volume + 0.288 * draw.normal());
    }
  }
}

TEST(Filter, WhatIsBesideTheDiagonalIsNeverLeftOut) {
  StateMatrix A = model_1khz().A_d;
  EXPECT_EQ(diagonal_alone(A).size(), 6);
  for (const double small : {1e-300, -1e-300, kNaN}) {
    A(4, 1) = small;
    EXPECT_EQ(diagonal_alone(A).size(), 0) << small;
  }
  // And the filter of such a model has the textbook's covariance.
  Draw draw(4);
  ReducedModel model = model_1khz();
  model.A_d(4, 1) = 0.05;
  model.A_d(0, 5) = -0.03;
  ExtendedKalmanFilter filter(model, {});
  TextbookFilter book(model, {});
  for (int k = 0; k < 100; ++k) {
    const double power = draw.between(0.0, 0.1);
    filter.predict(power);
    book.predict(power);
    const double sample = static_cast<double>(book.volume()) + 0.288 * draw.normal();
    ASSERT_EQ(filter.update(sample), UpdateStatus::kUpdated);
    book.update(sample);
    ASSERT_LT(covariance_difference(filter, book), 1e-11) << "cycle " << k;
    ASSERT_NEAR(filter.outputs().peak, static_cast<double>(book.peak()), 1e-10) << k;
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
      ASSERT_TRUE(filter.matrices().volume_slope[0] == matrices.volume_slope[0]);
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

}  // namespace
}  // namespace photocoag::testing
