#include "photocoag/mor/impulse_error.hpp"

#include <array>

#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/mor/theta_derivatives.hpp"
#include "photocoag/tissue/absorption_derivatives.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

constexpr int kDerivatives = 5;  // 0 … 4
constexpr std::array<double, 5> kBinomial4{1.0, 4.0, 6.0, 4.0, 1.0};

// (f g)'''' <= sum_n binomial(4, n) |f^(n)| |g^(4-n)|, per entry.
VectorXd fourth_of_product(const std::array<VectorXd, kDerivatives>& f,
                           const std::array<VectorXd, kDerivatives>& g) {
  VectorXd sum = VectorXd::Zero(f[0].size());
  for (int n = 0; n < kDerivatives; ++n) {
    sum += kBinomial4[n] * f[n].cwiseProduct(g[kDerivatives - 1 - n]);
  }
  return sum;
}

// |coefficient| everywhere <= largest at a node + h^2/8 (largest second derivative at a node +
// h^2/8 fourth): linear interpolation twice.
VectorXd bound_from_nodes(const MatrixXcd& value, const MatrixXcd& second, const VectorXd& fourth,
                          double spacing) {
  const double h = spacing * spacing / 8.0;
  return value.cwiseAbs().colwise().maxCoeff().transpose() +
         h * (second.cwiseAbs().colwise().maxCoeff().transpose() + h * fourth);
}

void expand_full(const FullOrderModel& full, const VectorXd& nodes, ErrorExpansion& out) {
  const auto& cells = full.cell_absorption();
  const auto count = static_cast<Index>(cells.size());
  const double low = nodes[0];
  const double high = nodes[nodes.size() - 1];
  const Modes& axial = full.axial();
  std::array<MatrixXd, 3> source;              // axial modes x nodes, derivatives 0, 1, 2
  std::array<VectorXd, kDerivatives> largest;  // per axial mode, over the whole range
  for (int n = 0; n < kDerivatives; ++n) {
    VectorXd bound(count);
    for (Index c = 0; c < count; ++c) {
      bound[c] = derivative_bound(cells[c], n, low, high) / axial.root_measure[c];
    }
    largest[n] = axial.vectors.cwiseAbs().transpose() * bound;
    if (n > 2) continue;
    MatrixXd per_cell(count, nodes.size());
    for (Index i = 0; i < nodes.size(); ++i) {
      for (Index c = 0; c < count; ++c) {
        per_cell(c, i) = derivative(cells[c], n, nodes[i]) / axial.root_measure[c];
      }
    }
    source[n] = axial.vectors.transpose() * per_cell;
  }
  const double gain = full.input_gain();
  const VectorXd peak = gain * full.peak_axial();
  const auto transposed = [](const MatrixXd& m) { return MatrixXd(m.transpose()); };
  out.peak.weight = transposed(peak.asDiagonal() * source[0]);
  out.peak.weight_second = transposed(peak.asDiagonal() * source[2]);
  out.peak.weight_bound = peak.cwiseAbs().cwiseProduct(largest[0]);
  out.peak.weight_fourth = peak.cwiseAbs().cwiseProduct(largest[4]);
  out.volume.weight = transposed(gain * source[0].cwiseAbs2());
  out.volume.weight_second =
      transposed(2.0 * gain * (source[1].cwiseAbs2() + source[0].cwiseProduct(source[2])));
  out.volume.weight_bound = gain * largest[0].cwiseAbs2();
  out.volume.weight_fourth = gain * fourth_of_product(largest, largest);
}

void expand_reduced(const ReducedModel& reduced, const VectorXd& nodes, ErrorExpansion& out) {
  constexpr double kWellConditioned = 1e8;
  const GeneralEigen eigen = general_eigen(reduced.A_d);
  const MatrixXcd& vectors = eigen.vectors;
  const VectorXd singular = square_singular_values(vectors);
  if (!eigen.converged || singular[0] > kWellConditioned * singular[singular.size() - 1]) {
    throw Error("no certificate: the reduced model's eigenvectors are nearly dependent");
  }
  out.decay = eigen.values;
  const MatrixXcd B = solve(vectors, MatrixXcd(MatrixXd(reduced.B_d).cast<std::complex<double>>()));
  const MatrixXcd C = (MatrixXd(reduced.C_volume) * vectors).transpose();  // states x terms
  const VectorXcd peak = vectors.transpose() * VectorXd(reduced.C_peak);
  const Index states = B.rows();
  const double low = nodes[0];
  const double high = nodes[nodes.size() - 1];

  std::array<MatrixXcd, 3> input;  // nodes x states, derivatives 0, 1, 2
  std::array<MatrixXcd, 3> output;
  std::array<VectorXd, kDerivatives> input_bound;
  std::array<VectorXd, kDerivatives> output_bound;
  for (int n = 0; n < kDerivatives; ++n) {
    const VectorXd bound = theta_derivative_bound(reduced.theta, n, low, high);
    input_bound[n] = B.cwiseAbs() * bound;
    output_bound[n] = C.cwiseAbs() * bound;
    if (n > 2) continue;
    input[n].resize(nodes.size(), states);
    output[n].resize(nodes.size(), states);
    for (Index i = 0; i < nodes.size(); ++i) {
      const VectorXd theta = theta_derivative(reduced.theta, n, nodes[i]);
      input[n].row(i) = (B * theta).transpose();
      output[n].row(i) = (C * theta).transpose();
    }
  }
  const double spacing = nodes[1] - nodes[0];
  OutputExpansion& p = out.peak;
  p.coefficient = input[0] * peak.asDiagonal();
  p.coefficient_second = input[2] * peak.asDiagonal();
  p.coefficient_fourth = peak.cwiseAbs().cwiseProduct(input_bound[4]);
  p.coefficient_bound =
      bound_from_nodes(p.coefficient, p.coefficient_second, p.coefficient_fourth, spacing);
  OutputExpansion& v = out.volume;
  v.coefficient = input[0].cwiseProduct(output[0]);
  v.coefficient_second = input[2].cwiseProduct(output[0]) + 2.0 * input[1].cwiseProduct(output[1]) +
                         input[0].cwiseProduct(output[2]);
  v.coefficient_fourth = fourth_of_product(input_bound, output_bound);
  v.coefficient_bound =
      bound_from_nodes(v.coefficient, v.coefficient_second, v.coefficient_fourth, spacing);
}

}  // namespace

ErrorExpansion expand_error(const ReducedModel& reduced, const FullOrderModel& full,
                            const VectorXd& nodes) {
  ErrorExpansion expansion;
  expand_full(full, nodes, expansion);
  expand_reduced(reduced, nodes, expansion);
  return expansion;
}

}  // namespace photocoag
