// Role: the program; the supervisor's reasons as text for the operator: what happened, what to do.
// Used by console, apps. Source: docs/safety.md.
#pragma once

#include <string_view>

#include "photocoag/safety/states.hpp"

namespace photocoag {

struct ReasonWords {
  std::string_view what;  ///< one sentence
  std::string_view then;  ///< what to do; may be empty
};
ReasonWords words_of(SafetyReason reason) noexcept;

}  // namespace photocoag
