// Role: the program; the message topic of a cycle's field (MCAP files, Foxglove's WebSocket): one
// topic per kind of quantity. Used by run_files, console.
// Source: docs/realtime.md. Real-time promise: none.
#pragma once

#include <string_view>

namespace photocoag {

/// "/temperature", "/power", … `word`: an enumeration or a text.
std::string_view topic_of(std::string_view name, std::string_view unit, bool word) noexcept;

}  // namespace photocoag
