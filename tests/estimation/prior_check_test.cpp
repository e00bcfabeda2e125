// A right prior is doubted as rarely as stated, a wrong one nearly always.
#include "photocoag/estimation/prior_check.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "photocoag/core/error.hpp"
#include "photocoag/core/random.hpp"

namespace photocoag {
namespace {

TEST(PriorCheck, ChiSquareTailsAreTheExactOnes) {
  // Two degrees: exp(-x/2). Four: (1 + x/2) exp(-x/2). One: erfc(sqrt(x/2)).
  for (const double x : {0.1, 1.0, 3.0, 9.0, 40.0}) {
    EXPECT_NEAR(chi_square_tail(x, 2), std::exp(-0.5 * x), 1e-14);
    EXPECT_NEAR(chi_square_tail(x, 4), (1.0 + 0.5 * x) * std::exp(-0.5 * x), 1e-14);
    EXPECT_NEAR(chi_square_tail(x, 1), std::erfc(std::sqrt(0.5 * x)), 1e-14);
  }
  // Many degrees: near the median, and far above (relative to Wilson and Hilferty's normal form).
  EXPECT_NEAR(chi_square_tail(249.3, 250), 0.5, 2e-3);
  EXPECT_LT(chi_square_tail(400.0, 250), 1e-7);
  EXPECT_EQ(chi_square_tail(0.0, 5), 1.0);
}

// Three unknowns; two samples of the first two with noise; the third is never seen.
PriorCheck one_treatment(std::uint64_t seed, const Eigen::Vector3d& true_mean) {
  GaussianBelief prior{Eigen::Vector3d(1.0, 2.0, 3.0), Eigen::Matrix3d::Identity()};
  prior.covariance(0, 1) = prior.covariance(1, 0) = 0.5;
  prior.covariance(2, 2) = 0.25;
  const auto normal = [seed](int stream) {
    return standard_normal(seed, 7, static_cast<RandomStream>(stream));
  };
  const double first = normal(1);
  const Eigen::Vector3d truth =
      true_mean +
      Eigen::Vector3d(first, 0.5 * first + std::sqrt(0.75) * normal(2), 0.5 * normal(3));
  GaussianBelief posterior = prior;
  double innovations = 0.0;
  for (int k = 0; k < 2; ++k) {
    Eigen::RowVector3d C = Eigen::RowVector3d::Zero();
    C[k] = 1.0;
    constexpr double kNoise = 0.3;
    const double innovation = truth[k] + kNoise * normal(10 + k) - C.dot(posterior.mean);
    const double variance = (C * posterior.covariance * C.transpose()).value() + kNoise * kNoise;
    const Eigen::VectorXd gain = posterior.covariance * C.transpose() / variance;
    posterior.mean += gain * innovation;
    posterior.covariance -= gain * (C * posterior.covariance);
    innovations += innovation * innovation / variance;
  }
  return check_prior(prior, posterior, innovations, 2.0);
}

TEST(PriorCheck, ARightPriorsProbabilitiesAreUniform) {
  constexpr int kTreatments = 4000;
  int distance_below = 0;
  int innovations_below = 0;
  int doubtful = 0;
  for (int seed = 0; seed < kTreatments; ++seed) {
    const PriorCheck check =
        one_treatment(static_cast<std::uint64_t>(seed), Eigen::Vector3d(1.0, 2.0, 3.0));
    EXPECT_EQ(check.directions, 2) << "nothing is known of the third";
    distance_below += check.distance_probability < 0.1 ? 1 : 0;
    innovations_below += check.innovations_probability < 0.1 ? 1 : 0;
    doubtful += check.doubtful() ? 1 : 0;
  }
  // Five standard deviations of a binomial count around 400: 95; 0.2 % of 4000 at most, and more.
  EXPECT_NEAR(distance_below, 400, 95);
  EXPECT_NEAR(innovations_below, 400, 95);
  EXPECT_LE(doubtful, 20);
}

TEST(PriorCheck, AWrongPriorIsDoubted) {
  int doubtful = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    doubtful += one_treatment(seed, Eigen::Vector3d(7.0, -4.0, 3.0)).doubtful() ? 1 : 0;
  }
  EXPECT_GE(doubtful, 195);
}

TEST(PriorCheck, RefusesAnotherSize) {
  const GaussianBelief two{Eigen::Vector2d::Zero(), Eigen::Matrix2d::Identity()};
  const GaussianBelief three{Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity()};
  EXPECT_THROW(check_prior(two, three, 0.0, 0.0), Error);
  const GaussianBelief none{Eigen::Vector2d::Zero(), Eigen::Matrix2d::Zero()};
  EXPECT_THROW(check_prior(none, two, 0.0, 0.0), Error);
}

}  // namespace
}  // namespace photocoag
