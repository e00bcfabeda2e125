#include "photocoag/rom/uncertain_model.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "photocoag/core/error.hpp"
#include "photocoag/core/wide_vectors.hpp"

namespace photocoag {
namespace {

// Column 0: a value; column 1 + v: its derivative by x_v.
constexpr int kColumns = kMaxQuantities + 1;

// The basis psi_t and its derivatives, on the stack, whatever the sizes.
struct Basis {
  std::array<std::array<double, kColumns>, kMaxPolynomialTerms> row;
  std::array<std::uint32_t, kMaxPolynomialTerms> columns;  // bit c: column c is not 0
};

// sum_t coefficient_it psi_t and its derivatives: residue i, column c at [c][i].
struct Sums {
  alignas(32) std::array<std::array<double, even(kMaxOrder)>, kColumns> of;
};

// T_0 … T_kMaxDegree at x and their derivatives by x.
struct Chebyshev {
  std::array<double, kMaxDegree + 1> value;
  std::array<double, kMaxDegree + 1> slope;

  explicit Chebyshev(double x) noexcept {
    value[0] = 1.0;
    slope[0] = 0.0;
    value[1] = x;
    slope[1] = 1.0;
    for (std::size_t d = 2; d <= kMaxDegree; ++d) {
      value[d] = 2.0 * x * value[d - 1] - value[d - 2];
      slope[d] = 2.0 * value[d - 1] + 2.0 * x * slope[d - 1] - slope[d - 2];
    }
  }
  Chebyshev() noexcept : Chebyshev(0.0) {}
};

// Most terms depend on one or two quantities, so most of their derivatives are 0 and skipped.
PHOTOCOAG_WIDE_VECTORS void add_terms(const double* __restrict coefficients, Eigen::Index order,
                                      std::size_t terms, const Basis& basis, Sums& sums) noexcept {
  for (auto& column : sums.of) column.fill(0.0);
  for (std::size_t t = 0; t < terms; ++t, coefficients += order) {
    for (std::uint32_t left = basis.columns[t]; left != 0; left &= left - 1) {
      const auto c = static_cast<std::size_t>(std::countr_zero(left));
      const double factor = basis.row[t][c];
      double* __restrict sum = sums.of[c].data();
      for (Eigen::Index i = 0; i < order; ++i) sum[i] += coefficients[i] * factor;
    }
  }
}

}  // namespace

void UncertainModel::evaluate(const QuantityVector& log_q, StateVector& peak_residue,
                              ResidueSlopes& peak_slope, StateVector& volume_residue,
                              ResidueSlopes& volume_slope) const noexcept {
  const int m = count();
  std::array<Chebyshev, kMaxQuantities> table;
  std::array<double, kMaxQuantities> scale{};  // dx / d ln q
  double peak_power = 0.0;
  double volume_power = 0.0;
  for (int v = 0; v < m; ++v) {
    const auto q = static_cast<std::size_t>(v);
    const double low = std::log(quantities[q].low);
    const double high = std::log(quantities[q].high);
    const double inside = std::clamp(log_q[v], low, high);
    peak_power += peak_exponents[q] * inside;
    volume_power += volume_exponents[q] * inside;
    if (quantities[q].is_factor()) continue;
    scale[q] = 2.0 / (high - low);
    table[q] = Chebyshev((2.0 * inside - low - high) / (high - low));
  }
  Basis basis;
  basis.row[0].fill(0.0);
  basis.row[0][0] = 1.0;
  basis.columns[0] = 1;
  for (std::size_t t = 1; t <= terms.size(); ++t) {
    const PolynomialTerm& term = terms[t - 1];
    const auto parent = static_cast<std::size_t>(term.parent);
    const auto own = static_cast<std::size_t>(term.quantity) + 1;
    const Chebyshev& of = table[own - 1];
    const auto d = static_cast<std::size_t>(term.degree);
    for (std::size_t c = 0; c < kColumns; ++c) {
      basis.row[t][c] = basis.row[parent][c] * of.value[d];
    }
    basis.row[t][own] += basis.row[parent][0] * of.slope[d];
    basis.columns[t] = basis.columns[parent] | (1U << own);
  }
  const auto residues = [&](const Eigen::MatrixXd& coefficients, double power,
                            const std::vector<double>& exponents, StateVector& residue,
                            ResidueSlopes& slope) {
    const Eigen::Index n = coefficients.rows();
    Sums sums;
    add_terms(coefficients.data(), n, terms.size() + 1, basis, sums);
    const double factor = std::exp(power);
    residue = factor * StateVector::Map(sums.of[0].data(), n);
    slope.resize(n, m);
    for (int v = 0; v < m; ++v) {
      const auto q = static_cast<std::size_t>(v);
      slope.col(v) =
          factor * scale[q] * StateVector::Map(sums.of[q + 1].data(), n) + exponents[q] * residue;
    }
  };
  residues(peak, peak_power, peak_exponents, peak_residue, peak_slope);
  residues(volume, volume_power, volume_exponents, volume_residue, volume_slope);
}

void UncertainModel::step_of(double period_s, StateVector& decay, StateVector& gain) const {
  const int n = order();
  decay.resize(n);
  gain.resize(n);
  for (int i = 0; i < n; ++i) {
    const double rate = rates[static_cast<std::size_t>(i)];
    decay[i] = std::exp(-rate * period_s);
    gain[i] = -std::expm1(-rate * period_s) / rate;
  }
}

QuantityVector UncertainModel::centre_of_box() const {
  QuantityVector centre(count());
  for (int q = 0; q < count(); ++q) {
    const UncertainQuantity& quantity = quantities[static_cast<std::size_t>(q)];
    centre[q] = 0.5 * (std::log(quantity.low) + std::log(quantity.high));
  }
  return centre;
}

ReducedModel UncertainModel::control_model() const {
  const int n = order();
  StateVector decay;
  StateVector gain;
  step_of(period, decay, gain);
  StateVector peak_residue;
  StateVector volume_residue;
  ResidueSlopes slopes;
  ResidueSlopes other;
  evaluate(centre_of_box(), peak_residue, slopes, volume_residue, other);
  ReducedModel model;
  model.A = StateMatrix::Zero(n, n);
  model.A_d = StateMatrix::Zero(n, n);
  for (int i = 0; i < n; ++i) {
    model.A(i, i) = -rates[static_cast<std::size_t>(i)];
    model.A_d(i, i) = decay[i];
  }
  model.C_peak = StateVector::Ones(n);
  model.B = peak_residue;
  model.B_d = peak_residue.cwiseProduct(gain);
  model.C_volume = volume_residue.cwiseQuotient(peak_residue).transpose();
  model.theta.kind = ThetaKind::kTaylor;
  model.theta.terms = 1;
  model.period = period;
  model.tissue = tissue;
  return model;
}

void UncertainModel::validate() const {
  const auto n = static_cast<Eigen::Index>(rates.size());
  const auto columns = static_cast<Eigen::Index>(terms.size()) + 1;
  const bool sizes = n >= 1 && n <= kMaxOrder && columns <= kMaxPolynomialTerms &&
                     peak.rows() == n && volume.rows() == n && peak.cols() == columns &&
                     volume.cols() == columns && !quantities.empty() && count() <= kMaxQuantities &&
                     peak_exponents.size() == quantities.size() &&
                     volume_exponents.size() == quantities.size();
  const bool averages = seen_before.size() == seen_power.size() &&
                        (seen_before.empty() || seen_before.size() == rates.size());
  if (!sizes || !averages) throw Error("an uncertain model whose sizes do not fit together");
  for (std::size_t t = 0; t < terms.size(); ++t) {
    const PolynomialTerm& term = terms[t];
    if (term.parent < 0 || term.parent > static_cast<int>(t) || term.quantity < 0 ||
        term.quantity >= count() || term.degree < 1 || term.degree > kMaxDegree) {
      throw Error("an uncertain model with a term that leads nowhere");
    }
  }
  for (const double rate : rates) {
    if (!(std::isfinite(rate) && rate > 0.0)) throw Error("an uncertain model that does not decay");
  }
  if (!peak.allFinite() || !volume.allFinite() || !(period > 0.0)) {
    throw Error("an uncertain model with numbers that are not finite");
  }
  StateVector decay;
  StateVector gain;
  StateVector peak_residue;
  StateVector volume_residue;
  ResidueSlopes slopes;
  step_of(period, decay, gain);
  evaluate(centre_of_box(), peak_residue, slopes, volume_residue, slopes);
  for (const StateVector& residue : {peak_residue, volume_residue}) {
    double steady = 0.0;
    for (int i = 0; i < order(); ++i) steady += residue[i] / rates[static_cast<std::size_t>(i)];
    if (!(residue.dot(gain) > 0.0 && steady > residue.dot(gain))) {
      throw Error("an uncertain model in which power does not heat");
    }
  }
}

}  // namespace photocoag
