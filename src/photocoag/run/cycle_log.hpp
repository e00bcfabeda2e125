// Role: online; a cycle as a record of the crash-safe log and back. Used by run, `convert`.
// Real time: to_log is noexcept, allocation-free.
#pragma once

#include "photocoag/log/record.hpp"
#include "photocoag/loop/record.hpp"

namespace photocoag {

/// Durations are left out.
LogRecord to_log(const CycleRecord& record, const CycleEnd& end) noexcept;

/// What run.csv needs. Numbers that no enumeration has become its first value.
CycleRecord from_log(const LogRecord& logged) noexcept;

}  // namespace photocoag
