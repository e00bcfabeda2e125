// Role: the program; --json: the result of a command as one JSON object on standard output.
// Format: docs/run-folder.md ("For other programs"). Units: in the names.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "command_line.hpp"

namespace photocoag {

class FullOrderModel;
struct ReducedModel;

/// Adds --json.
CommandOption add_json(CommandLine& command, bool& wanted);

/// Prints {"command", "exit_code", "folder" unless empty, then `more`} if `wanted`; returns the
/// exit code.
int with_json(bool wanted, const std::string& command, int exit_code,
              const std::filesystem::path& folder, const nlohmann::ordered_json& more);

/// Output of --version --json.
std::string version_object();

/// {"summary": the text as JSON}.
nlohmann::ordered_json summary_object(const std::string& text);

/// Result of `reduce`: sizes, measured errors, proved bounds.
nlohmann::ordered_json reduction_object(const ReducedModel& model, const FullOrderModel& full,
                                        const std::string& file);

}  // namespace photocoag
