#include "photocoag/mor/impulse_space.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

#include "photocoag/core/error.hpp"
#include "photocoag/mor/resolvent_basis.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kTimes = 60;
constexpr double kFirstTime = 1e-6;
constexpr double kLastTime = 1.0;
constexpr double kNegligibleEigenvalue = 1e-13;

// e^(-rate t) for every mode (row) and time (column).
MatrixXd decays(const VectorXd& rates, const VectorXd& times) {
  return (-rates * times.transpose()).array().exp().matrix();
}

// The impulse response of one alpha at one time is a tensor product of a radial and an axial
// vector, so the inner product of two of them is the product of two short sums.
class Snapshots {
 public:
  Snapshots(const FullOrderModel& model, const std::vector<double>& absorption_factors)
      : times_(kTimes),
        sources_(model.axial().size(), static_cast<Index>(absorption_factors.size())) {
    for (Index i = 0; i < kTimes; ++i) {
      times_[i] = kFirstTime * std::pow(kLastTime / kFirstTime, double(i) / (kTimes - 1));
    }
    for (Index a = 0; a < sources_.cols(); ++a) {
      sources_.col(a) = model.axial_source(absorption_factors[a]);
    }
    radial_ = model.beam().asDiagonal() * decays(model.radial().rates, times_);
    axial_ = decays(model.axial().rates, times_);
    weights_.resize(kTimes, sources_.cols());
    const MatrixXd radial_gram = radial_.transpose() * radial_;
    for (Index a = 0; a < sources_.cols(); ++a) {
      const MatrixXd own = sources_.col(a).asDiagonal() * axial_;
      // t^(1/2): equal attention to every decade of time; then every alpha counts the same.
      const VectorXd energy =
          radial_gram.diagonal().cwiseProduct(own.colwise().squaredNorm().transpose());
      weights_.col(a) = times_.cwiseSqrt();
      weights_.col(a) /= std::sqrt(weights_.col(a).cwiseAbs2().dot(energy));
    }
  }

  Index count() const { return kTimes * sources_.cols(); }

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
        all.block(a * kTimes, b * kTimes, kTimes, kTimes) = block;
        all.block(b * kTimes, a * kTimes, kTimes, kTimes) = block.transpose();
      }
    }
    return all;
  }

  // Linear combination of the snapshots as a radial x axial matrix.
  MatrixXd combine(const VectorXd& coefficients) const {
    MatrixXd axial_part = MatrixXd::Zero(kTimes, axial_.rows());
    for (Index a = 0; a < sources_.cols(); ++a) {
      const VectorXd c = coefficients.segment(a * kTimes, kTimes).cwiseProduct(weights_.col(a));
      axial_part += c * sources_.col(a).transpose();
    }
    return radial_ * axial_part.cwiseProduct(axial_.transpose());
  }

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
  const Eigen::LLT<MatrixXd> factor(basis.gram);
  if (factor.info() != Eigen::Success) throw Error("the snapshot basis is singular");
  const auto lower = factor.matrixL();
  const MatrixXd half = lower.solve(basis.rates);
  const MatrixXd projected = lower.solve(half.transpose());
  const Eigen::SelfAdjointEigenSolver<MatrixXd> diagonal(0.5 * (projected + projected.transpose()));
  const MatrixXd rotation = diagonal.eigenvectors().transpose();
  return {diagonal.eigenvalues(), rotation * lower.solve(basis.source),
          rotation * lower.solve(basis.peak)};
}

ImpulseSpace impulse_space(const FullOrderModel& model,
                           const std::vector<double>& absorption_factors) {
  if (!model.separable()) return diagonalised(resolvent_products(model, absorption_factors));
  const Snapshots snapshots(model, absorption_factors);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> gram(snapshots.gram());
  const VectorXd& values = gram.eigenvalues();
  const Index total = values.size();
  Index size = 0;
  while (size < total && values[total - 1 - size] > kNegligibleEigenvalue * values[total - 1])
    ++size;
  if (size == 0) throw Error("the impulse responses span nothing: is the absorption zero?");

  const Index radial = model.radial().size();
  const Index axial = model.axial().size();
  MatrixXd basis(radial * axial, size);
  for (Index k = 0; k < size; ++k) {
    const VectorXd c = gram.eigenvectors().col(total - 1 - k) / std::sqrt(values[total - 1 - k]);
    Eigen::Map<MatrixXd>(basis.col(k).data(), radial, axial) = snapshots.combine(c);
  }
  // The Gram matrix squares the condition number, so the basis is orthonormal only roughly.
  MatrixXd scaled = basis;
  for (Index j = 0; j < axial; ++j) {
    scaled.middleRows(j * radial, radial).array().colwise() *=
        (model.radial().rates.array() + model.axial().rates[j]);
  }
  MatrixXd source(size, axial);
  VectorXd peak(size);
  for (Index k = 0; k < size; ++k) {
    const Eigen::Map<const MatrixXd> vector(basis.col(k).data(), radial, axial);
    source.row(k) = model.beam().transpose() * vector;
    peak[k] = model.peak_radial().dot(vector * model.peak_axial());
  }
  return diagonalised({basis.transpose() * basis, basis.transpose() * scaled, source, peak});
}

}  // namespace photocoag
