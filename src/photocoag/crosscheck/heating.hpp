// Role: setup; the axial half of the cross-check in time: kLanes radial terms side by side, each
// computed as if alone. Used by crosscheck. Source: Alexander's method (see axial.hpp).
// Units: SI. Real-time promise: none.
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "photocoag/crosscheck/axial.hpp"

namespace photocoag::crosscheck {

/// A symmetric tridiagonal matrix, and its factors L D L^T.
struct Symmetric {
  std::vector<double> diagonal;
  std::vector<double> beside;  ///< entry i couples i and i + 1

  void factorize();
  /// Solves with the factors; `x` has `count` right-hand sides, row by row.
  void solve(std::vector<double>& x, std::size_t count) const;
};

/// Heat capacity and losses of one radial term: mass T' = load - stiffness T.
struct Pencil {
  Symmetric mass;
  Symmetric stiffness;
  double slowest = std::numeric_limits<double>::infinity();  ///< 1/s, no mode decays more slowly
};

constexpr std::size_t kLanes = 4;

/// Temperatures of all nodes and sources of kLanes radial terms, cold at first.
class Heating {
 public:
  /// kLanes pencils of the same size. Keeps a reference to `sources`.
  Heating(const std::vector<Pencil>& pencils, const Sources& sources);

  void advance(double time, int steps);
  /// State of one term, node by node and source by source, with stride kLanes.
  const double* lane(std::size_t l) const noexcept { return now_.data() + l; }

 private:
  // Of kLanes matrices: number i of each, then number i + 1.
  struct Matrices {
    std::vector<double> diagonal;
    std::vector<double> beside;

    explicit Matrices(std::size_t nodes) : diagonal(nodes * kLanes), beside(nodes * kLanes) {}
    void take(std::size_t lane, const Symmetric& matrix);
  };

  const Sources& sources_;
  std::size_t nodes_;
  Matrices mass_;
  Matrices stiffness_;
  Matrices factors_;  // the diagonal: one over it
  std::vector<double> now_;
  std::vector<double> at_;
  std::vector<double> slope_[3];
};

/// Sums of heat times load over the nodes.
class GramSum {
 public:
  GramSum(const Sources& sources, std::size_t nodes);

  /// gram += weight heat load', node after node; gram is count x count, row after row, the numbers
  /// of `heat` are `stride` apart.
  void add(double* gram, const double* heat, std::size_t stride, double weight) const;

 private:
  std::size_t nodes_;
  std::size_t count_;
  std::size_t padded_;        // a multiple of what is summed side by side
  std::vector<double> load_;  // zeros behind each node's
};

}  // namespace photocoag::crosscheck
