#include "photocoag/certify/cell_problem.hpp"

#include <algorithm>
#include <cmath>

#include "photocoag/certify/taylor.hpp"
#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/mpc/ocp.hpp"

namespace photocoag {
namespace {

constexpr double kReach = 1e-6;  // of a row over its limit; DenseSolver treats 1e-9 apart

// theta_j over the cell.
std::array<Taylor, kMaxTerms> coefficients_of(const Theta& theta, const Taylor& alpha,
                                              const Taylor& beta) {
  std::array<Taylor, kMaxTerms> value;
  if (theta.kind == ThetaKind::kDeim) {
    const auto left = [&](double fixed, double choroid, double scaled) {
      return exp(Taylor(Interval(-fixed)) - beta * Interval(choroid) - alpha * Interval(scaled));
    };
    for (int j = 0; j < theta.terms; ++j) {
      const AbsorbedFraction& p = theta.points[j];
      value[j] =
          left(p.fixed_front, p.front[1], p.front[0]) - left(p.fixed_back, p.back[1], p.back[0]);
    }
    return value;
  }
  const bool chebyshev = theta.kind == ThetaKind::kChebyshev;
  const auto polynomials = [](const Taylor& x, int count, bool of_chebyshev) {
    std::array<Taylor, kMaxTerms> p;
    for (int j = 0; j < count; ++j) {
      if (j == 0) p[j] = Taylor(Interval(1.0));
      if (j == 1) p[j] = x;
      if (j > 1) {
        p[j] = of_chebyshev ? x * p[j - 1] * Interval(2.0) - p[j - 2] : x * p[j - 1];
      }
    }
    return p;
  };
  const auto scaled = [](const Taylor& v, const ThetaFactor& factor) {
    return (v - Taylor(Interval(factor.center))) * reciprocal(Interval(factor.half_width));
  };
  const int own = theta.terms_of(0);
  const auto a = polynomials(scaled(alpha, theta.factors[0]), own, chebyshev);
  const auto b = polynomials(scaled(beta, theta.factors[1]), theta.terms_of(1), true);
  for (int k = 0; k < theta.terms_of(1); ++k) {
    for (int j = 0; j < own; ++j) value[k * own + j] = a[j] * b[k];
  }
  return value;
}

// `row` times B(alpha, beta).
Taylor response(const StateVector& row, const ReducedModel& model,
                const std::array<Taylor, kMaxTerms>& theta) {
  Taylor sum;
  for (int j = 0; j < model.terms(); ++j) {
    Interval gain(0.0);
    for (int s = 0; s < model.order(); ++s) {
      gain = gain + Interval(row[s]) * Interval(model.B_d(s, j));
    }
    sum = sum + theta[j] * gain;
  }
  return sum;
}

// (I - A)^-T C_peak.
StateVector steady_row(const ReducedModel& model) {
  const Eigen::MatrixXd rest =
      Eigen::MatrixXd::Identity(model.order(), model.order()) - Eigen::MatrixXd(model.A_d);
  return StateVector(solve_transposed(rest, Eigen::VectorXd(model.C_peak)));
}

Taylor place(const BoxRange& range, int axis) {
  Taylor v{Interval(range.middle())};
  // A radius that surely reaches both ends.
  v.coefficient[axis == 0 ? Taylor::index(1, 0) : Taylor::index(0, 1)] =
      Interval(range.radius() * (1.0 + 1e-15));
  return v;
}

std::array<Taylor, kMaxTerms> coefficients_in(const ReducedModel& model, const BoxRange& absorption,
                                              const BoxRange& choroid) {
  const Taylor beta = model.parameters.size() == 1 ? Taylor(Interval(1.0)) : place(choroid, 1);
  return coefficients_of(model.theta, place(absorption, 0), beta);
}

}  // namespace

void CellProblem::condense(const ReducedModel& model, const ControlSettings& settings,
                           long long cycle) {
  const int n = n_;
  const auto theta = coefficients_in(model, box_.absorption, box_.choroid);
  const Varying scale(settings.power_max);
  StateVector row = model.C_peak;  // C A^i
  const Taylor first = response(row, model, theta);
  const Taylor first_inverse = reciprocal(first);
  first_ = (first * Interval(settings.power_max)).varying();
  const Varying inverse = (first_inverse * reciprocal(Interval(settings.power_max))).varying();
  Taylor so_far;
  for (int i = 0; i < n; ++i) {
    const Taylor ratio =
        i == 0 ? Taylor(Interval(1.0)) : response(row, model, theta) * first_inverse;
    so_far = so_far + ratio;
    impulse_[i] = ratio.varying();
    sum_[i] = so_far.varying();
    sum_inverse_[i] = reciprocal(so_far).varying();
    row = (row.transpose() * model.A_d).transpose().eval();
  }
  double weight[kMaxStages];
  for (int k = 0; k < n; ++k) weight[k] = state_weight(settings.state_weight, cycle + k + 1);
  // Weights of w = h_0 u: per square of h_0.
  const Varying square = inverse * inverse;
  const double scale2 = settings.power_max * settings.power_max;
  const Varying r1 = Varying(settings.power_weight * scale2) * square;
  const Varying r2 = Varying(settings.power_change_weight * scale2) * square;
  std::array<std::array<Varying, kMaxStages>, kMaxStages> hessian;
  std::array<Affine, kMaxStages> gradient;
  Varying reference(0.0);
  if (settings.power_weight > 0.0) {
    const Taylor gain = response(steady_row(model), model, theta);
    // In units of w.
    reference = (first * reciprocal(gain)).varying() * Varying(settings.peak_reference);
  }
  for (int j = 0; j < n; ++j) {
    for (int l = 0; l < n; ++l) {
      hessian[j][l] = Varying(0.0);
      for (int k = std::max(j, l); k < n; ++k) {
        if (weight[k] != 0.0) hessian[j][l] = hessian[j][l] + impulse_[k - j] * impulse_[k - l];
      }
      hessian[j][l] = hessian[j][l] * Varying(2.0);
      if (j == l) {
        hessian[j][l] = hessian[j][l] + Varying(2.0) * (r1 + Varying(j + 1 < n ? 2.0 : 1.0) * r2);
      }
      if (std::abs(j - l) == 1) hessian[j][l] = hessian[j][l] - Varying(2.0) * r2;
    }
    // f_k = middle + radius x_k.
    gradient[j] = {};
    for (int k = j; k < n; ++k) {
      if (weight[k] == 0.0) continue;
      const Varying h = impulse_[k - j] * Varying(2.0);
      gradient[j][0] = gradient[j][0] + h * Varying(Interval(box_.free[k].middle()) -
                                                    Interval(settings.peak_reference));
      gradient[j][1 + k] = h * Varying(box_.free[k].radius() * (1.0 + 1e-15));
    }
    gradient[j][0] = gradient[j][0] - Varying(2.0) * r1 * reference;
  }
  if (settings.power_change_weight > 0.0) {
    const Varying pull = Varying(2.0) * r2 * first_ * reciprocal(scale);
    gradient[0][0] = gradient[0][0] - pull * Varying(box_.previous.middle());
    gradient[0][n + 1] = -(pull * Varying(box_.previous.radius() * (1.0 + 1e-15)));
  }
  definite_ = invert(hessian, n, hessian_inverse_);
  double largest = 0.0;
  double largest_inverse = 0.0;
  for (int j = 0; j < n; ++j) {
    double sum = 0.0;
    double sum_inverse = 0.0;
    unconstrained_[j] = {};
    for (int l = 0; l < n; ++l) {
      sum += hessian[j][l].range().magnitude();
      sum_inverse += hessian_inverse_[j][l].range().magnitude();
      unconstrained_[j] =
          combine(unconstrained_[j], Varying(1.0), gradient[l], -hessian_inverse_[j][l]);
    }
    largest = std::max(largest, sum);
    largest_inverse = std::max(largest_inverse, sum_inverse);
    const double limit =
        std::abs(peak_max_) + std::abs(box_.free[j].low) + std::abs(box_.free[j].high);
    definite_ = definite_ && (sum_[j] * first_).range().low > kReach * limit;
  }
  condition_ = largest * largest_inverse;
}

BoxRange reference_powers(const ReducedModel& model, const ControlSettings& settings,
                          const CertifiedBox& box) {
  constexpr int kParts = 16;
  const StateVector row = steady_row(model);
  Interval all(kUnbounded, -kUnbounded);
  const auto part = [](const BoxRange& whole, int i) {
    const double width = (whole.high - whole.low) / kParts;
    return BoxRange{whole.low + width * i,
                    i + 1 == kParts ? whole.high : whole.low + width * (i + 1)};
  };
  for (int i = 0; i < kParts; ++i) {
    for (int j = 0; j < kParts; ++j) {
      const auto theta = coefficients_in(model, part(box.absorption, i), part(box.choroid, j));
      const Interval power = Interval(settings.peak_reference) *
                             reciprocal(response(row, model, theta).varying().range());
      all = hull(all, power);
    }
  }
  return {all.low, all.high};
}

}  // namespace photocoag
