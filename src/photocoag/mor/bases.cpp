#include "photocoag/mor/bases.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/mor/pod.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
// The Gramians' eigenvalues fall below double precision within the orders in use.
using Real = long double;

// None of these is among the alphas on which the error is measured.
constexpr std::array kSampledAlphas{0.29, 0.47, 0.83, 1.29, 1.72};

// Inputs of the sampled alphas, each divided by its peak steady gain, so that errors are relative
// to the output.
MatrixXd sampled_inputs(const FullOrderModel& full, const ImpulseSpace& space,
                        const std::vector<double>& betas) {
  const auto sampled = tensor({kSampledAlphas.begin(), kSampledAlphas.end()}, betas);
  MatrixXd inputs(space.size(), static_cast<Index>(sampled.size()));
  for (Index a = 0; a < inputs.cols(); ++a) {
    const VectorXd input = space.axial_source * full.axial_source(sampled[a]);
    inputs.col(a) = input / space.peak.dot(input.cwiseQuotient(space.rates));
  }
  return inputs;
}

// Power switches between constant values: inputs are white noise through w / (s + w), 1/s. Without
// it the Gramians are dominated by the first microseconds. Chosen for the smallest worst
// certificate at order 6 and 10 on the paper's tissue.
constexpr Real kInputBandwidthOneSided = 300.0L;
constexpr Real kInputBandwidthTwoSided = 100.0L;
constexpr Real kWhiteNoise = 0.0L;  // unfiltered

// Z with Z Z' = P, the controllability Gramian of A = -diag(rates) and F:
//   white noise   A P + P A' + F F' = 0:  P_ij = (F F')_ij / (l_i + l_j)
//   filtered      P_ij = (F F')_ij w (l_i + l_j + 2 w) / ((l_i + l_j) (l_i + w) (l_j + w))
// (the state block of the Gramian with the filter's state added). Columns with the largest share
// first.
LongMatrix gramian_factor(const VectorXd& rates, const MatrixXd& inputs, Real bandwidth) {
  const LongMatrix F = inputs.cast<Real>();
  LongMatrix gramian = F * F.transpose();
  for (Index i = 0; i < gramian.rows(); ++i) {
    for (Index j = 0; j < gramian.cols(); ++j) {
      const Real li = rates[i];
      const Real lj = rates[j];
      gramian(i, j) /= li + lj;
      if (bandwidth > 0.0L) {
        gramian(i, j) *=
            bandwidth * (li + lj + 2.0L * bandwidth) / ((li + bandwidth) * (lj + bandwidth));
      }
    }
  }
  const SymmetricEigen<Real> eigen = symmetric_eigen(gramian);
  const LongVector roots = eigen.values.cwiseMax(Real(0)).cwiseSqrt();
  return (eigen.vectors * roots.asDiagonal()).rowwise().reverse();
}

// Projection of A on span(V): Ritz values, ascending.
VectorXd ritz_values(const VectorXd& rates, const MatrixXd& basis) {
  const MatrixXd projected = basis.transpose() * rates.asDiagonal() * basis;
  return symmetric_eigenvalues(0.5 * (projected + projected.transpose()));
}

// IRKA for the symmetric model (A, b, b'): V = span{(s_i I - A)^-1 b}, then s_i <- Ritz values.
MatrixXd irka_space(const VectorXd& rates, const VectorXd& input, int order) {
  constexpr int kMaxIterations = 200;
  constexpr double kConverged = 1e-8;
  const std::vector<double> start = log_spaced(2.0, 2e5, std::max(order, 2));
  VectorXd shifts = Eigen::Map<const VectorXd>(start.data(), order);
  MatrixXd basis;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    MatrixXd columns(rates.size(), order);
    for (Index i = 0; i < order; ++i) {
      columns.col(i) = input.array() / (shifts[i] + rates.array());
      columns.col(i).normalize();
    }
    basis = qr(columns).Q;
    const VectorXd next = ritz_values(rates, basis);
    const double change = ((next - shifts).cwiseAbs().cwiseQuotient(next)).maxCoeff();
    shifts = next;
    if (change < kConverged) break;
  }
  return basis;
}

}  // namespace

MatrixXd controllability_basis(const FullOrderModel& full, const ImpulseSpace& space, int order,
                               const std::vector<double>& betas) {
  const LongMatrix factor =
      gramian_factor(space.rates, sampled_inputs(full, space, betas), kInputBandwidthOneSided);
  // Columns are orthogonal already; normalised they are the Gramian's leading eigenvectors.
  return factor.leftCols(order).colwise().normalized().cast<double>();
}

Bases balanced_bases(const FullOrderModel& full, const ImpulseSpace& space, int order,
                     const std::vector<double>& betas) {
  const MatrixXd inputs = sampled_inputs(full, space, betas);
  // Outputs: the peak, and the volume temperature of every sampled alpha. An error of the peak
  // relative to its gain counts as much as all volume outputs together.
  MatrixXd outputs(space.size(), inputs.cols() + 1);
  for (Index a = 0; a < inputs.cols(); ++a) {
    const VectorXd input = inputs.col(a);
    const double gain = input.dot(input.cwiseQuotient(space.rates));
    outputs.col(a) = input / (gain * std::sqrt(static_cast<double>(inputs.cols())));
  }
  outputs.rightCols(1) = space.peak;
  // The observability Gramian stays unfiltered: its Lyapunov equation is what makes the truncated
  // model stable (Enns 1984).
  const LongMatrix controllable = gramian_factor(space.rates, inputs, kInputBandwidthTwoSided);
  const LongMatrix observable = gramian_factor(space.rates, outputs, kWhiteNoise);
  // Square-root method: Z_Q' Z_P = U S X'; test = Z_Q U S^(-1/2), trial = Z_P X S^(-1/2).
  const Svd<Real> hankel = square_svd(observable.transpose() * controllable);
  const LongVector scale = hankel.values.head(order).cwiseSqrt().cwiseInverse();
  if (!scale.allFinite()) throw Error("balanced truncation: fewer states than the order");
  const LongMatrix trial = controllable * hankel.V.leftCols(order) * scale.asDiagonal();
  const LongMatrix test = observable * hankel.U.leftCols(order) * scale.asDiagonal();
  return {trial.cast<double>(), test.cast<double>(), false};
}

MatrixXd irka_basis(const FullOrderModel& full, const ImpulseSpace& space, int order,
                    const std::vector<double>& betas) {
  const MatrixXd inputs = sampled_inputs(full, space, betas);
  MatrixXd all(space.size(), order * inputs.cols());
  for (Index a = 0; a < inputs.cols(); ++a) {
    const MatrixXd basis = irka_space(space.rates, inputs.col(a), order);
    // Weighted by the projected controllability Gramian's factor, so that the compression keeps the
    // directions that are reached, not those that every space happens to contain.
    const MatrixXd projected = basis.transpose() * space.rates.asDiagonal() * basis;
    const SymmetricEigen<double> modes =
        symmetric_eigen(MatrixXd(0.5 * (projected + projected.transpose())));
    const MatrixXd rotated = basis * modes.vectors;
    const LongMatrix factor =
        gramian_factor(modes.values, rotated.transpose() * inputs.col(a), kInputBandwidthOneSided);
    all.middleCols(a * order, order) = rotated * factor.cast<double>();
  }
  return leading_directions(all, order);
}

MatrixXd taylor_basis(const ImpulseSpace& space, const ParametricSource& source, int order) {
  constexpr double kFarthest = 1.7 - kTaylorCenter;
  std::vector<MatrixXd> blocks;
  double first_norm = 0.0;
  for (Index j = 0; j < source.sources.cols(); ++j) {
    const VectorXd input =
        space.axial_source * source.sources.col(j) * std::pow(kFarthest, double(j));
    if (j == 0) first_norm = input.norm();
    if (input.norm() <= 1e-14 * first_norm) continue;
    blocks.push_back(weighted_impulse_response(space, input, input.norm() / first_norm));
  }
  MatrixXd all(space.size(), static_cast<Index>(blocks.size()) * blocks.front().cols());
  for (std::size_t j = 0; j < blocks.size(); ++j) {
    all.middleCols(static_cast<Index>(j) * blocks[j].cols(), blocks[j].cols()) = blocks[j];
  }
  return leading_directions(all, order);
}

Bases make_bases(const FullOrderModel& full, const ImpulseSpace& space, ReductionMethod method,
                 int order, const ParametricSource& source, const std::vector<double>& betas) {
  const auto galerkin = [](MatrixXd basis) { return Bases{basis, basis, true}; };
  switch (method) {
    case ReductionMethod::kBalanced:
      return galerkin(controllability_basis(full, space, order, betas));
    case ReductionMethod::kBalancedTwoSided:
      return balanced_bases(full, space, order, betas);
    case ReductionMethod::kIrka:
      return galerkin(irka_basis(full, space, order, betas));
    case ReductionMethod::kTaylor:
      return galerkin(taylor_basis(space, source, order));
    case ReductionMethod::kPodDeim:
      break;
  }
  return galerkin(pod_basis(full, space, order, betas));
}

}  // namespace photocoag
