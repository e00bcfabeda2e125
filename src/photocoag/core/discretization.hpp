// Role: offline and online; how a continuous-time model is sampled. Used by fom, rom and loop.
#pragma once

#include <string_view>

namespace photocoag {

/// Time discretization of x' = A x + B u over one period h with constant power u.
enum class Discretization {
  kZeroOrderHold,  ///< exact: x+ = e^(Ah) x + A^-1 (e^(Ah) - I) B u
  kImplicitEuler,  ///< the paper's: x+ = (I - hA)^-1 (x + h B u); 12 % low after the first step
};

constexpr std::string_view to_string(Discretization value) noexcept {
  return value == Discretization::kZeroOrderHold ? "zero-order-hold" : "implicit-euler";
}

}  // namespace photocoag
