// Role: offline; a low-dimensional polytope in a box, built up by inequalities, and a proof of
// emptiness. Used by certify. Source: the simplex method on the dual of "maximize the smallest
// slack"; Farkas' lemma. Shares no code with qp/dense, whose decisions certify analyses. Units:
// none. Real time: none. Threads: one owner.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace photocoag {

inline constexpr int kMaxDimensions = 8;

/// slope' x + offset >= 0.
struct Inequality {
  std::array<double, kMaxDimensions> slope{};
  double offset = 0.0;
};

/// The points of [-1, 1]^n that satisfy all inequalities.
class Region {
 public:
  explicit Region(int dimensions) : dimensions_(dimensions) {}

  /// Adds an inequality; one with a non-finite entry is ignored.
  void add(const Inequality& inequality);
  /// Removes the inequalities added last, down to `count`, an earlier size().
  void shrink(std::size_t count) { rows_.resize(count); }
  std::size_t size() const noexcept { return rows_.size(); }

  /// True if the region is proved empty: a non-negative combination of its inequalities is negative
  /// in the whole box, rounding included. False: it may contain points; point() is in it or near.
  bool is_empty();
  /// Final point of is_empty().
  const std::array<double, kMaxDimensions>& point() const noexcept { return point_; }

 private:
  static constexpr int kMaxBasis = kMaxDimensions + 1;
  using Vector = std::array<double, kMaxBasis>;

  Vector column(int index) const noexcept;
  double cost(int index) const noexcept;
  bool start();
  bool factorize() noexcept;
  double lowest_slack(int& entering) noexcept;
  bool pivot(int entering) noexcept;
  bool proves_empty() const noexcept;

  int dimensions_;
  std::vector<Inequality> rows_;  // normalized
  std::array<double, kMaxDimensions> point_{};
  // Columns of the dual: first those of the box, x_j <= 1 and -x_j <= 1, then the rows.
  std::array<int, kMaxBasis> basis_{};
  std::array<Vector, kMaxBasis> inverse_{};
  Vector weight_{};  // of the basis
  double slack_ = 0.0;
};

}  // namespace photocoag
