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
  std::size_t boxes = 20'000;   ///< most boxes looked at
  long long nodes = 4'000;      ///< most decisions followed in a box; four times as many at the end
  long long samples = 200'000;  ///< problems solved before, to see how many changes there are
  std::uint64_t seed = 1;
};

struct Certificate {
  int seen = 0;           ///< the most changes that DenseSolver has made for a problem of the box
  int proved = 0;         ///< no problem of the box needs more
  int hard_bound = 0;     ///< DenseSolver::iteration_bound(), after which it gives up
  double share = 0.0;     ///< of the box's volume in which `seen` is proved to be the most
  std::size_t boxes = 0;  ///< looked at
  std::size_t open_boxes = 0;  ///< in which `seen` is not proved
  std::size_t undecided = 0;   ///< of those: with the hard bound only
  long long solved = 0;        ///< problems given to DenseSolver
  double condition = 0.0;      ///< of the Hessian, at most, in the boxes looked at to the end
  double rounding = 0.0;       ///< what the solver's comparisons may be off by, relative
  bool stopped = false;        ///< before the end; what is proved so far holds

  /// The rounding is covered by the reserve of every comparison.
  bool covers_rounding() const noexcept;
};

/// Settings and box as one line of text: what a proof is a proof of.
std::string claim_text(const ControlSettings& settings, const CertifiedBox& box,
                       const CertifyOptions& options);

/// Deterministic, unless stopped. Throws Error if the settings cannot be certified
/// (require_certifiable) or the box is bad.
Certificate certify(const ReducedModel& model, const ControlSettings& settings,
                    const CertifiedBox& box, const CertifyOptions& options,
                    const std::atomic<bool>& stop, const Progress& progress = {});

}  // namespace photocoag
