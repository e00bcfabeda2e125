#include "photocoag/mor/impulse_error.hpp"

#include <array>

#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/mor/theta_derivatives.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

constexpr int kDerivatives = 5;  // 0 … 4
constexpr std::array<std::array<double, kDerivatives>, kDerivatives> kBinomial{
    {{1}, {1, 1}, {1, 2, 1}, {1, 3, 3, 1}, {1, 4, 6, 4, 1}}};

template <typename Bound>
DerivativeBounds bound_table(const FactorNodes& nodes, Bound bound) {
  DerivativeBounds table;
  for (int n = 0; n < kDerivatives; ++n) {
    for (int m = 0; m < kDerivatives; ++m) {
      const bool asked = m == 0 || (nodes.two_parameters() && (n == 0 || (n <= 2 && m <= 2)));
      if (asked) table[n][m] = bound(DerivativeOrder{n, m});
    }
  }
  return table;
}

// The (n, m)-th derivative of f g <= sum binomial(n, i) binomial(m, j) |f^(i,j)| |g^(n-i,m-j)|.
VectorXd of_product(const DerivativeBounds& f, const DerivativeBounds& g, int n, int m) {
  VectorXd sum = VectorXd::Zero(f[0][0].size());
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= m; ++j) {
      sum += kBinomial[n][i] * kBinomial[m][j] * f[i][j].cwiseProduct(g[n - i][m - j]);
    }
  }
  return sum;
}

template <typename Order>
FourthBounds fourth_bounds(const FactorNodes& nodes, Order of_order) {
  FourthBounds bounds{of_order(4, 0), {}, {}};
  const bool two = nodes.two_parameters();
  bounds.mixed = two ? of_order(2, 2) : VectorXd::Zero(bounds.alpha.size());
  bounds.beta = two ? of_order(0, 4) : VectorXd::Zero(bounds.alpha.size());
  return bounds;
}

template <typename Matrix, typename At>
FactorDerivatives<Matrix> derivatives(const FactorNodes& nodes, At at) {
  FactorDerivatives<Matrix> d{at({0, 0}), at({1, 0}), at({2, 0}), {}, {}};
  if (nodes.two_parameters()) {
    d.beta = at({0, 1});
    d.beta_beta = at({0, 2});
  }
  return d;
}

// |coefficient| everywhere <= largest at a node + h^2/8 (largest second derivative at a node +
// h^2/8 fourth): linear interpolation twice, in each direction.
VectorXd bound_from_nodes(const OutputExpansion<std::complex<double>>& x,
                          const FactorNodes& nodes) {
  const auto largest = [](const MatrixXcd& m) {
    return VectorXd(m.cwiseAbs().colwise().maxCoeff().transpose());
  };
  const double a = nodes.factor(0);
  const double b = nodes.factor(1);
  VectorXd bound = largest(x.value) + a * (largest(x.second_alpha) + a * x.fourth.alpha);
  if (nodes.two_parameters()) {
    bound += b * (largest(x.second_beta) + b * x.fourth.beta) + 2.0 * a * b * x.fourth.mixed;
  }
  return bound;
}

}  // namespace

FullExpansion::FullExpansion(const FullOrderModel& full, const FactorNodes& nodes)
    : full_(full), nodes_(nodes) {
  const auto& cells = full.cell_absorption();
  const VectorXd& root = full.axial().root_measure;
  const auto count = static_cast<Index>(cells.size());
  source_ = derivatives<MatrixXd>(nodes, [&](DerivativeOrder order) {
    MatrixXd per_cell(count, nodes.size());
    for (Index i = 0; i < nodes.size(); ++i) {
      for (Index c = 0; c < count; ++c) {
        per_cell(c, i) = derivative(cells[c], order, nodes.at(i)) / root[c];
      }
    }
    return per_cell;
  });
  bound_ = bound_table(nodes, [&](DerivativeOrder order) {
    VectorXd bound(count);
    for (Index c = 0; c < count; ++c) {
      bound[c] = derivative_bound(cells[c], order, nodes.range()) / root[c];
    }
    return bound;
  });
  if (full.separable()) return;
  constexpr double kRounding = 1e-15;  // of the largest source
  const std::array all{&source_.value, &source_.alpha, &source_.alpha_alpha, &source_.beta,
                       &source_.beta_beta};
  MatrixXd columns(count, 0);
  for (const MatrixXd* matrix : all) {
    const Index before = columns.cols();
    columns.conservativeResize(Eigen::NoChange, before + matrix->cols());
    columns.rightCols(matrix->cols()) = *matrix;
  }
  basis_ = column_basis(columns, kRounding);
  for (MatrixXd* matrix : all) {
    if (matrix->size() > 0) *matrix = basis_.transpose() * *matrix;
  }
}

ErrorExpansion<double> FullExpansion::over(const MatrixXd& vectors,
                                           const VectorXd& peak_modes) const {
  const FactorNodes& nodes = nodes_;
  const MatrixXd magnitude = vectors.cwiseAbs();
  // Per axial mode, over the whole range.
  const DerivativeBounds largest = bound_table(nodes, [&](DerivativeOrder order) {
    return VectorXd(magnitude.transpose() * bound_[order.alpha][order.beta]);
  });
  const MatrixXd factor =
      basis_.size() == 0 ? MatrixXd(vectors.transpose()) : MatrixXd(vectors.transpose() * basis_);
  const auto projected = [&factor](const MatrixXd& sources) {
    return sources.size() == 0 ? MatrixXd() : MatrixXd(factor * sources);
  };
  const FactorDerivatives<MatrixXd> source{projected(source_.value), projected(source_.alpha),
                                           projected(source_.alpha_alpha), projected(source_.beta),
                                           projected(source_.beta_beta)};  // modes x nodes
  const double gain = full_.input_gain();
  const VectorXd peak = gain * peak_modes;
  const auto transposed = [](const MatrixXd& m) { return MatrixXd(m.transpose()); };
  const auto square_second = [gain](const MatrixXd& value, const MatrixXd& first,
                                    const MatrixXd& second) {
    return MatrixXd((2.0 * gain * (first.cwiseAbs2() + value.cwiseProduct(second))).transpose());
  };
  ErrorExpansion<double> out;
  out.peak.value = transposed(peak.asDiagonal() * source.value);
  out.peak.second_alpha = transposed(peak.asDiagonal() * source.alpha_alpha);
  out.peak.bound = peak.cwiseAbs().cwiseProduct(largest[0][0]);
  out.peak.fourth = fourth_bounds(
      nodes, [&](int n, int m) { return VectorXd(peak.cwiseAbs().cwiseProduct(largest[n][m])); });
  out.volume.value = transposed(gain * source.value.cwiseAbs2());
  out.volume.second_alpha = square_second(source.value, source.alpha, source.alpha_alpha);
  out.volume.bound = gain * largest[0][0].cwiseAbs2();
  out.volume.fourth = fourth_bounds(
      nodes, [&](int n, int m) { return VectorXd(gain * of_product(largest, largest, n, m)); });
  if (nodes.two_parameters()) {
    out.peak.second_beta = transposed(peak.asDiagonal() * source.beta_beta);
    out.volume.second_beta = square_second(source.value, source.beta, source.beta_beta);
  }
  return out;
}

ReducedExpansion expand_reduced(const ReducedModel& reduced, const FactorNodes& nodes) {
  constexpr double kWellConditioned = 1e8;
  const GeneralEigen eigen = general_eigen(reduced.A_d);
  const MatrixXcd& vectors = eigen.vectors;
  const VectorXd singular = square_singular_values(vectors);
  if (!eigen.converged || singular[0] > kWellConditioned * singular[singular.size() - 1]) {
    throw Error("no certificate: the reduced model's eigenvectors are nearly dependent");
  }
  const MatrixXcd B = solve(vectors, MatrixXcd(MatrixXd(reduced.B_d).cast<std::complex<double>>()));
  const MatrixXcd C = (MatrixXd(reduced.C_volume) * vectors).transpose();  // states x terms
  const VectorXcd peak = vectors.transpose() * VectorXd(reduced.C_peak);

  // `factor` times theta: nodes x states.
  const auto at_nodes = [&](const MatrixXcd& factor) {
    return derivatives<MatrixXcd>(nodes, [&](DerivativeOrder order) {
      MatrixXcd result(nodes.size(), factor.rows());
      for (Index i = 0; i < nodes.size(); ++i) {
        result.row(i) = (factor * theta_derivative(reduced.theta, order, nodes.at(i))).transpose();
      }
      return result;
    });
  };
  const auto bounds = [&](const MatrixXcd& factor) {
    return bound_table(nodes, [&](DerivativeOrder order) {
      return VectorXd(factor.cwiseAbs() *
                      theta_derivative_bound(reduced.theta, order, nodes.range()));
    });
  };
  const auto input = at_nodes(B);
  const auto output = at_nodes(C);
  const DerivativeBounds input_bound = bounds(B);
  const DerivativeBounds output_bound = bounds(C);
  const auto product_second = [](const MatrixXcd& f, const MatrixXcd& f1, const MatrixXcd& f2,
                                 const MatrixXcd& g, const MatrixXcd& g1, const MatrixXcd& g2) {
    return MatrixXcd(f2.cwiseProduct(g) + 2.0 * f1.cwiseProduct(g1) + f.cwiseProduct(g2));
  };
  ReducedExpansion out;
  out.decay = eigen.values;
  auto& p = out.outputs.peak;
  auto& v = out.outputs.volume;
  p.value = input.value * peak.asDiagonal();
  p.second_alpha = input.alpha_alpha * peak.asDiagonal();
  p.fourth = fourth_bounds(nodes, [&](int n, int m) {
    return VectorXd(peak.cwiseAbs().cwiseProduct(input_bound[n][m]));
  });
  v.value = input.value.cwiseProduct(output.value);
  v.second_alpha = product_second(input.value, input.alpha, input.alpha_alpha, output.value,
                                  output.alpha, output.alpha_alpha);
  v.fourth = fourth_bounds(
      nodes, [&](int n, int m) { return of_product(input_bound, output_bound, n, m); });
  if (nodes.two_parameters()) {
    p.second_beta = input.beta_beta * peak.asDiagonal();
    v.second_beta = product_second(input.value, input.beta, input.beta_beta, output.value,
                                   output.beta, output.beta_beta);
  }
  p.bound = bound_from_nodes(p, nodes);
  v.bound = bound_from_nodes(v, nodes);
  return out;
}

}  // namespace photocoag
