#include "photocoag/mor/impulse_space.hpp"

#include <cmath>

#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/mor/resolvent_basis.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kSampledTimes = 60;
constexpr double kFirstSampled = 1e-6;
constexpr double kLastSampled = 1.0;
constexpr double kNegligibleEigenvalue = 1e-13;

// e^(-rate t) for every mode (row) and time (column).
MatrixXd decays(const VectorXd& rates, const VectorXd& times) {
  return (-rates * times.transpose()).array().exp().matrix();
}

// The impulse response of one alpha at one time is a tensor product of a radial and an axial
// vector, so the inner product of two of them is the product of two short sums.
class Snapshots {
 public:
  Snapshots(const FullOrderModel& model, const std::vector<AbsorptionFactors>& absorption_factors)
      : times_(kSampledTimes),
        sources_(model.axial().size(), static_cast<Index>(absorption_factors.size())) {
    for (Index i = 0; i < kSampledTimes; ++i) {
      times_[i] =
          kFirstSampled * std::pow(kLastSampled / kFirstSampled, double(i) / (kSampledTimes - 1));
    }
    for (Index a = 0; a < sources_.cols(); ++a) {
      sources_.col(a) = model.axial_source(absorption_factors[a]);
    }
    radial_ = model.beam().asDiagonal() * decays(model.radial().rates, times_);
    axial_ = decays(model.axial().rates, times_);
    weights_.resize(kSampledTimes, sources_.cols());
    const MatrixXd radial_gram = radial_.transpose() * radial_;
    for (Index a = 0; a < sources_.cols(); ++a) {
      const MatrixXd own = sources_.col(a).asDiagonal() * axial_;
      // t^(1/2): equal weight for every decade of time; then equal weight for every alpha.
      const VectorXd energy =
          radial_gram.diagonal().cwiseProduct(own.colwise().squaredNorm().transpose());
      weights_.col(a) = times_.cwiseSqrt();
      weights_.col(a) /= std::sqrt(weights_.col(a).cwiseAbs2().dot(energy));
    }
  }

  Index count() const { return kSampledTimes * sources_.cols(); }

  MatrixXd gram() const {
    const MatrixXd radial_gram = radial_.transpose() * radial_;
    MatrixXd all(count(), count());
    for (Index a = 0; a < sources_.cols(); ++a) {
      for (Index b = 0; b <= a; ++b) {
        const VectorXd product = sources_.col(a).cwiseProduct(sources_.col(b));
        const MatrixXd block =
            weights_.col(a).asDiagonal() *
            radial_gram.cwiseProduct(axial_.transpose() * product.asDiagonal() * axial_) *
            weights_.col(b).asDiagonal();
        all.block(a * kSampledTimes, b * kSampledTimes, kSampledTimes, kSampledTimes) = block;
        all.block(b * kSampledTimes, a * kSampledTimes, kSampledTimes, kSampledTimes) =
            block.transpose();
      }
    }
    return all;
  }

  // Coefficients -> what multiplies the radial parts: times x axial modes.
  MatrixXd axial_factor(const VectorXd& coefficients) const {
    MatrixXd factor = MatrixXd::Zero(kSampledTimes, axial_.rows());
    for (Index a = 0; a < sources_.cols(); ++a) {
      const VectorXd c =
          coefficients.segment(a * kSampledTimes, kSampledTimes).cwiseProduct(weights_.col(a));
      factor += c * sources_.col(a).transpose();
    }
    return factor.cwiseProduct(axial_.transpose());
  }

  // The same for many combinations (columns) and one axial mode: times x combinations.
  MatrixXd axial_factor(const MatrixXd& coefficients, Index mode) const {
    MatrixXd factor = MatrixXd::Zero(kSampledTimes, coefficients.cols());
    for (Index a = 0; a < sources_.cols(); ++a) {
      factor += (weights_.col(a) * sources_(mode, a)).asDiagonal() *
                coefficients.middleRows(a * kSampledTimes, kSampledTimes);
    }
    return axial_.row(mode).transpose().asDiagonal() * factor;
  }

  const MatrixXd& radial() const { return radial_; }

 private:
  VectorXd times_;
  MatrixXd sources_;  // axial modes x alphas
  MatrixXd radial_;   // radial modes x times, beam included
  MatrixXd axial_;    // axial modes x times
  MatrixXd weights_;  // times x alphas
};

}  // namespace

ImpulseSpace diagonalised(const BasisProducts& basis) {
  // Orthonormal by the Cholesky factor of the basis' own Gram matrix (never applied to the long
  // vectors).
  const std::optional<MatrixXd> lower = cholesky(basis.gram);
  if (!lower) throw Error("the snapshot basis is singular");
  const MatrixXd half = solve_lower(*lower, basis.rates);
  const MatrixXd projected = solve_lower(*lower, MatrixXd(half.transpose()));
  const SymmetricEigen<double> diagonal =
      symmetric_eigen(MatrixXd(0.5 * (projected + projected.transpose())));
  const MatrixXd rotation = diagonal.vectors.transpose();
  const MatrixXd orthonormal = solve_lower_transposed(*lower, diagonal.vectors);
  return {diagonal.values, rotation * solve_lower(*lower, basis.source),
          rotation * solve_lower(*lower, basis.peak),
          [combine = basis.combine, orthonormal](const VectorXd& state) {
            return combine(orthonormal * state);
          }};
}

ImpulseSpace impulse_space(const FullOrderModel& model,
                           const std::vector<AbsorptionFactors>& absorption_factors) {
  if (!model.separable()) return diagonalised(resolvent_products(model, absorption_factors));
  const Snapshots snapshots(model, absorption_factors);
  const SymmetricEigen<double> gram = symmetric_eigen(snapshots.gram());
  const VectorXd& values = gram.values;
  const Index total = values.size();
  Index size = 0;
  while (size < total && values[total - 1 - size] > kNegligibleEigenvalue * values[total - 1])
    ++size;
  if (size == 0) throw Error("the impulse responses span nothing: is the absorption zero?");

  MatrixXd coefficients(total, size);
  for (Index k = 0; k < size; ++k) {
    coefficients.col(k) = gram.vectors.col(total - 1 - k) / std::sqrt(values[total - 1 - k]);
  }
  // All radial parts lie in the span of the columns of Q, radial = Q R: in its coordinates a column
  // of the basis is a short matrix for each axial mode, and the basis is used up mode by mode.
  const auto [Q, R] = qr(snapshots.radial());
  const MatrixXd radial_rates = Q.transpose() * model.radial().rates.asDiagonal() * Q;
  const VectorXd beam = Q.transpose() * model.beam();
  const VectorXd peak_radial = Q.transpose() * model.peak_radial();
  MatrixXd own_gram = MatrixXd::Zero(size, size);
  MatrixXd rate_matrix = MatrixXd::Zero(size, size);
  MatrixXd source(size, model.axial().size());
  VectorXd peak = VectorXd::Zero(size);
  for (Index j = 0; j < model.axial().size(); ++j) {
    const MatrixXd part = R * snapshots.axial_factor(coefficients, j);
    const MatrixXd heat_flow = radial_rates * part + model.axial().rates[j] * part;
    own_gram.noalias() += part.transpose() * part;
    rate_matrix.noalias() += part.transpose() * heat_flow;
    source.col(j) = part.transpose() * beam;
    peak += model.peak_axial()[j] * (part.transpose() * peak_radial);
  }
  // The Gram matrix squares the condition number, so the basis is orthonormal only approximately.
  return diagonalised(
      {own_gram, rate_matrix, source, peak, [snapshots, coefficients](const VectorXd& c) {
         return MatrixXd(snapshots.radial() * snapshots.axial_factor(coefficients * c));
       }});
}

}  // namespace photocoag
