// Role: the program; printing, and the signals related to it. A failed print (a closed terminal or
// pipe, a full disk) only changes the exit code at the end.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string>

namespace photocoag {

/// Call first: opens missing standard streams, and makes a closed pipe or a file at its size limit
/// an error of write() instead of ending the program (unless the caller has set that up).
void prepare_console() noexcept;

/// Flushes; false, with a message on standard error, if any output was lost.
bool everything_printed() noexcept;

/// Writes `text`; remembers a failure for everything_printed(). Never throws.
void print_text(std::FILE* stream, fmt::string_view format, fmt::format_args values) noexcept;

/// On standard output: results.
template <typename... T>
void print(fmt::format_string<T...> format, const T&... values) noexcept {
  print_text(stdout, format, fmt::make_format_args(values...));
}

/// On standard error: everything else.
template <typename... T>
void say(fmt::format_string<T...> format, const T&... values) noexcept {
  print_text(stderr, format, fmt::make_format_args(values...));
}

/// To the file `path`, to standard output if that is "-", nowhere if it is empty. Throws Error if
/// the file cannot be written.
void write_output(const std::string& path, const std::string& text);

}  // namespace photocoag
