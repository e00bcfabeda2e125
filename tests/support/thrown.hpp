// Role: tests; what a call threw, for assertions on messages.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "photocoag/core/error.hpp"

namespace photocoag::testing {

/// The Error thrown by `call`; fails the test if there was none.
template <typename Call>
ErrorParts thrown_by(Call&& call) {
  try {
    std::forward<Call>(call)();
  } catch (const Error& error) {
    return error.parts();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

/// what() of the Error thrown by `call`, empty if none was.
template <typename Call>
std::string message_of(Call&& call) {
  try {
    std::forward<Call>(call)();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

}  // namespace photocoag::testing
