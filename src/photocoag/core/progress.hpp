// Role: setup; progress of a long computation. Used by mor, study, certify, apps.
#pragma once

#include <functional>
#include <string_view>

namespace photocoag {

/// Progress callback: stage and fraction, 0 to 1. May be empty.
using Progress = std::function<void(std::string_view stage, double fraction)>;

}  // namespace photocoag
