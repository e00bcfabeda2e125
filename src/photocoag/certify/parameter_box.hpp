// Role: offline; the parameter box over which a property of `dense` is proved. Used by certify,
// apps.
// Source: docs/certify.md. Units: SI. Real time: none. Threads: plain data.
#pragma once

#include <array>

#include "photocoag/mpc/settings.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

inline constexpr int kMaxCertifiedHorizon = 5;

struct BoxRange {
  double low = 0.0;
  double high = 0.0;

  double middle() const noexcept { return 0.5 * (low + high); }
  double radius() const noexcept { return 0.5 * (high - low); }
};

inline constexpr int kMaxStages = kMaxCertifiedHorizon - 1;  // N - 1

/// Ranges of the free responses f_1 … f_{N-1}, independently, and of everything else that changes
/// from cycle to cycle. u_ref follows from alpha and beta (E21).
struct CertifiedBox {
  BoxRange absorption{0.2, 2.0};
  BoxRange choroid{1.0, 1.0};               // beta; ignored for one parameter
  std::array<BoxRange, kMaxStages> free{};  // K
  BoxRange previous{0.0, 0.1};  // W, u_prev; ignored without control.power_change_weight

  /// Throws Error naming the range.
  void validate() const;
};

/// Default box of `certify`: free responses from 0 to 1.25 times the limit, all powers.
CertifiedBox usual_box(const ControlSettings& settings, BoxRange absorption, BoxRange choroid);

/// Throws Error naming the first setting for which the count of active-set changes cannot be
/// proved: another solver than dense, a robust limit, a reference that changes, a longer horizon.
void require_certifiable(const ReducedModel& model, const ControlSettings& settings);

}  // namespace photocoag
