// Role: offline; a polytope in a box of few dimensions, built up inequality by inequality, and the
// proof that it is empty. Used by certify. Source: the simplex method on the dual of "the point
// with the largest least slack"; Farkas' lemma. Written for this purpose: no line of qp/dense,
// whose decisions are what certify looks at. Units: none. Real time: none. Threads: one owner.
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

  /// Adds an inequality. One with an entry that is not finite says nothing and is left out.
  void add(const Inequality& inequality);
  /// Takes away the inequalities added last, down to `count`, as size() told before.
  void shrink(std::size_t count) { rows_.resize(count); }
  std::size_t size() const noexcept { return rows_.size(); }

  /// True if the region is proved to hold no point: a non-negative sum of its inequalities is below
  /// 0 in all of the box, rounding counted. False: there may be points; point() is in it or near.
  bool is_empty();
  /// Where is_empty() has ended.
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
