// Layers that conduct and store heat differently, perfusion, and the steppers for them, against one
// dense matrix (dense_operator.hpp), the separable path and exact balances.
#include "photocoag/fom/layered_stepper.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <memory>
#include <unsupported/Eigen/MatrixFunctions>

#include "fom/dense_operator.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/random.hpp"
#include "photocoag/core/step_response.hpp"
#include "photocoag/fom/stepper.hpp"
#include "support/heap_guard.hpp"
#include "support/tissues.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::barely_layered;
using testing::dense_operator;
using testing::DenseOperator;
using testing::gaussian;
using testing::layered;
using testing::ring_beam;
using testing::small_grid;

std::shared_ptr<const FullOrderModel> model_of(const Tissue& tissue, std::size_t cells = 5000) {
  return std::make_shared<const FullOrderModel>(tissue, GridSettings{.min_cells = cells});
}

// One step of the dense matrix: x+ = transition x + input u.
struct DenseStep {
  MatrixXd transition;
  VectorXd input;
};

DenseStep dense_step(const DenseOperator& op, Discretization how, double period) {
  const MatrixXd identity = MatrixXd::Identity(op.A.rows(), op.A.cols());
  if (how == Discretization::kZeroOrderHold) {
    const MatrixXd transition = (period * op.A).exp();
    return {transition, op.A.partialPivLu().solve((transition - identity) * op.B)};
  }
  if (how == Discretization::kImplicitEuler) {
    const auto lu = (identity - period * op.A).partialPivLu();
    return {lu.inverse(), lu.solve(VectorXd(period * op.B))};
  }
  // TR-BDF2 as it is defined: the trapezoidal rule over gamma h, then backward differences through
  // the three values.
  const double g = 2.0 - std::sqrt(2.0);
  const auto trapezoid = (identity - 0.5 * g * period * op.A).partialPivLu();
  const MatrixXd middle = trapezoid.solve(identity + 0.5 * g * period * op.A);
  const VectorXd middle_input = trapezoid.solve(VectorXd(g * period * op.B));
  const auto backward = (identity - (1.0 - g) / (2.0 - g) * period * op.A).partialPivLu();
  const double old = -(1.0 - g) * (1.0 - g) / (g * (2.0 - g));
  return {backward.solve(middle / (g * (2.0 - g)) + old * identity),
          backward.solve(
              VectorXd(middle_input / (g * (2.0 - g)) + (1.0 - g) / (2.0 - g) * period * op.B))};
}

// The whole state, with the memory of fast modes dropped or not.
double worst_error(const Tissue& tissue, double alpha, Discretization how, double period,
                   double negligible) {
  const DenseOperator op = dense_operator(tissue, small_grid(), alpha);
  const DenseStep step = dense_step(op, how, period);
  const auto model = std::make_shared<const FullOrderModel>(tissue, small_grid());
  EXPECT_FALSE(model->separable());
  LayeredStepper stepper(model, how, period, alpha, negligible);
  VectorXd state = VectorXd::Zero(op.A.rows());
  double worst = 0.0;
  for (int k = 0; k < 25; ++k) {
    const double power = k < 20 ? 0.1 * uniform(3, k, RandomStream::kTest) : 0.0;
    stepper.step(power);
    state = (step.transition * state + step.input * power).eval();
    const MatrixXd cells = stepper.temperatures();
    const Eigen::Map<const MatrixXd> dense(state.data(), cells.rows(), cells.cols());
    const double scale = dense.cwiseAbs().maxCoeff();
    worst = std::max(worst, (cells - dense).cwiseAbs().maxCoeff() / scale);
    const double peak = op.C_peak.dot(state);
    const double volume = op.C_volume.dot(state);
    worst = std::max(worst, std::abs(stepper.outputs().peak - peak) / scale);
    worst = std::max(worst, std::abs(stepper.outputs().volume - volume) / scale);
  }
  return worst;
}

TEST(Layered, SteppingEqualsTheDenseMatrix) {
  Tissue weak = testing::normalized(layered());
  weak.transmission = 0.25;
  weak.layers[3].absorption = 26622.0;
  for (const Tissue& tissue : {layered(), weak, gaussian(layered()), ring_beam(weak)}) {
    for (const double period : {0.1e-3, 1e-3, 4e-3}) {
      for (const double negligible : {0.0, 1e-12}) {
        SCOPED_TRACE(period);
        // Rounding only; the dense exponential squares its way up from a norm of 1.
        const auto error = [&](Discretization how) {
          return worst_error(tissue, 1.1, how, period, negligible);
        };
        EXPECT_LT(error(Discretization::kImplicitEuler), 1e-11);
        EXPECT_LT(error(Discretization::kTrBdf2), 1e-11);
        // The rational approximation's 2.6e-12 per step, kept for as long as the heat stays.
        EXPECT_LT(error(Discretization::kZeroOrderHold), 2e-10);
      }
    }
  }
}

// Thermal data as good as uniform give what the separable path gives, on a real grid.
TEST(Layered, AlmostEqualLayersEqualTheSeparablePath) {
  for (const Tissue& tissue : {Tissue{}, gaussian(testing::with_vitreous())}) {
    const auto uniform_model = model_of(tissue);
    const auto layered_model = model_of(barely_layered(tissue));
    ASSERT_TRUE(uniform_model->separable());
    ASSERT_FALSE(layered_model->separable());
    for (const auto how : kDiscretizations) {
      for (const double period : {0.1e-3, 1e-3, 4e-3}) {
        FullOrderPlant uniform_plant(uniform_model, how, period, 0.9);
        FullOrderPlant layered_plant(layered_model, how, period, 0.9);
        for (int k = 0; k < 200; ++k) {
          const double power = k % 50 < 20 ? 0.1 : 0.0;
          uniform_plant.step(power);
          layered_plant.step(power);
          const Outputs a = uniform_plant.outputs();
          const Outputs b = layered_plant.outputs();
          ASSERT_NEAR(b.peak, a.peak, 1e-9 * (1e-3 + std::abs(a.peak))) << to_string(how) << k;
          ASSERT_NEAR(b.volume, a.volume, 1e-9 * (1e-3 + std::abs(a.volume)))
              << to_string(how) << k;
        }
      }
    }
  }
}

Outputs response(const std::shared_ptr<const FullOrderModel>& model, Discretization how,
                 double period, double time) {
  FullOrderPlant plant(model, how, period, 0.7363, 0.0);
  return sample_step_response(plant, how, period, 1.0, {time}).front();
}

TEST(Layered, ImplicitEulerIsOfOrderOneAndTrBdf2OfOrderTwo) {
  for (const Tissue& tissue : {Tissue{}, layered()}) {
    const auto model = model_of(tissue, 3000);
    constexpr double kTime = 64e-3;
    const Outputs exact = response(model, Discretization::kZeroOrderHold, 1e-3, kTime);
    for (const auto how : {Discretization::kImplicitEuler, Discretization::kTrBdf2}) {
      const double order = how == Discretization::kImplicitEuler ? 1.0 : 2.0;
      double last[2] = {};
      for (const double period : {4e-3, 2e-3, 1e-3, 0.5e-3}) {
        const Outputs outputs = response(model, how, period, kTime);
        const double error[2] = {std::abs(exact.peak - outputs.peak),
                                 std::abs(exact.volume - outputs.volume)};
        for (int output = 0; output < 2; ++output) {
          if (last[output] > 0.0) {
            const double observed = std::log2(last[output] / error[output]);
            EXPECT_NEAR(observed, order, 0.02) << to_string(how) << ' ' << period;
          }
          last[output] = error[output];
        }
      }
    }
  }
}

TEST(Layered, ZeroOrderHoldDoesNotDependOnTheStep) {
  const auto model = model_of(layered(), 3000);
  const Outputs one = response(model, Discretization::kZeroOrderHold, 1e-3, 50e-3);
  FullOrderPlant plant(model, Discretization::kZeroOrderHold, 1e-3, 0.7363, 0.0);
  for (int i = 0; i < 50; ++i) plant.step(1.0);
  EXPECT_NEAR(plant.outputs().peak / one.peak, 1.0, 1e-10);
  EXPECT_NEAR(plant.outputs().volume / one.volume, 1.0, 1e-10);
}

// Modes without memory, and modes that have cooled down while there was no power.
TEST(Layered, DroppedModesDoNotChangeTheOutputs) {
  const auto model = model_of(layered(), 20000);
  for (const auto how : kDiscretizations) {
    for (const double period : {1e-3, 10e-3}) {
      LayeredStepper fast(model, how, period, 1.1);
      LayeredStepper all(model, how, period, 1.1, 0.0);
      EXPECT_GE(all.active_modes(), model->states());
      if (how == Discretization::kZeroOrderHold) {
        EXPECT_LT(fast.active_modes(), all.active_modes());
      }
      for (int k = 0; k < 120; ++k) {
        const double power = (k % 7 < 4 && k < 30) || k == 100 ? 0.1 : 0.0;
        fast.step(power);
        all.step(power);
        ASSERT_NEAR(fast.outputs().peak, all.outputs().peak, 1e-9 * all.outputs().peak) << k;
        ASSERT_NEAR(fast.outputs().volume, all.outputs().volume, 1e-9 * all.outputs().volume) << k;
        if (k % 30 != 29) continue;
        const double scale = all.temperatures().cwiseAbs().maxCoeff();
        EXPECT_LT((fast.temperatures() - all.temperatures()).cwiseAbs().maxCoeff(), 1e-9 * scale);
        EXPECT_LT((fast.spot_profile() - all.spot_profile()).norm(),
                  1e-9 * all.spot_profile().norm());
      }
    }
  }
}

TEST(Layered, StepsAndResetsLikeAnyStepper) {
  const auto model = model_of(layered(), 3000);
  for (const auto how : kDiscretizations) {
    LayeredStepper used(model, how, 1e-3, 1.1);
    LayeredStepper fresh(model, how, 1e-3, 1.1);
    used.step(0.0);
    EXPECT_EQ(used.outputs().peak, 0.0) << "cold tissue without light stays cold";
    for (int k = 0; k < 10; ++k) used.step(0.1);
    // The volume output is the source's adjoint: the same number from the profile.
    EXPECT_NEAR(model->axial_source(1.1).dot(used.spot_profile()) / used.outputs().volume, 1.0,
                1e-12);
    used.reset();
    EXPECT_EQ(used.outputs().peak, 0.0);
    used.step(0.02);
    fresh.step(0.02);
    EXPECT_EQ(used.outputs().peak, fresh.outputs().peak);
    EXPECT_EQ(used.outputs().volume, fresh.outputs().volume);
  }
  LayeredStepper fast(model, Discretization::kZeroOrderHold, 1e-3, 1.1);
  EXPECT_NO_THROW(fast.set_period(1e-3));
  EXPECT_THROW(fast.set_period(2e-3), Error);
  EXPECT_THROW(LayeredStepper(model_of(Tissue{}, 1000), Discretization::kZeroOrderHold, 1e-3, 1.1),
               Error);
  EXPECT_THROW(ModalStepper(model, Discretization::kZeroOrderHold, 1e-3), Error);
}

TEST(Layered, StepAndOutputsAllocateNothing) {
  const auto model = model_of(layered(), 3000);
  for (const auto how : kDiscretizations) {
    FullOrderPlant plant(model, how, 1e-3, 1.1);
    const testing::HeapGuard guard;
    double sum = 0.0;
    for (int k = 0; k < 40; ++k) {
      plant.step(k < 10 ? 0.1 : 0.0);
      sum += plant.outputs().peak;
    }
    const testing::HeapUse use = guard.use();
    EXPECT_EQ(use.allocations + use.frees, 0);
    EXPECT_GT(sum, 0.0);
  }
}

// Perfusion that differs from layer to layer leaves the fast path in place.
TEST(Layered, PerfusionAloneIsSeparable) {
  Tissue tissue = testing::normalized(Tissue{});
  tissue.layers[3].perfusion = 1e7;
  tissue.layers[4].perfusion = 1e5;
  const auto model = std::make_shared<const FullOrderModel>(tissue, small_grid());
  ASSERT_TRUE(model->separable());
  const DenseOperator op = dense_operator(tissue, small_grid(), 1.1);
  const DenseStep step = dense_step(op, Discretization::kZeroOrderHold, 4e-3);
  FullOrderPlant plant(model, Discretization::kZeroOrderHold, 4e-3, 1.1);
  VectorXd state = VectorXd::Zero(op.A.rows());
  for (int k = 0; k < 25; ++k) {
    plant.step(0.1);
    state = (step.transition * state + step.input * 0.1).eval();
    EXPECT_NEAR(plant.outputs().peak, op.C_peak.dot(state), 1e-10 * op.C_peak.dot(state));
    EXPECT_NEAR(plant.outputs().volume, op.C_volume.dot(state), 1e-10 * op.C_volume.dot(state));
  }
  // Data of its own that equal the tissue's are no difference.
  tissue.layers[2].conductivity = tissue.conductivity;
  EXPECT_TRUE(tissue.uniform_conduction());
  // All layers alike, but not like the tissue's values: uniform with the layers' values.
  Tissue alike;
  for (Layer& layer : alike.layers) layer.conductivity = 0.5;
  Tissue wide;
  wide.conductivity = 0.5;
  EXPECT_TRUE(alike.uniform_conduction());
  EXPECT_EQ(FullOrderModel(alike, small_grid()).axial().rates,
            FullOrderModel(wide, small_grid()).axial().rates);
}

TEST(Layered, VolumeOutputIsTheAdjointOfTheInput) {
  const auto model = model_of(gaussian(layered()));
  for (const auto how : kDiscretizations) {
    LayeredStepper one(model, how, 1e-3, 0.4);
    LayeredStepper other(model, how, 1e-3, 1.5);
    for (int k = 0; k < 30; ++k) {
      one.step(1.0);
      other.step(1.0);
    }
    // Heating with one alpha and measuring with another is the same either way round.
    const double there = model->axial_source(1.5).dot(one.spot_profile());
    const double back = model->axial_source(0.4).dot(other.spot_profile());
    EXPECT_NEAR(there / back, 1.0, 1e-10);
    EXPECT_GT(std::abs(one.outputs().volume / other.outputs().volume - 1.0), 0.1);
  }
}

}  // namespace
}  // namespace photocoag
