// The proved number of active-set changes, and an attack on it (attack.hpp).
#include "photocoag/certify/certify.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <random>
#include <string>

#include "certify/attack.hpp"
#include "photocoag/certify/region.hpp"
#include "photocoag/certify/sampled_problem.hpp"
#include "photocoag/certify/taylor.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/mpc/ocp.hpp"
#include "photocoag/rom/iteration_proof.hpp"
#include "support/reduced_models.hpp"

namespace photocoag::testing {
namespace {

const ReducedModel& model() {
  static const ReducedModel made = coarse_model();
  return made;
}

Certificate certified(const ControlSettings& settings, const CertifiedBox& box,
                      const CertifyOptions& options = {.samples = 20'000}) {
  const std::atomic<bool> stop{false};
  return certify(model(), settings, box, options, stop);
}

TEST(Certify, HorizonTwoNeedsOneChangeAtMost) {
  for (const double r1 : {0.0, 50.0}) {
    for (const double r2 : {0.0, 1000.0}) {
      const ControlSettings settings{.horizon = 2, .power_weight = r1, .power_change_weight = r2};
      const CertifiedBox box = box_of(0.0, 40.0);
      const Certificate found = certified(settings, box);
      EXPECT_EQ(found.proved, 1);
      EXPECT_EQ(found.seen, 1);
      EXPECT_EQ(found.share, 1.0);
      EXPECT_EQ(found.open_boxes, 0U);
      EXPECT_TRUE(found.covers_rounding());
      EXPECT_EQ(Attack(model(), settings, box).most(50'000), 1);
    }
  }
}

TEST(Certify, AnAttackNeverExceedsTheProvedCountButExceedsOneLess) {
  const ControlSettings settings{.horizon = 3};
  const CertifiedBox box = box_of(0.0, 40.0);
  const Certificate found = certified(settings, box);
  EXPECT_EQ(found.share, 1.0);
  EXPECT_EQ(found.proved, found.seen);
  const int most = Attack(model(), settings, box).most(300'000);
  EXPECT_LE(most, found.proved);
  EXPECT_GT(most, found.proved - 1);  // a count that is wrong by one does not stand
}

TEST(Certify, WhereTheSearchEndsTheBoundHoldsAllTheSame) {
  for (const StateWeight kind : {StateWeight::kConstant, StateWeight::kDelayed}) {
    const ControlSettings settings{
        .horizon = 3, .state_weight = kind, .power_weight = 50.0, .power_change_weight = 1000.0};
    const CertifiedBox box = box_of(10.0, 36.0);
    const Certificate found = certified(settings, box, {.boxes = 300, .samples = 20'000});
    EXPECT_LE(found.proved, found.hard_bound);
    EXPECT_GE(found.proved, found.seen);
    EXPECT_GT(found.share, kind == StateWeight::kConstant ? 0.5 : 0.0);
    EXPECT_LE(Attack(model(), settings, box).most(100'000), found.proved);
  }
}

TEST(Certify, LongHorizonsSayWhatIsNotProved) {
  const ControlSettings settings{.horizon = 5};
  const Certificate found =
      certified(settings, box_of(0.0, 40.0), {.boxes = 64, .nodes = 500, .samples = 20'000});
  EXPECT_EQ(found.hard_bound, 80);
  EXPECT_LE(found.proved, found.hard_bound);
  EXPECT_LT(found.share, 1.0);
  EXPECT_GT(found.open_boxes, 0U);
}

TEST(Certify, GivesWhatItHasWhenStopped) {
  const std::atomic<bool> stop{true};
  const ControlSettings settings{.horizon = 3};
  const Certificate found = certify(model(), settings, box_of(0.0, 40.0), {}, stop);
  EXPECT_TRUE(found.stopped);
  EXPECT_EQ(found.proved, found.hard_bound);
  EXPECT_EQ(found.share, 0.0);
}

TEST(Certify, RefusesByNameWhatItDoesNotCover) {
  const auto refused = [](const ControlSettings& settings) {
    try {
      require_certifiable(model(), settings);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refused({.horizon = 5}), "");
  EXPECT_NE(refused({.horizon = 6}).find("control.horizon"), std::string::npos);
  EXPECT_NE(refused({.robust = Robustness::kCertified}).find("control.robust"), std::string::npos);
  EXPECT_NE(refused({.solver = SolverKind::kOsqp}).find("control.solver"), std::string::npos);
  EXPECT_NE(refused({.reference_times = {0.0}, .reference_values = {20.0}})
                .find("control.reference_times_ms"),
            std::string::npos);
}

// The problems of the search's own sampling are the controller's.
TEST(SampledProblem, IsTheCondensedProblem) {
  std::mt19937 random(3);
  std::uniform_real_distribution<> unit(0.0, 1.0);
  for (const StateWeight kind : {StateWeight::kConstant, StateWeight::kDelayed}) {
    for (long long cycle = 0; cycle <= 4; ++cycle) {
      const ControlSettings settings{.horizon = 5,
                                     .power_min = 0.01,
                                     .state_weight = kind,
                                     .power_weight = 50.0,
                                     .power_change_weight = 1000.0};
      OptimalControlProblem ocp(model(), settings);
      SampledProblem sampled(model(), settings, cycle);
      ParameterPoint point{.absorption = 0.3 + unit(random), .previous = 0.1 * unit(random)};
      ParametricMatrices matrices;
      model().evaluate(point.absorption, matrices);
      StateVector state = matrices.input * (0.9 * unit(random));
      QpProblem qp;
      ocp.condense({.state = state,
                    .input = matrices.input,
                    .cycle = cycle,
                    .power_reference = ocp.steady_power(matrices.input, cycle),
                    .previous_power = point.previous},
                   qp);
      for (int k = 0; k < 4; ++k) {
        state = (model().A_d * state).eval();
        point.free[k] = model().C_peak.dot(state);
      }
      const QpProblem& own = sampled.at(point);
      const double size = qp.hessian.cwiseAbs().maxCoeff();
      // Some 100 roundings.
      EXPECT_LE((own.hessian - qp.hessian).cwiseAbs().maxCoeff(), 1e-13 * size);
      EXPECT_LE((own.gradient - qp.gradient).cwiseAbs().maxCoeff(), 1e-12 * size);
      EXPECT_LE((own.rows - qp.rows).cwiseAbs().maxCoeff(), 1e-13 * size);
      EXPECT_LE((own.limit - qp.limit).cwiseAbs().maxCoeff(), 1e-12 * 40.0);
    }
  }
}

TEST(Taylor, HoldsTheFunctionItStandsFor) {
  std::mt19937 random(5);
  std::uniform_real_distribution<> place(-1.0, 1.0);
  Taylor x(Interval(0.7));
  x.coefficient[Taylor::index(1, 0)] = Interval(0.2);
  Taylor y(Interval(1.3));
  y.coefficient[Taylor::index(0, 1)] = Interval(0.3);
  const Taylor f = exp(Taylor(Interval(0.0)) - x * y) * reciprocal(x + y) - x;
  for (int i = 0; i < 1000; ++i) {
    const double s = place(random);
    const double t = place(random);
    const double a = 0.7 + 0.2 * s;
    const double b = 1.3 + 0.3 * t;
    const double value = std::exp(-a * b) / (a + b) - a;
    Interval sum = f.rest;
    for (int d = 0; d <= Taylor::kDegree; ++d) {
      for (int j = 0; j <= d; ++j) {
        sum = sum + f.coefficient[Taylor::index(d - j, j)] *
                        Interval(std::pow(s, d - j) * std::pow(t, j));
      }
    }
    EXPECT_LE(sum.low, value + 1e-15);
    EXPECT_GE(sum.high, value - 1e-15);
    EXPECT_LE(sum.high - sum.low, 1e-3);
    const Varying v = f.varying();
    const Interval slopes = v.at_middle + v.slope[0] * Interval(s) + v.slope[1] * Interval(t);
    EXPECT_LE(slopes.low, value + 1e-15);
    EXPECT_GE(slopes.high, value - 1e-15);
  }
}

TEST(Region, IsNeverCalledEmptyWhileAPointIsInIt) {
  std::mt19937 random(9);
  std::uniform_real_distribution<> unit(-1.0, 1.0);
  int empty = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    Region region(5);
    Inequality last;
    std::array<double, 5> inside{};
    for (double& x : inside) x = unit(random);
    for (int i = 0; i < 20; ++i) {
      double value = 0.0;
      for (int j = 0; j < 5; ++j) {
        last.slope[j] = unit(random);
        value += last.slope[j] * inside[j];
      }
      last.offset = -value + 0.01 * (unit(random) + 1.0);
      region.add(last);
    }
    EXPECT_FALSE(region.is_empty());
    for (double& s : last.slope) s = -s;  // beyond the last one
    last.offset = -last.offset - 1e-6;
    region.add(last);
    empty += region.is_empty() ? 1 : 0;
  }
  EXPECT_EQ(empty, 2000);
}

TEST(IterationProof, IsBoundToModelClaimAndBuild) {
  const std::string text = to_json(model());
  const IterationProof proof{.claim = "N=3",
                             .seen = 4,
                             .proved = 5,
                             .hard_bound = 48,
                             .share = 0.25,
                             .covers_rounding = true,
                             .boxes = 7};
  EXPECT_FALSE(iteration_proof(text, "N=3").has_value());  // a file from before
  const std::string with = with_iteration_proof(text, proof);
  EXPECT_EQ(to_json(from_json(with, "test")), text);  // the model is the same, the checksum right
  const auto read = iteration_proof(with, "N=3");
  ASSERT_TRUE(read.has_value());
  EXPECT_EQ(read->proved, 5);
  EXPECT_EQ(read->seen, 4);
  EXPECT_EQ(read->share, 0.25);
  EXPECT_FALSE(iteration_proof(with, "N=4").has_value());
  Json other = Json::parse(with);
  other["iteration_proofs"][0]["claim"] = "N=4";  // somebody who means it
  EXPECT_FALSE(iteration_proof(sealed(other), "N=4").has_value());
  other = Json::parse(with);
  other["error"]["seed"] = 99;
  EXPECT_FALSE(iteration_proof(sealed(other), "N=3").has_value());
  // Twice the same claim is one proof.
  const std::string twice = with_iteration_proof(with, proof);
  EXPECT_EQ(twice, with);
}

}  // namespace
}  // namespace photocoag::testing
