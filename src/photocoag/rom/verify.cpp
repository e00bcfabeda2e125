#include <fmt/format.h>
#include <cmath>

#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/core/types.hpp"
#include "photocoag/rom/discretize.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {
namespace {

/// Nodes that a certificate needs at least: with fewer it does not hold between them.
constexpr std::size_t kLeastNodes = 9;
constexpr double kLargestScale = 1e100;

void demand(bool ok, std::string_view key, std::string_view found, std::string_view accepted) {
  if (ok) return;
  throw Error(ErrorParts{.key = std::string(key),
                         .problem = "the reduced model cannot be trusted",
                         .found = std::string(found),
                         .accepted = std::string(accepted)});
}

void verify_sizes(const ReducedModel& model) {
  const Eigen::Index n = model.A.rows();
  const Eigen::Index m = model.theta.terms;
  const auto size = [](const auto& matrix) {
    return fmt::format("{} x {}", matrix.rows(), matrix.cols());
  };
  const auto is = [](const auto& matrix, Eigen::Index rows, Eigen::Index cols) {
    return matrix.rows() == rows && matrix.cols() == cols;
  };
  demand(n >= 1 && is(model.A, n, n), "A", size(model.A), "a square matrix");
  const std::size_t count = model.parameters.size();
  const bool several = count >= 2 && count <= kMaxParameters &&
                       model.theta.kind != ThetaKind::kTaylor && model.parameters[1].min > 0.0 &&
                       model.parameters[1].max > model.parameters[1].min;
  demand(count == 1 || several, "parameters", fmt::format("{}", count),
         "alpha, or alpha and beta with a range and a theta that depends on both");
  demand(m >= 1, "theta", fmt::format("{} terms", m), "at least one term");
  demand(is(model.B, n, m), "B", size(model.B), fmt::format("{} x {}", n, m));
  demand(is(model.B_d, n, m), "discrete.B", size(model.B_d), fmt::format("{} x {}", n, m));
  demand(is(model.A_d, n, n), "discrete.A", size(model.A_d), fmt::format("{} x {}", n, n));
  demand(is(model.C_volume, m, n), "C_volume", size(model.C_volume), fmt::format("{} x {}", m, n));
  demand(is(model.C_peak, n, 1), "C_peak", size(model.C_peak), fmt::format("{} x 1", n));
  const bool finite = model.A.allFinite() && model.B.allFinite() && model.C_volume.allFinite() &&
                      model.C_peak.allFinite() && model.A_d.allFinite() && model.B_d.allFinite();
  demand(finite, "matrices", "an entry that is not finite", "finite entries");
  // The state's unit is free; a covariance has to hold its square.
  const double scale = model.B_d.norm();
  demand(scale > 1.0 / kLargestScale && scale < kLargestScale, "discrete.B",
         fmt::format("states of some {:.3g} per watt", scale),
         fmt::format("from {:g} to {:g}", 1.0 / kLargestScale, kLargestScale));
}

double largest_real_part(const Eigen::MatrixXd& matrix) {
  return general_eigenvalues(matrix).real().maxCoeff();
}

double spectral_radius(const Eigen::MatrixXd& matrix) {
  return general_eigenvalues(matrix).cwiseAbs().maxCoeff();
}

// What a controller relies on, at one beta.
void verify_signs(const ReducedModel& model, const Eigen::VectorXd& steady_row, double beta) {
  constexpr int kSamples = 29;
  double last_gain = 0.0;
  const std::string at_beta = model.parameters.size() == 1 ? "" : fmt::format(", beta = {}", beta);
  for (int s = 0; s < kSamples; ++s) {
    const double alpha = model.parameters[0].at(s, kSamples);
    ParametricMatrices matrices;
    model.evaluate({alpha, beta}, matrices);
    const double gain = steady_row.dot(matrices.input);
    demand(gain > last_gain, "C_peak",
           fmt::format("steady peak gain {} K/W at alpha = {}{}, {} K/W below it", gain, alpha,
                       at_beta, last_gain),
           "a gain above 0 that grows with alpha (not so if layers in front of the peak layer "
           "are scaled by alpha, or the peak layer lies behind a scaled one)");
    last_gain = gain;
    StateVector state = matrices.input;
    for (int k = 1; k < kMaxHorizon; ++k) {
      const double response = model.C_peak.dot(state);
      demand(response >= 0.0, "C_peak",
             fmt::format("peak impulse response {} K/W at step {}, alpha = {}{}", response, k,
                         alpha, at_beta),
             "not negative: heating never cools");
      state = (model.A_d.lazyProduct(state)).eval();
    }
  }
}

}  // namespace

void verify(const ReducedModel& model) {
  verify_sizes(model);
  if (model.certificate) {
    const std::vector<double>& nodes = model.certificate->absorption_factors;
    model.certificate->validate();
    demand(nodes.size() >= kLeastNodes, "certificate.absorption_factors",
           fmt::format("{} nodes", nodes.size()), fmt::format("at least {}", kLeastNodes));
    const ParameterRange& alpha = model.parameters[0];
    demand(nodes.front() <= alpha.min * (1.0 + 1e-9) && nodes.back() >= alpha.max * (1.0 - 1e-9),
           "certificate.absorption_factors", fmt::format("{} to {}", nodes.front(), nodes.back()),
           fmt::format("the model's range, {} to {}", alpha.min, alpha.max));
  }
  demand(std::isfinite(model.period) && model.period > 0.0, "discrete.period_s",
         fmt::format("{}", model.period), "a time above 0");
  // Implicit Euler turns a fast growth into a decay, so the discrete matrix alone does not tell.
  const double growth = largest_real_part(model.A);
  demand(growth < 0.0, "A", fmt::format("an eigenvalue with real part {} 1/s", growth), "below 0");
  const double radius = spectral_radius(model.A_d);
  demand(radius < 1.0, "discrete.A", fmt::format("spectral radius {}", radius), "below 1");

  // The discrete matrices must be those of the continuous ones. Both sides are computed in double
  // from the same numbers; the exponential's error is some 1e-13 of its norm.
  const DiscretePair pair = discretize(model.A, model.period, model.discretization);
  const Eigen::MatrixXd B_d = pair.input * model.B;
  const bool same_A = (pair.transition - model.A_d).norm() <= 1e-9 * model.A_d.norm();
  const bool same_B = (B_d - model.B_d).norm() <= 1e-9 * model.B_d.norm();
  demand(same_A && same_B, "discrete", "matrices that do not belong to A, B and the period",
         fmt::format("the {} of A and B for {} ms", to_string(model.discretization),
                     model.period * 1e3));

  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(model.order(), model.order());
  const Eigen::VectorXd steady_row =
      solve_transposed(I - Eigen::MatrixXd(model.A_d), Eigen::VectorXd(model.C_peak));
  if (model.parameters.size() == 1) return verify_signs(model, steady_row, 1.0);
  constexpr int kChoroids = 7;
  for (int s = 0; s < kChoroids; ++s) {
    verify_signs(model, steady_row, model.parameters[1].at(s, kChoroids));
  }
}

}  // namespace photocoag
