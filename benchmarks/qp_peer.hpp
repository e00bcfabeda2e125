// Role: benchmarks; a problem in the layouts of all solvers, and what a solver is to
// photocoag_bench_qp_peers.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "photocoag/qp/problem.hpp"

namespace photocoag::benchmarks {

inline constexpr std::size_t kWindow = 4;  // problems that fit the caches together
inline constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

// In the layouts of all: bounds before rows, matrices by rows.
struct Problem {
  QpProblem qp;
  std::vector<double> H;
  std::vector<double> g;
  std::vector<double> G;
  std::vector<double> lower;  // of inputs and rows
  std::vector<double> upper;
  int horizon = 0;
  std::string weights;
  double u0 = kNothing;  // exact, if known
};

// Answers a problem with u; empty: no answer.
class Peer {
 public:
  virtual ~Peer() = default;
  virtual std::string name() const = 0;
  /// Outside of the clock: copies what needs a layout of its own to place 0 ... kWindow - 1.
  virtual void prepare(const Problem&, std::size_t) {}
  /// The problem, which prepare() has seen at this place.
  virtual std::span<const double> solve(Problem& problem, std::size_t place) = 0;
};

}  // namespace photocoag::benchmarks
