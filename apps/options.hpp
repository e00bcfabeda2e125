// Role: the program; options shared by many commands, and checks of numbers on the command line:
// only digits, finite, in range.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "command_line.hpp"

namespace photocoag {

/// Options that several commands share.
struct CommonOptions {
  std::string config;            ///< TOML file; empty: defaults
  std::vector<std::string> set;  ///< "key=value"
  bool no_cache = false;
};

/// --config and --set.
void add_common(CommandLine& command, CommonOptions& options);
/// --no-cache.
void add_cache(CommandLine& command, CommonOptions& options);
/// --out: a folder, new or empty; default: a new one below runs/.
void add_new_folder(CommandLine& command, std::string& out);
/// --times, required: s, comma-separated.
void add_times(CommandLine& command, std::vector<double>& times, const char* description);
/// Text at the end of --help: examples, exit codes, the notice.
std::string footer(std::string_view examples);

/// An option's check: a number from `low` to `high`.
Check number_from(double low, double high);
/// An option's check: a whole number from `low` to `high`.
Check whole_number_from(std::int64_t low, std::int64_t high);

/// An option's check: not empty. For values that the configuration validates.
Check given();

/// The numbers of "a,b,…", each from `low` to `high` and none twice; at least one. A decimal comma
/// ("0,001") is refused, not read as two numbers. Throws Error naming `option`.
std::vector<double> number_list(const std::string& option, const std::string& text, double low,
                                double high);

}  // namespace photocoag
