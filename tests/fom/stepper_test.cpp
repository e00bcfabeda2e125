#include "photocoag/fom/stepper.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "photocoag/core/error.hpp"
#include "photocoag/core/random.hpp"
#include "support/heap_guard.hpp"
#include "support/tissues.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

std::shared_ptr<const FullOrderModel> model_of(const Tissue& tissue, std::size_t cells = 3000) {
  return std::make_shared<const FullOrderModel>(tissue, GridSettings{.min_cells = cells});
}

double on_off(int k) { return uniform(11, k / 7, RandomStream::kTest) < 0.5 ? 0.0 : 0.1; }

// Dropping the memory of decayed modes saves most of the work and changes nothing that can be seen.
TEST(Stepper, DroppedModesDoNotChangeTheOutputs) {
  const auto model = model_of(Tissue{}, 80000);
  for (const double period : {0.1e-3, 1e-3, 4e-3}) {
    ModalStepper fast(model, Discretization::kZeroOrderHold, period);
    ModalStepper all(model, Discretization::kZeroOrderHold, period, 0.0);
    EXPECT_EQ(all.active_modes(), model->states());
    EXPECT_LT(fast.active_modes(), model->states()) << period;
    double worst = 0.0;
    for (int k = 0; k < 300; ++k) {
      fast.step(on_off(k));
      all.step(on_off(k));
      for (const double alpha : {0.3, 1.1, 1.7}) {
        const OutputWeights weights = model->output_weights(alpha);
        const Outputs a = fast.outputs(weights);
        const Outputs b = all.outputs(weights);
        if (b.peak == 0.0) continue;
        worst =
            std::max({worst, std::abs(a.peak / b.peak - 1.0), std::abs(a.volume / b.volume - 1.0)});
      }
      if (k % 100 == 0 && period > 0.5e-3) {
        const Eigen::MatrixXd cells = all.temperatures(1.1);
        EXPECT_LT((fast.temperatures(1.1) - cells).cwiseAbs().maxCoeff(),
                  1e-9 * (1e-30 + cells.cwiseAbs().maxCoeff()));
      }
    }
    EXPECT_LT(worst, 1e-9) << period;
  }
}

TEST(Stepper, IsLinearInThePower) {
  const auto model = model_of(Tissue{});
  const OutputWeights weights = model->output_weights(0.9);
  for (const auto how : {Discretization::kZeroOrderHold, Discretization::kImplicitEuler}) {
    ModalStepper one(model, how, 1e-3);
    ModalStepper doubled(model, how, 1e-3);
    ModalStepper other(model, how, 1e-3);
    ModalStepper both(model, how, 1e-3);
    for (int k = 0; k < 100; ++k) {
      const double u = on_off(k);
      const double v = 0.03 * uniform(12, k, RandomStream::kTest);
      one.step(u);
      doubled.step(2.0 * u);
      other.step(v);
      both.step(u + v);
      // Doubling is exact in binary; a sum is not.
      EXPECT_EQ(doubled.outputs(weights).peak, 2.0 * one.outputs(weights).peak);
      EXPECT_EQ(doubled.outputs(weights).volume, 2.0 * one.outputs(weights).volume);
      EXPECT_NEAR(both.outputs(weights).peak,
                  one.outputs(weights).peak + other.outputs(weights).peak,
                  1e-12 * both.outputs(weights).peak);
    }
  }
}

TEST(Stepper, TransmissionScalesBothOutputs) {
  Tissue half;
  half.transmission = 0.5;
  FullOrderPlant full_plant(model_of(Tissue{}), Discretization::kZeroOrderHold, 1e-3, 1.1);
  FullOrderPlant half_plant(model_of(half), Discretization::kZeroOrderHold, 1e-3, 1.1);
  for (int k = 0; k < 20; ++k) {
    full_plant.step(0.05);
    half_plant.step(0.05);
    EXPECT_DOUBLE_EQ(half_plant.outputs().peak, 0.5 * full_plant.outputs().peak);
    EXPECT_DOUBLE_EQ(half_plant.outputs().volume, 0.5 * full_plant.outputs().volume);
  }
}

TEST(Stepper, NormalizedVolumeIsTheRawOneOverTheAbsorbedFraction) {
  const double absorbed = -std::expm1(-(1.1 * 120400.0 * 6e-6 + 2662.2 * 400e-6));
  FullOrderPlant raw(model_of(Tissue{}), Discretization::kZeroOrderHold, 1e-3, 1.1);
  FullOrderPlant normalized(model_of(testing::normalized(Tissue{})), Discretization::kZeroOrderHold,
                            1e-3, 1.1);
  raw.step(0.1);
  normalized.step(0.1);
  EXPECT_NEAR(normalized.outputs().volume * absorbed, raw.outputs().volume,
              1e-13 * raw.outputs().volume);
  EXPECT_DOUBLE_EQ(normalized.outputs().peak, raw.outputs().peak);
}

TEST(Stepper, ResetIsAFreshStart) {
  const auto model = model_of(Tissue{});
  const OutputWeights weights = model->output_weights(1.1);
  ModalStepper used(model, Discretization::kZeroOrderHold, 1e-3);
  ModalStepper fresh(model, Discretization::kZeroOrderHold, 1e-3);
  for (int k = 0; k < 10; ++k) used.step(0.1);
  used.reset();
  EXPECT_EQ(used.outputs(weights).peak, 0.0);
  EXPECT_EQ(used.outputs(weights).volume, 0.0);
  EXPECT_EQ(used.temperatures(1.1).cwiseAbs().maxCoeff(), 0.0);
  used.step(0.02);
  fresh.step(0.02);
  EXPECT_EQ(used.outputs(weights).peak, fresh.outputs(weights).peak);
}

TEST(Stepper, PeriodChangesOnlyWithEveryModeKept) {
  const auto model = model_of(Tissue{});
  const OutputWeights weights = model->output_weights(1.1);
  ModalStepper fast(model, Discretization::kZeroOrderHold, 1e-3);
  EXPECT_NO_THROW(fast.set_period(1e-3));
  EXPECT_THROW(fast.set_period(2e-3), Error);
  EXPECT_EQ(fast.period(), 1e-3);
  // 1 ms + 3 ms = 4 ms, and no jump of the outputs when the period changes.
  ModalStepper changing(model, Discretization::kZeroOrderHold, 1e-3, 0.0);
  ModalStepper once(model, Discretization::kZeroOrderHold, 4e-3, 0.0);
  changing.step(0.1);
  const double before = changing.outputs(weights).peak;
  changing.set_period(3e-3);
  EXPECT_EQ(changing.outputs(weights).peak, before);
  changing.step(0.1);
  once.step(0.1);
  EXPECT_NEAR(changing.outputs(weights).peak, once.outputs(weights).peak, 1e-12 * before);
  EXPECT_NEAR(changing.outputs(weights).volume, once.outputs(weights).volume, 1e-12 * before);
}

TEST(Stepper, StepAndOutputsAllocateNothing) {
  if (!testing::heap_guard_sees_malloc()) GTEST_SKIP() << "Eigen calls malloc itself";
  const auto model = model_of(Tissue{});
  const OutputWeights weights = model->output_weights(1.1);
  for (const auto how : {Discretization::kZeroOrderHold, Discretization::kImplicitEuler}) {
    ModalStepper stepper(model, how, 1e-3);
    FullOrderPlant plant(model, how, 1e-3, 1.1);
    double sum = 0.0;
    testing::HeapUse use;
    {
      const testing::HeapGuard guard;
      for (int k = 0; k < 10; ++k) {
        stepper.step(0.1);
        sum += stepper.outputs(weights).peak;
        plant.step(0.1);
        sum += plant.outputs().peak;
      }
      stepper.reset();
      use = guard.use();
    }
    EXPECT_EQ(use, testing::HeapUse{});
    EXPECT_GT(sum, 0.0);
  }
  // The guard sees what does allocate.
  const testing::HeapGuard guard;
  const VectorXd planted = model->axial_source(1.0);
  const long allocations = guard.use().allocations;
  EXPECT_GT(allocations, 0);
}

// Functionals as weights per cell, recovered from their modal coordinates.
VectorXd per_cell(const Modes& modes, const VectorXd& coordinates) {
  return (modes.vectors * coordinates).cwiseProduct(modes.root_measure);
}

TEST(OutputFunctionals, PeakIsExactForCubicsInDepthAndParabolasInRadius) {
  for (const auto& [name, tissue] : testing::various_tissues()) {
    SCOPED_TRACE(name);
    const auto model = model_of(tissue);
    const Axis& depth = model->grid().axial;
    const VectorXd in_depth = per_cell(model->axial(), model->peak_axial());
    const double scale = tissue.depth();
    for (int power = 0; power <= 3; ++power) {
      double value = 0.0;
      for (Index j = 0; j < in_depth.size(); ++j) {
        value +=
            in_depth[j] * std::pow((depth.center(j) - tissue.peak_depth()) / scale + 1.0, power);
      }
      EXPECT_NEAR(value, 1.0, 1e-11) << power;
    }
    const Axis& radius = model->grid().radial;
    const VectorXd on_axis = per_cell(model->radial(), model->peak_radial());
    double constant = 0.0;
    double square = 0.0;
    for (Index i = 0; i < on_axis.size(); ++i) {
      const double mean_square =
          (std::pow(radius.faces[i + 1], 4) - std::pow(radius.faces[i], 4)) /
          (2.0 * (std::pow(radius.faces[i + 1], 2) - std::pow(radius.faces[i], 2)));
      constant += on_axis[i];
      square += on_axis[i] * mean_square / std::pow(tissue.spot_radius, 2);
    }
    EXPECT_NEAR(constant, 1.0, 1e-11);
    // Weights of 0 on far rings come back as roundings, times up to 40,000 spot radii squared.
    EXPECT_NEAR(square, 0.0, 1e-9);
  }
}

TEST(OutputFunctionals, BeamIsTheMeanOverTheSpot) {
  const Tissue tissue;
  const auto model = model_of(tissue);
  const VectorXd beam = per_cell(model->radial(), model->beam());
  for (Index i = 0; i < beam.size(); ++i) {
    const double inner = model->grid().radial.faces[i] / tissue.spot_radius;
    const double outer = model->grid().radial.faces[i + 1] / tissue.spot_radius;
    EXPECT_NEAR(beam[i], outer <= 1.0 + 1e-12 ? outer * outer - inner * inner : 0.0, 1e-12) << i;
  }
  EXPECT_NEAR(beam.sum(), 1.0, 1e-12);
}

}  // namespace
}  // namespace photocoag
