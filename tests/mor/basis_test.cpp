// The impulse space and the POD basis in it.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "photocoag/core/error.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/mor/impulse_space.hpp"
#include "photocoag/mor/pod.hpp"
#include "photocoag/mor/reduce.hpp"
#include "support/tissues.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

const std::vector<AbsorptionFactors> kAlphas = {0.25, 0.4, 0.6, 0.9, 1.4, 2.0};

std::shared_ptr<const FullOrderModel> model_of(const Tissue& tissue, std::size_t cells = 5000) {
  return std::make_shared<const FullOrderModel>(tissue, GridSettings{.min_cells = cells});
}

TEST(ImpulseSpace, DecaysNoFasterOrSlowerThanTheFullModel) {
  for (const auto& [name, tissue] : testing::various_tissues()) {
    SCOPED_TRACE(name);
    const auto full = model_of(tissue, 3000);
    const ImpulseSpace space = impulse_space(*full, kAlphas);
    ASSERT_GT(space.size(), 10);
    for (Index i = 1; i < space.size(); ++i) EXPECT_GE(space.rates[i], space.rates[i - 1]);
    // Rayleigh quotients lie between the extreme eigenvalues.
    const double slowest = full->radial().rates[0] + full->axial().rates[0];
    const double fastest = full->radial().rates.tail(1)[0] + full->axial().rates.tail(1)[0];
    EXPECT_GE(space.rates[0], slowest * (1.0 - 1e-9));
    EXPECT_LE(space.rates.tail(1)[0], fastest * (1.0 + 1e-9));
  }
}

// V column by column, against its definition: orthonormal, diagonal in A, and with the outputs and
// inputs that the space claims. Grids with fewer radial cells than snapshot times, and with more.
TEST(ImpulseSpace, LiftsToTheFullModelsCoordinates) {
  for (const std::size_t cells : {1000U, 12000U}) {
    const auto full = model_of(Tissue{}, cells);
    const ImpulseSpace space = impulse_space(*full, kAlphas);
    const Index n = full->radial().size() * full->axial().size();
    MatrixXd basis(n, space.size());
    for (Index k = 0; k < space.size(); ++k) {
      const MatrixXd lifted = space.lift(VectorXd::Unit(space.size(), k));
      basis.col(k) = lifted.reshaped();
      EXPECT_NEAR(full->peak_radial().dot(lifted * full->peak_axial()), space.peak[k],
                  1e-8 * space.peak.cwiseAbs().maxCoeff());
      const VectorXd source = lifted.transpose() * full->beam();
      EXPECT_LT((source - space.axial_source.row(k).transpose()).norm(),
                1e-8 * space.axial_source.norm());
    }
    // Snapshots enter with factors up to 1 / sqrt(1e-13), which multiply their rounding.
    const MatrixXd gram = basis.transpose() * basis;
    EXPECT_LT((gram - MatrixXd::Identity(space.size(), space.size())).norm(), 1e-7);
    const MatrixXd rates = full->radial().rates.replicate(1, full->axial().size()).rowwise() +
                           full->axial().rates.transpose();
    const MatrixXd projected = basis.transpose() * rates.reshaped().asDiagonal() * basis;
    EXPECT_LT((projected - MatrixXd(space.rates.asDiagonal())).norm(), 1e-7 * space.rates.norm());
  }
}

// Outputs of the projection, stepped mode by mode, against the full-order model: also at alphas
// between those it was made of, and at times and signals it has not seen.
TEST(ImpulseSpace, FollowsTheFullModel) {
  for (const Tissue& tissue : {Tissue{}, testing::literature_choroid()}) {
    const auto full = model_of(tissue, 20000);
    const ImpulseSpace space = impulse_space(*full, kAlphas);
    for (const double period : {1e-3, 4e-3}) {
      const std::vector<double> power = on_off_power(0.4, period, 10e-3, 77);
      ModalStepper stepper(full, Discretization::kZeroOrderHold, period);
      const VectorXd decay = (-period * space.rates).array().exp();
      const VectorXd gain = (1.0 - decay.array()) / space.rates.array();
      for (const double alpha : {0.3, 0.7363, 1.1, 1.7}) {
        stepper.reset();
        const OutputWeights weights = full->output_weights(alpha);
        const VectorXd shape = space.axial_source * full->axial_source(alpha);
        VectorXd state = VectorXd::Zero(space.size());
        double error[2] = {};
        double value[2] = {};
        for (const double u : power) {
          stepper.step(u);
          state = decay.cwiseProduct(state) + (full->input_gain() * u) * gain.cwiseProduct(shape);
          const Outputs exact = stepper.outputs(weights);
          error[0] = std::max(error[0], std::abs(space.peak.dot(state) - exact.peak));
          error[1] = std::max(error[1], std::abs(shape.dot(state) - exact.volume));
          value[0] = std::max(value[0], exact.peak);
          value[1] = std::max(value[1], exact.volume);
        }
        // A hundredth of what the reduced model is allowed.
        EXPECT_LT(error[0], 1e-4 * value[0]) << alpha;
        EXPECT_LT(error[1], 1e-4 * value[1]) << alpha;
      }
    }
  }
}

TEST(Pod, BasisIsOrthonormalAndNested) {
  const auto full = model_of(Tissue{});
  const ImpulseSpace space = impulse_space(*full, kAlphas);
  const MatrixXd largest = pod_basis(*full, space, 14);
  EXPECT_EQ(largest.rows(), space.size());
  EXPECT_LT((largest.transpose() * largest - MatrixXd::Identity(14, 14)).cwiseAbs().maxCoeff(),
            1e-13);
  for (const int order : {1, 6}) {
    EXPECT_EQ(pod_basis(*full, space, order), MatrixXd(largest.leftCols(order)));
  }
}

TEST(Pod, RefusesMoreThanThereIs) {
  const auto full = model_of(Tissue{}, 1000);
  const ImpulseSpace space = impulse_space(*full, kAlphas);
  EXPECT_THROW(pod_basis(*full, space, static_cast<int>(space.size()) + 1), Error);
}

}  // namespace
}  // namespace photocoag
