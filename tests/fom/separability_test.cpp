// The modal model against one dense matrix of the same balance of heat (dense_operator.hpp):
// operator, modes, source, outputs and both time discretizations.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <memory>
#include <unsupported/Eigen/MatrixFunctions>

#include "fom/dense_operator.hpp"
#include "photocoag/core/random.hpp"
#include "photocoag/fom/stepper.hpp"
#include "support/tissues.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::dense_operator;
using testing::DenseOperator;
using testing::small_grid;

std::vector<double> random_power(int steps) {
  std::vector<double> power;
  for (int i = 0; i < steps; ++i) power.push_back(0.1 * uniform(3, i, RandomStream::kTest));
  return power;
}

TEST(Separability, EigenpairsOfTheDenseOperator) {
  const FullOrderModel model(Tissue{}, small_grid());
  const DenseOperator op = dense_operator(Tissue{}, small_grid(), 1.0);
  const Modes& radial = model.radial();
  const Modes& axial = model.axial();
  ASSERT_EQ(op.A.rows(), radial.size() * axial.size());
  const double scale = op.A.cwiseAbs().maxCoeff();
  for (Index i = 0; i < radial.size(); ++i) {
    for (Index j = 0; j < axial.size(); ++j) {
      const VectorXd in_radius = radial.to_cells(VectorXd::Unit(radial.size(), i));
      const VectorXd in_depth = axial.to_cells(VectorXd::Unit(axial.size(), j));
      VectorXd field(op.A.rows());
      for (Index z = 0; z < in_depth.size(); ++z) {
        field.segment(z * in_radius.size(), in_radius.size()) = in_depth[z] * in_radius;
      }
      const double rate = radial.rates[i] + axial.rates[j];
      // Residual in the energy norm, where the operator is symmetric and the eigenvectors
      // orthonormal; some 100 roundings of the largest entry.
      const VectorXd root = op.heat_capacity.cwiseSqrt();
      const VectorXd residual = (op.A * field + rate * field).cwiseProduct(root);
      EXPECT_LT(residual.norm() / field.cwiseProduct(root).norm(), 1e-13 * scale) << i << ' ' << j;
    }
  }
}

TEST(Separability, ModesAreOrthonormalInTheEnergyProductAndDecay) {
  for (const auto& [name, tissue] : testing::various_tissues()) {
    SCOPED_TRACE(name);
    const FullOrderModel model(tissue, GridSettings{.min_cells = 20000});
    for (const Modes* modes : {&model.radial(), &model.axial()}) {
      const MatrixXd product = modes->vectors.transpose() * modes->vectors;
      EXPECT_LT((product - MatrixXd::Identity(modes->size(), modes->size())).cwiseAbs().maxCoeff(),
                1e-12);
      EXPECT_GT(modes->rates[0], 0.0);
      for (Index i = 1; i < modes->size(); ++i) EXPECT_GE(modes->rates[i], modes->rates[i - 1]);
    }
    // The slowest decays of a slab and of a cylinder, to the accuracy of a grid that is coarse far
    // away.
    const double slab = std::numbers::pi / tissue.depth();
    EXPECT_NEAR(model.axial().rates[0] / (tissue.diffusivity() * slab * slab), 1.0, 0.01);
    const double cylinder = 2.404825557695773 / tissue.domain_radius;  // first zero of J0
    EXPECT_NEAR(model.radial().rates[0] / (tissue.diffusivity() * cylinder * cylinder), 1.0, 0.01);
  }
}

TEST(Separability, OperatorIsSymmetricInTheEnergyProductAndNegative) {
  const DenseOperator op = dense_operator(Tissue{}, small_grid(), 1.0);
  const MatrixXd energy = op.heat_capacity.asDiagonal() * op.A;
  EXPECT_LT((energy - energy.transpose()).cwiseAbs().maxCoeff(),
            1e-15 * energy.cwiseAbs().maxCoeff());
  const FullOrderModel model(Tissue{}, small_grid());
  const double largest = model.radial().rates.tail(1)[0] + model.axial().rates.tail(1)[0];
  const VectorXd root = op.heat_capacity.cwiseSqrt();
  const MatrixXd symmetric = root.asDiagonal() * op.A * root.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(0.5 * (symmetric + symmetric.transpose()));
  VectorXd sums(model.states());
  for (Index i = 0; i < model.radial().size(); ++i) {
    sums.segment(i * model.axial().size(), model.axial().size()) =
        -(model.axial().rates.array() + model.radial().rates[i]);
  }
  std::sort(sums.begin(), sums.end());
  EXPECT_LT((solver.eigenvalues() - sums).cwiseAbs().maxCoeff(), 1e-13 * largest);
}

TEST(Separability, SteppingEqualsTheDenseMatrixExponential) {
  Tissue weak = testing::normalized(Tissue{});
  weak.transmission = 0.25;
  for (const Tissue& tissue : {Tissue{}, weak, testing::literature_choroid()}) {
    for (const double alpha : {0.3, 1.1}) {
      const DenseOperator op = dense_operator(tissue, small_grid(), alpha);
      const auto model = std::make_shared<const FullOrderModel>(tissue, small_grid());
      const OutputWeights weights = model->output_weights(alpha);
      const Index n = op.A.rows();
      const MatrixXd identity = MatrixXd::Identity(n, n);
      for (const double period : {0.1e-3, 1e-3, 4e-3}) {
        for (const auto how : {Discretization::kZeroOrderHold, Discretization::kImplicitEuler}) {
          SCOPED_TRACE(std::string(to_string(how)) + " " + std::to_string(period));
          MatrixXd transition;
          VectorXd input;
          if (how == Discretization::kZeroOrderHold) {
            transition = (period * op.A).exp();
            input = op.A.partialPivLu().solve((transition - identity) * op.B);
          } else {
            const auto lu = (identity - period * op.A).partialPivLu();
            transition = lu.inverse();
            input = lu.solve(VectorXd(period * op.B));
          }
          ModalStepper stepper(model, how, period);
          VectorXd state = VectorXd::Zero(n);
          for (const double power : random_power(25)) {
            stepper.step(power);
            state = (transition * state + input * power).eval();
            const Outputs outputs = stepper.outputs(weights);
            // The dense exponential squares its way up from a norm of 1: some 1e-12.
            EXPECT_NEAR(outputs.volume, op.C_volume.dot(state), 1e-10 * op.C_volume.dot(state));
            EXPECT_NEAR(outputs.peak, op.C_peak.dot(state), 1e-10 * op.C_peak.dot(state));
          }
          const MatrixXd cells = stepper.temperatures(alpha);
          const Eigen::Map<const MatrixXd> dense(state.data(), cells.rows(), cells.cols());
          EXPECT_LT((cells - dense).cwiseAbs().maxCoeff(), 1e-10 * dense.cwiseAbs().maxCoeff());
        }
      }
    }
  }
}

// What heats is what is measured: C_volume is proportional to the energy product with B.
TEST(Separability, VolumeOutputIsTheAdjointOfTheInput) {
  const auto model =
      std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{.min_cells = 5000});
  ModalStepper stepper(model, Discretization::kZeroOrderHold, 1e-3);
  for (int i = 0; i < 30; ++i) stepper.step(1.0);
  const auto weight = [&](double alpha) {  // per cell: share of the spot times absorbed fraction
    MatrixXd values = MatrixXd::Zero(model->radial().size(), model->axial().size());
    const Grid& grid = model->grid();
    for (Index i = 0; i < values.rows(); ++i) {
      if (grid.radial.faces[i + 1] > Tissue{}.spot_radius * (1 + 1e-12)) continue;
      const double share =
          (std::pow(grid.radial.faces[i + 1], 2) - std::pow(grid.radial.faces[i], 2)) /
          std::pow(Tissue{}.spot_radius, 2);
      for (Index j = 0; j < values.cols(); ++j) {
        values(i, j) = share * (testing::transmitted(Tissue{}, alpha, grid.axial.faces[j]) -
                                testing::transmitted(Tissue{}, alpha, grid.axial.faces[j + 1]));
      }
    }
    return values;
  };
  const auto measured = [&](double of, double with) {
    return stepper.temperatures(of).cwiseProduct(weight(with)).sum();
  };
  // Heating with one alpha and measuring with another is the same either way round.
  EXPECT_NEAR(measured(0.4, 1.5) / measured(1.5, 0.4), 1.0, 1e-11);
  EXPECT_GT(std::abs(measured(0.4, 0.4) / measured(1.5, 1.5) - 1.0), 0.1);
  for (const double alpha : {0.4, 1.5}) {
    EXPECT_NEAR(measured(alpha, alpha) / stepper.outputs(model->output_weights(alpha)).volume, 1.0,
                1e-11);
  }
}

}  // namespace
}  // namespace photocoag
