// Role: offline; the full-order model's response to one period of 1 W at all nodes of alpha and
// beta, period by period, with bounds between nodes. Used by the certificate. Source:
// docs/models.md (certificate). Units: K/W. Threads: one owner.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <vector>

#include "photocoag/core/discretization.hpp"
#include "photocoag/core/types.hpp"
#include "photocoag/mor/impulse_error.hpp"
#include "photocoag/mor/pulse_response.hpp"

namespace photocoag {

/// One output at all nodes; second derivatives there and bounds of the fourth everywhere.
struct NodeValues {
  Eigen::VectorXd value;
  Eigen::VectorXd second_alpha;
  Eigen::VectorXd second_beta;  ///< empty for one parameter
  double fourth_alpha = 0.0;
  double fourth_mixed = 0.0;
  double fourth_beta = 0.0;
};

struct OutputNodeValues {
  NodeValues peak;
  NodeValues volume;
};

/// Bounds over the whole range.
struct OutputBounds {
  double peak = 0.0;
  double volume = 0.0;
};

class FullImpulse {
 public:
  /// k = 1, up to `horizon`. If layers conduct differently, each radial mode has axial modes of its
  /// own (about 25 ms each), whose sums are precomputed and kept: 32 bytes x nodes x horizon, 48
  /// with beta. Allocates.
  FullImpulse(const FullOrderModel& full, Discretization discretization, double period,
              const FactorNodes& nodes, std::size_t horizon);
  ~FullImpulse();

  const OutputNodeValues& now() const noexcept { return now_; }
  /// k <- k + 1.
  void advance();

  /// Sums over all k of one watt: the steady state.
  const OutputNodeValues& steady() const noexcept { return steady_; }
  /// |sum over all k beyond the horizon|, and |value| at horizon + 1.
  const OutputBounds& rest() const noexcept { return rest_; }
  const OutputBounds& first_beyond() const noexcept { return first_beyond_; }

 private:
  struct Group;
  struct Columns;
  void add_sums(const Group& group);

  std::size_t horizon_;
  std::size_t k_ = 1;
  std::unique_ptr<Group> one_;        // separable: the only group, summed as k goes
  std::unique_ptr<Columns> columns_;  // else: all groups, summed beforehand
  OutputNodeValues now_;
  OutputNodeValues steady_;
  OutputBounds rest_;
  OutputBounds first_beyond_;
};

/// Decay factor per period of the full-order model's slowest mode.
double slowest_decay(const FullOrderModel& full, Discretization discretization, double period);

}  // namespace photocoag
