// Role: the program; the console's messages as JSON. Used by desk, tests. Format: docs/console.md.
// Boundary: every number carries its unit in its name.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "photocoag/log/fields.hpp"
#include "photocoag/safety/supervisor.hpp"

namespace photocoag {

inline constexpr int kConsoleProtocol = 1;

/// The columns of a live row, from the table of a cycle's fields.
std::span<const CycleField* const> live_columns();

/// "hello": protocol, program, notice, columns with units, who the client is.
std::string hello_message(int client);

/// A row of "live": [..], in the order of live_columns(); non-finite values are null.
void append_row(std::string& to, const LogRecord& record);

/// "self_test": found and accepted values of each item.
std::string self_test_message(const SelfTestReport& report, const SafetyLimits& limits);

/// The command of {"command": "…"}; nullopt for any other message.
std::optional<std::string> command_of(std::string_view text);

/// "answer" to a command; an empty refusal means success.
std::string answer_message(std::string_view command, std::string_view refusal);

/// A number of JSON; null if it is not finite.
std::string json_number(double value);

}  // namespace photocoag
