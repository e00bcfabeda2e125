// Where the light's energy goes: stored in the tissue or through the boundary, nothing else.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "photocoag/core/random.hpp"
#include "photocoag/fom/stepper.hpp"
#include "support/tissues.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// Heat content in J and flow of heat through the boundary in W, from cell temperatures and faces
// alone.
struct Budget {
  double content = 0.0;
  double outflow = 0.0;
};

Budget budget(const Tissue& tissue, const Grid& grid, const MatrixXd& temperatures) {
  using std::numbers::pi;
  Budget sum;
  const Index nr = temperatures.rows();
  const Index nz = temperatures.cols();
  const double k = tissue.conductivity;
  for (Index i = 0; i < nr; ++i) {
    const double area =
        pi * (std::pow(grid.radial.faces[i + 1], 2) - std::pow(grid.radial.faces[i], 2));
    for (Index j = 0; j < nz; ++j) {
      sum.content +=
          tissue.volumetric_heat_capacity() * area * grid.axial.width(j) * temperatures(i, j);
    }
    sum.outflow += k * area * temperatures(i, 0) / (0.5 * grid.axial.width(0));
    sum.outflow += k * area * temperatures(i, nz - 1) / (0.5 * grid.axial.width(nz - 1));
  }
  for (Index j = 0; j < nz; ++j) {
    sum.outflow += k * 2.0 * pi * grid.radial.faces[nr] * grid.axial.width(j) *
                   temperatures(nr - 1, j) / (0.5 * grid.radial.width(nr - 1));
  }
  return sum;
}

double absorbed_share(const Tissue& tissue, double alpha) {
  double optical_depth = 0.0;
  for (const Layer& layer : tissue.layers) {
    optical_depth +=
        layer.absorption * layer.thickness * (layer.scaled_by == ScaledBy::kAlpha ? alpha : 1.0);
  }
  return -std::expm1(-optical_depth);
}

// Per implicit Euler step: change of the content / h = absorbed power - outflow at the end, to
// rounding.
TEST(Energy, ImplicitEulerBalancesEveryStep) {
  Tissue tight = testing::literature_choroid();  // much flux through the side and the back
  tight.domain_radius = 250e-6;
  tight.transmission = 0.5;
  for (const Tissue& tissue : {Tissue{}, tight}) {
    const double alpha = 1.1;
    const auto model =
        std::make_shared<const FullOrderModel>(tissue, GridSettings{.min_cells = 3000});
    for (const double period : {1e-3, 20e-3}) {
      ModalStepper stepper(model, Discretization::kImplicitEuler, period);
      double content = 0.0;
      double largest_outflow = 0.0;
      for (int k = 0; k < 60; ++k) {
        const double power = 0.1 * uniform(5, k, RandomStream::kTest);
        stepper.step(power);
        const Budget now = budget(tissue, model->grid(), stepper.temperatures(alpha));
        const double absorbed = tissue.transmission * absorbed_share(tissue, alpha) * power;
        // Contents of up to 0.1 W * 1 s are subtracted and divided by h: 1e-11 of the power.
        EXPECT_NEAR((now.content - content) / period, absorbed - now.outflow, 1e-11) << k;
        content = now.content;
        largest_outflow = std::max(largest_outflow, now.outflow);
      }
      // The flux matters, else the test would not see it.
      if (period > 10e-3) {
        EXPECT_GT(largest_outflow, 1e-3);
      }
    }
  }
}

// Before the heat reaches any boundary all that was absorbed is stored.
TEST(Energy, ZeroOrderHoldStoresEverythingAtFirst) {
  for (const double alpha : {0.3, 1.7}) {
    const auto model =
        std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{.min_cells = 3000});
    ModalStepper stepper(model, Discretization::kZeroOrderHold, 0.25e-3);
    for (int k = 1; k <= 8; ++k) {
      stepper.step(0.1);
      const Budget now = budget(Tissue{}, model->grid(), stepper.temperatures(alpha));
      const double absorbed = 0.1 * absorbed_share(Tissue{}, alpha) * k * 0.25e-3;
      EXPECT_NEAR(now.content / absorbed, 1.0, 1e-9) << k;
    }
  }
}

// Half a millimetre and a second later most of it has left, and in the steady state as much leaves
// as comes in.
TEST(Energy, SteadyStateLetsOutWhatComesIn) {
  const auto model =
      std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{.min_cells = 3000});
  ModalStepper stepper(model, Discretization::kZeroOrderHold, 60.0, 0.0);
  stepper.step(0.1);
  const Budget now = budget(Tissue{}, model->grid(), stepper.temperatures(0.7363));
  EXPECT_NEAR(now.outflow / (0.1 * absorbed_share(Tissue{}, 0.7363)), 1.0, 1e-9);
}

// The volume output is the input's adjoint, so its impulse response is a sum of decaying
// exponentials with positive weights: positive, falling, convex, and so on (completely monotone).
TEST(Energy, VolumeImpulseResponseIsCompletelyMonotone) {
  for (const Tissue& tissue : {Tissue{}, testing::normalized(testing::literature_choroid())}) {
    const auto model =
        std::make_shared<const FullOrderModel>(tissue, GridSettings{.min_cells = 5000});
    for (const double alpha : {0.3, 0.7363, 1.7}) {
      const OutputWeights weights = model->output_weights(alpha);
      EXPECT_GE(weights.volume.minCoeff(), 0.0);
      for (const double period : {0.1e-3, 1e-3, 10e-3}) {
        FullOrderPlant plant(model, Discretization::kZeroOrderHold, period, alpha, 0.0);
        std::vector<double> difference;
        plant.step(1.0);
        for (int k = 0; k < 60; ++k) {
          difference.push_back(plant.outputs().volume);
          plant.step(0.0);
        }
        const double rounding = 1e-13 * difference.front();
        for (int order = 0; order < 5; ++order) {
          for (const double value : difference) ASSERT_GT(value, -rounding) << order;
          for (std::size_t k = 0; k + 1 < difference.size(); ++k) {
            difference[k] = difference[k] - difference[k + 1];
          }
          difference.pop_back();
        }
      }
    }
  }
}

}  // namespace
}  // namespace photocoag
