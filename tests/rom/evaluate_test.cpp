// The reduced model online: B(alpha), C_vol(alpha), their derivatives, and stepping.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "photocoag/rom/reduced_model.hpp"
#include "support/heap_guard.hpp"
#include "support/reduced_models.hpp"
#include "support/tissues.hpp"

namespace photocoag {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::coarse_model;

std::vector<ReducedModel> models() {
  return {coarse_model(), coarse_model(testing::normalized(Tissue{})),
          coarse_model(testing::normalized(testing::literature_choroid()), 4e-3),
          coarse_model(Tissue{}, 1e-3, Discretization::kImplicitEuler)};
}

TEST(Evaluate, IsTheSumOfItsTerms) {
  for (const ReducedModel& model : models()) {
    for (const double alpha : {0.2, 0.7363, 2.0}) {
      ParametricMatrices out;
      model.evaluate(alpha, out);
      VectorXd input = VectorXd::Zero(model.order());
      VectorXd volume = VectorXd::Zero(model.order());
      for (int j = 0; j < model.terms(); ++j) {
        const AbsorbedFraction& p = model.theta.points[j];
        const double theta = std::exp(-(p.fixed_front + alpha * p.front[0])) -
                             std::exp(-(p.fixed_back + alpha * p.back[0]));
        input += theta * VectorXd(model.B_d.col(j));
        volume += theta * VectorXd(model.C_volume.row(j).transpose());
      }
      if (model.volume_normalized) {
        double optical_depth = 0.0;
        for (const Layer& layer : model.tissue.layers) {
          optical_depth += layer.absorption * layer.thickness *
                           (layer.scaled_by == ScaledBy::kAlpha ? alpha : 1.0);
        }
        volume /= -std::expm1(-optical_depth);
      }
      // theta here is a difference of exponentials: 1e-16 of 1 where theta is about 0.01.
      EXPECT_LT((VectorXd(out.input) - input).norm(), 1e-12 * input.norm());
      EXPECT_LT((VectorXd(out.volume) - volume).norm(), 1e-12 * volume.norm());
    }
  }
}

TEST(Evaluate, SlopesAreTheDerivatives) {
  for (const ReducedModel& model : models()) {
    for (const double alpha : {0.2, 0.5, 0.7363, 1.1, 2.0}) {
      ParametricMatrices at;
      model.evaluate(alpha, at);
      const auto difference = [&](double h) {
        ParametricMatrices above;
        ParametricMatrices below;
        model.evaluate(alpha + h, above);
        model.evaluate(alpha - h, below);
        return std::pair<VectorXd, VectorXd>((above.input - below.input) / (2.0 * h),
                                             (above.volume - below.volume) / (2.0 * h));
      };
      const auto [input1, volume1] = difference(2e-3);
      const auto [input2, volume2] = difference(1e-3);
      // Richardson: the remaining error is of order h^4 = 1e-12 times a fifth derivative below 1
      // (the absorption length of the RPE is 0.72), and rounding 1e-16 / h.
      const VectorXd input = (4.0 * input2 - input1) / 3.0;
      const VectorXd volume = (4.0 * volume2 - volume1) / 3.0;
      EXPECT_LT((VectorXd(at.input_slope[0]) - input).norm(), 1e-10 * VectorXd(at.input).norm())
          << alpha;
      EXPECT_LT((VectorXd(at.volume_slope[0]) - volume).norm(), 1e-10 * VectorXd(at.volume).norm())
          << alpha;
      EXPECT_GT(VectorXd(at.input_slope[0]).norm(), 0.01 * VectorXd(at.input).norm());
    }
  }
}

TEST(Evaluate, AllocatesNothing) {
  if (!testing::heap_guard_sees_malloc()) GTEST_SKIP() << "Eigen calls malloc itself";
  const ReducedModel model = coarse_model(testing::normalized(Tissue{}));
  ReducedPlant plant(model, 1.1);
  ParametricMatrices out;
  double sum = 0.0;
  testing::HeapUse use;
  {
    const testing::HeapGuard guard;
    for (int k = 0; k < 20; ++k) {
      model.evaluate(0.3 + 0.05 * k, out);
      plant.step(0.1);
      sum += plant.outputs().peak + out.input[0];
    }
    use = guard.use();
  }
  EXPECT_EQ(use, testing::HeapUse{});
  EXPECT_NE(sum, 0.0);
}

TEST(ReducedPlant, FollowsTheRecursion) {
  const ReducedModel model = coarse_model();
  ParametricMatrices m;
  model.evaluate(0.9, m);
  ReducedPlant plant(model, 0.9);
  EXPECT_EQ(plant.outputs().peak, 0.0);
  VectorXd state = VectorXd::Zero(model.order());
  for (int k = 0; k < 50; ++k) {
    const double power = k % 3 == 0 ? 0.1 : 0.02;
    plant.step(power);
    state = (MatrixXd(model.A_d) * state + power * VectorXd(m.input)).eval();
    EXPECT_NEAR(plant.outputs().peak, VectorXd(model.C_peak).dot(state), 1e-12);
    EXPECT_NEAR(plant.outputs().volume, VectorXd(m.volume).dot(state), 1e-12);
  }
}

TEST(ReducedPlant, PeriodMayChangeAndKeepsTheState) {
  const ReducedModel model = coarse_model();
  ReducedPlant changing(model, 0.9);
  ReducedPlant steady(model, 0.9);
  changing.step(0.1);
  const double before = changing.outputs().peak;
  changing.set_period(3e-3);
  EXPECT_EQ(changing.outputs().peak, before);
  changing.step(0.1);
  for (int k = 0; k < 4; ++k) steady.step(0.1);
  EXPECT_NEAR(changing.outputs().peak, steady.outputs().peak, 1e-12 * steady.outputs().peak);
  EXPECT_NEAR(changing.outputs().volume, steady.outputs().volume, 1e-12 * steady.outputs().volume);
}

}  // namespace
}  // namespace photocoag
