// Role: setup; how a reduced model is made. Used by mor and the configuration.
#pragma once

#include <string_view>

namespace photocoag {

enum class ReductionMethod {
  kPodDeim,  ///< the paper's: one global POD basis over alpha, DEIM for B(alpha) and C_vol(alpha)
};

constexpr std::string_view to_string(ReductionMethod) noexcept { return "pod-deim"; }

struct ReductionSettings {
  ReductionMethod method = ReductionMethod::kPodDeim;
  int order = 6;  ///< states of the reduced model, 1 to 14

  /// Throws Error naming the key ("model.…"), the value and the range.
  void validate() const;
  bool operator==(const ReductionSettings&) const = default;
};

}  // namespace photocoag
