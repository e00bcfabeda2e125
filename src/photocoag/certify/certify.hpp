// Role: offline; the largest number of active-set changes that DenseSolver makes for a
// configuration, proved over a box of parameters. Used by the program (`certify`).
// Source: docs/certify.md. Units: SI. Real time: none. Threads: all cores.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>

#include "photocoag/certify/parameter_box.hpp"
#include "photocoag/core/progress.hpp"

namespace photocoag {

struct CertifyOptions {
  int halvings = 40;            ///< most halvings of a box, 0 to 60
  std::size_t boxes = 20'000;   ///< most boxes examined
  long long nodes = 4'000;      ///< most decisions per box; four times as many at the end
  long long samples = 200'000;  ///< problems solved first, to find the largest number of changes
  std::uint64_t seed = 1;
};

struct Certificate {
  int seen = 0;        ///< most changes by DenseSolver for a sampled problem of the box
  int proved = 0;      ///< no problem of the box needs more changes
  int hard_bound = 0;  ///< DenseSolver::iteration_bound(), after which it gives up
  double share = 0.0;  ///< fraction of the box's volume in which `seen` is proved to be the maximum
  std::size_t boxes = 0;       ///< examined
  std::size_t open_boxes = 0;  ///< in which `seen` is not proved
  std::size_t undecided = 0;   ///< of those: with the hard bound only
  long long solved = 0;        ///< problems given to DenseSolver
  double condition = 0.0;  ///< largest bound on the Hessian's condition in the fully examined boxes
  double rounding = 0.0;   ///< bound on the relative error of the solver's comparisons
  bool stopped = false;    ///< before the end; what is proved so far holds

  /// True if the margin of every comparison covers the rounding.
  bool covers_rounding() const noexcept;
};

/// Settings and box as one line of text: the statement that a proof proves.
std::string claim_text(const ControlSettings& settings, const CertifiedBox& box,
                       const CertifyOptions& options);

/// Deterministic, unless stopped. Throws Error if the settings cannot be certified
/// (require_certifiable) or the box is bad.
Certificate certify(const ReducedModel& model, const ControlSettings& settings,
                    const CertifiedBox& box, const CertifyOptions& options,
                    const std::atomic<bool>& stop, const Progress& progress = {});

}  // namespace photocoag
