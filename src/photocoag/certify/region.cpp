#include "photocoag/certify/region.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "photocoag/core/types.hpp"

namespace photocoag {
namespace {

constexpr double kOptimal = 1e-12;   // of normalized inequalities
constexpr double kPivot = 1e-10;     // least entry to divide by
constexpr double kRounding = 1e-13;  // of a sum of some 20 terms, with a hundredfold reserve
constexpr int kMostPivots = 300;
constexpr int kFactorizeEvery = 20;

}  // namespace

void Region::add(const Inequality& inequality) {
  double norm = std::abs(inequality.offset);
  for (int j = 0; j < dimensions_; ++j) norm = std::max(norm, std::abs(inequality.slope[j]));
  if (!(norm > 0.0 && norm < kInfinity)) return;
  Inequality row = inequality;
  for (double& entry : row.slope) entry /= norm;
  row.offset = row.offset / norm + 1e-14;  // more than the divisions round
  rows_.push_back(row);
}

// max s: a_i x + b_i >= s, |x_j| <= 1. Its dual: min b'y + sum (v + w), sum y = 1,
// A'y - v + w = 0, all of them not negative.
Region::Vector Region::column(int index) const noexcept {
  Vector c{};
  if (index < 2 * dimensions_) {
    c[index / 2] = index % 2 == 0 ? -1.0 : 1.0;
    return c;
  }
  const Inequality& row = rows_[static_cast<std::size_t>(index - 2 * dimensions_)];
  for (int j = 0; j < dimensions_; ++j) c[j] = row.slope[j];
  c[dimensions_] = 1.0;
  return c;
}

double Region::cost(int index) const noexcept {
  return index < 2 * dimensions_ ? 1.0
                                 : rows_[static_cast<std::size_t>(index - 2 * dimensions_)].offset;
}

// One row, and the sides of the box that balance it.
bool Region::start() {
  if (rows_.empty()) return false;
  const int first = static_cast<int>(rows_.size()) - 1;
  basis_[dimensions_] = 2 * dimensions_ + first;
  for (int j = 0; j < dimensions_; ++j) {
    basis_[j] = 2 * j + (rows_.back().slope[j] >= 0.0 ? 0 : 1);
  }
  return factorize();
}

// Gauss-Jordan with pivoting.
bool Region::factorize() noexcept {
  const int n = dimensions_ + 1;
  std::array<Vector, kMaxBasis> b{};
  for (int k = 0; k < n; ++k) {
    const Vector c = column(basis_[k]);
    for (int i = 0; i < n; ++i) b[i][k] = c[i];
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) inverse_[i][j] = i == j ? 1.0 : 0.0;
  }
  for (int k = 0; k < n; ++k) {
    int best = k;
    for (int i = k + 1; i < n; ++i) {
      if (std::abs(b[i][k]) > std::abs(b[best][k])) best = i;
    }
    if (!(std::abs(b[best][k]) > 1e-13)) return false;
    std::swap(b[k], b[best]);
    std::swap(inverse_[k], inverse_[best]);
    const double factor = 1.0 / b[k][k];
    for (int j = 0; j < n; ++j) {
      b[k][j] *= factor;
      inverse_[k][j] *= factor;
    }
    for (int i = 0; i < n; ++i) {
      const double f = b[i][k];
      if (i == k || f == 0.0) continue;
      for (int j = 0; j < n; ++j) {
        b[i][j] -= f * b[k][j];
        inverse_[i][j] -= f * inverse_[k][j];
      }
    }
  }
  for (int k = 0; k < n; ++k) weight_[k] = inverse_[k][dimensions_];  // right-hand side (0, …, 1)
  return true;
}

// The point and s of the basis; the least a_i x + b_i, or what is left to a side of the box. The
// column that prices lowest enters.
double Region::lowest_slack(int& entering) noexcept {
  Vector price{};
  for (int k = 0; k <= dimensions_; ++k) {
    for (int j = 0; j <= dimensions_; ++j) price[j] += cost(basis_[k]) * inverse_[k][j];
  }
  for (int j = 0; j < dimensions_; ++j) point_[j] = -price[j];
  slack_ = price[dimensions_];
  double least = kInfinity;
  double lowest = -kOptimal;
  entering = -1;
  const auto look = [&](int index, double slack, double reduced) {
    least = std::min(least, slack);
    if (reduced < lowest) {
      lowest = reduced;
      entering = index;
    }
  };
  for (int j = 0; j < dimensions_; ++j) {
    look(2 * j, 1.0 - point_[j], 1.0 - point_[j]);
    look(2 * j + 1, 1.0 + point_[j], 1.0 + point_[j]);
  }
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    double value = rows_[i].offset;
    for (int j = 0; j < dimensions_; ++j) value += rows_[i].slope[j] * point_[j];
    look(2 * dimensions_ + static_cast<int>(i), value, value - slack_);
  }
  return least;
}

bool Region::pivot(int entering) noexcept {
  const int n = dimensions_ + 1;
  const Vector c = column(entering);
  Vector change{};
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) change[k] += inverse_[k][j] * c[j];
  }
  int leaving = -1;
  double step = kInfinity;
  for (int k = 0; k < n; ++k) {
    if (!(change[k] > kPivot)) continue;
    const double ratio = std::max(weight_[k], 0.0) / change[k];
    if (ratio < step || (ratio == step && change[k] > change[leaving])) {
      step = ratio;
      leaving = k;
    }
  }
  if (leaving < 0) return false;
  basis_[leaving] = entering;
  const double factor = 1.0 / change[leaving];
  for (int j = 0; j < n; ++j) inverse_[leaving][j] *= factor;
  for (int k = 0; k < n; ++k) {
    if (k == leaving || change[k] == 0.0) continue;
    for (int j = 0; j < n; ++j) inverse_[k][j] -= change[k] * inverse_[leaving][j];
  }
  for (int k = 0; k < n; ++k) weight_[k] = inverse_[k][dimensions_];
  return true;
}

// sup over the box of sum y (slope' x + offset): below 0?
bool Region::proves_empty() const noexcept {
  std::array<double, kMaxDimensions> sum{};
  double highest = 0.0;
  double terms = 0.0;
  for (int k = 0; k <= dimensions_; ++k) {
    const double y = weight_[k];
    if (basis_[k] < 2 * dimensions_ || !(y > 0.0)) continue;
    const Inequality& row = rows_[static_cast<std::size_t>(basis_[k] - 2 * dimensions_)];
    for (int j = 0; j < dimensions_; ++j) {
      sum[j] += y * row.slope[j];
      terms += y * std::abs(row.slope[j]);
    }
    highest += y * row.offset;
    terms += y * std::abs(row.offset);
  }
  for (int j = 0; j < dimensions_; ++j) highest += std::abs(sum[j]);
  return highest < -kRounding * terms;
}

bool Region::is_empty() {
  if (!start()) return false;
  for (int i = 0; i < kMostPivots; ++i) {
    if (i % kFactorizeEvery == kFactorizeEvery - 1 && !factorize()) return false;
    int entering = -1;
    const double least = lowest_slack(entering);
    if (slack_ < 0.0 && proves_empty()) return true;
    if (least >= 0.0 || entering < 0 || !pivot(entering)) return false;
  }
  return false;
}

}  // namespace photocoag
