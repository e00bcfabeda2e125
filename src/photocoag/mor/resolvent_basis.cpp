#include "photocoag/mor/resolvent_basis.hpp"

#include <cmath>
#include <memory>

#include "photocoag/core/linear_algebra.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kShifts = 28;
constexpr double kFirstShift = 1.0;
constexpr double kLastShift = 1e7;
constexpr double kNegligible = 1e-7;
constexpr double kNegligibleSource = 1e-7;

// (shift - A)^-1 for one shift: LDL' in depth of every radial mode.
class Resolvent {
 public:
  Resolvent(const FullOrderModel& model, double shift)
      : model_(model), inverse_pivot_(model.radial().size(), model.axial().size()) {
    const DepthOperator& depth = model.depth_operator();
    for (Index j = 0; j < inverse_pivot_.cols(); ++j) {
      Eigen::ArrayXd pivot =
          model.radial().rates.array() * depth.diffusivity[j] + (depth.diagonal[j] + shift);
      if (j > 0) pivot -= std::pow(depth.off_diagonal[j - 1], 2) * inverse_pivot_.col(j - 1);
      inverse_pivot_.col(j) = pivot.inverse();
    }
  }

  // Of the source beam (x) axial.
  MatrixXd solve(const VectorXd& axial) const {
    const VectorXd& coupling = model_.depth_operator().off_diagonal;
    const Index cells = axial.size();
    MatrixXd x(inverse_pivot_.rows(), cells);
    for (Index j = 0; j < cells; ++j) {
      x.col(j) = model_.beam() * axial[j];
      if (j > 0) x.col(j) -= coupling[j - 1] * x.col(j - 1);
      x.col(j).array() *= inverse_pivot_.col(j);
    }
    for (Index j = cells - 2; j >= 0; --j) {
      x.col(j).array() -= coupling[j] * inverse_pivot_.col(j) * x.col(j + 1).array();
    }
    return x;
  }

 private:
  const FullOrderModel& model_;
  Eigen::ArrayXXd inverse_pivot_;  // radial modes x depth cells
};

// Makes the columns orthonormal and drops those that are negligible beside a length of 1.
MatrixXd orthonormal(const MatrixXd& columns) {
  const SymmetricEigen<double> gram = symmetric_eigen(MatrixXd(columns.transpose() * columns));
  const VectorXd& values = gram.values;
  Index first = 0;
  while (first < values.size() && values[first] < kNegligible * kNegligible) ++first;
  const Index size = values.size() - first;
  const VectorXd scale = values.tail(size).cwiseSqrt().cwiseInverse();
  return columns * (gram.vectors.rightCols(size) * scale.asDiagonal());
}

// -A basis, one depth cell after the other.
MatrixXd minus_operator(const FullOrderModel& model, const MatrixXd& basis) {
  const Index radial = model.radial().size();
  const Index cells = model.axial().size();
  const DepthOperator& depth = model.depth_operator();
  MatrixXd result(basis.rows(), basis.cols());
  for (Index j = 0; j < cells; ++j) {
    auto out = result.middleRows(j * radial, radial).array();
    const auto row = [&](Index k) { return basis.middleRows(k * radial, radial).array(); };
    out = row(j).colwise() *
          (model.radial().rates.array() * depth.diffusivity[j] + depth.diagonal[j]);
    if (j > 0) out += depth.off_diagonal[j - 1] * row(j - 1);
    if (j + 1 < cells) out += depth.off_diagonal[j] * row(j + 1);
  }
  return result;
}

}  // namespace

MatrixXd source_basis(const FullOrderModel& model,
                      const std::vector<AbsorptionFactors>& absorption_factors) {
  MatrixXd sources(model.axial().size(), static_cast<Index>(absorption_factors.size()));
  for (Index a = 0; a < sources.cols(); ++a) {
    sources.col(a) = model.axial_source(absorption_factors[a]);
  }
  const Svd<double> svd = left_svd(sources);
  const VectorXd& values = svd.values;
  Index size = 0;
  while (size < values.size() && values[size] > kNegligibleSource * values[0]) ++size;
  return svd.U.leftCols(size);
}

MatrixXd resolvent_basis(const FullOrderModel& model,
                         const std::vector<AbsorptionFactors>& absorption_factors) {
  // Weak directions of the source keep their small weight: scaled as in the snapshots.
  MatrixXd sources(model.axial().size(), static_cast<Index>(absorption_factors.size()));
  for (Index a = 0; a < sources.cols(); ++a) {
    sources.col(a) = model.axial_source(absorption_factors[a]).normalized();
  }
  const Svd<double> svd = left_svd(sources);
  const Index directions = (svd.values.array() > kNegligible).count();
  const Index states = static_cast<Index>(model.states());

  MatrixXd basis(states, 0);
  for (int s = 0; s < kShifts; ++s) {
    const double shift =
        kFirstShift * std::pow(kLastShift / kFirstShift, double(s) / (kShifts - 1));
    const Resolvent resolvent(model, shift);
    MatrixXd block(states, directions);
    for (Index k = 0; k < directions; ++k) {
      const MatrixXd snapshot = resolvent.solve(svd.U.col(k) * svd.values[k]);
      block.col(k) = snapshot.reshaped();
    }
    block /= block.norm();
    // Twice is enough (Kahan; Parlett, The symmetric eigenvalue problem, section 6.9).
    for (int pass = 0; pass < 2; ++pass) {
      if (basis.cols() > 0) block -= (basis * (basis.transpose() * block)).eval();
      if (pass == 0) block = orthonormal(block);
    }
    // In place: columns are stored one after the other.
    basis.conservativeResize(Eigen::NoChange, basis.cols() + block.cols());
    basis.rightCols(block.cols()) = block;
  }
  return basis;
}

BasisProducts resolvent_products(const FullOrderModel& model,
                                 const std::vector<AbsorptionFactors>& absorption_factors) {
  const auto shared = std::make_shared<const MatrixXd>(resolvent_basis(model, absorption_factors));
  const MatrixXd& basis = *shared;
  const Index radial = model.radial().size();
  const Index axial = model.axial().size();
  MatrixXd source(basis.cols(), axial);
  VectorXd peak(basis.cols());
  for (Index k = 0; k < basis.cols(); ++k) {
    const Eigen::Map<const MatrixXd> vector(basis.col(k).data(), radial, axial);
    source.row(k) = model.beam().transpose() * vector;
    peak[k] = model.peak_radial().dot(vector * model.peak_axial());
  }
  return {basis.transpose() * basis, basis.transpose() * minus_operator(model, basis), source, peak,
          [shared, radial, axial](const VectorXd& c) {
            return MatrixXd((*shared * c).reshaped(radial, axial));
          }};
}

}  // namespace photocoag
