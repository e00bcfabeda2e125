#include "photocoag/population/estimation_table.hpp"

#include <fmt/format.h>

#include <array>
#include <iterator>

namespace photocoag {
namespace {

constexpr int kName = 37;
constexpr int kSpan = 11;

struct Column {
  std::string_view above, below;
  int width;  // at least 8, room for 1.23e+04; a space before it comes on top
  int digits;
};

constexpr std::array<Column, 8> kColumns = {{{"", "NIS", 8, 3},
                                             {"NEES", "(x,a)", 8, 3},
                                             {"NEES", "alpha", 8, 2},
                                             {"NEES", "peak", 8, 2},
                                             {"alpha", "rms %", 8, 2},
                                             {"sigma", "alpha", 8, 3},
                                             {"peak", "rms K", 8, 3},
                                             {"reject-", "ed %", 8, 2}}};

std::string cell(double value, const Column& column) {
  const std::string plain = fmt::format("{:.{}f}", value, column.digits);
  if (static_cast<int>(plain.size()) <= column.width) return plain;
  return fmt::format("{:.2e}", value);
}

std::string line(std::string_view name, std::string_view span) {
  return fmt::format("{:<{}} {:>{}}", name, kName, span, kSpan);
}

}  // namespace

std::string estimation_heading() {
  std::string above = line("", "");
  std::string below = line("scenario", "ms");
  for (const Column& column : kColumns) {
    fmt::format_to(std::back_inserter(above), " {:>{}}", column.above, column.width);
    fmt::format_to(std::back_inserter(below), " {:>{}}", column.below, column.width);
  }
  return above + '\n' + below + '\n';
}

std::string estimation_row(std::string_view name, const EstimationCycle& mean, double period,
                           std::size_t begin, std::size_t end) {
  std::string text =
      line(name, fmt::format("{:g} to {:g}", 1e3 * period * static_cast<double>(begin + 1),
                             1e3 * period * static_cast<double>(end)));
  const std::array<double, kColumns.size()> values = {
      mean.nis,         mean.nees,     mean.nees_alpha,      mean.nees_peak, 100.0 * mean.rms_alpha,
      mean.sigma_alpha, mean.rms_peak, 100.0 * mean.rejected};
  for (std::size_t k = 0; k < kColumns.size(); ++k) {
    const bool unknown = k == 1 && !(mean.nees > 0.0);  // a full-order eye has no reduced state
    fmt::format_to(std::back_inserter(text), " {:>{}}",
                   unknown ? "-" : cell(values[k], kColumns[k]), kColumns[k].width);
  }
  return text + '\n';
}

}  // namespace photocoag
