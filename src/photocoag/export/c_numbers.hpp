// Role: setup; numbers and tables of numbers as C literals. Used by export. Allocates.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace photocoag {

/// Writes constants in single or double precision so that they read back exactly.
class CNumbers {
 public:
  explicit CNumbers(bool single_precision) : single_(single_precision) {}

  bool single() const noexcept { return single_; }

  /// A literal with point or exponent: 0.5, 1e-05F. Values below single precision's normal range
  /// become 0.
  std::string number(double value) const {
    std::string text;
    if (single_) {
      const auto narrow = static_cast<float>(value);
      text =
          fmt::format("{}", std::abs(narrow) < std::numeric_limits<float>::min() ? 0.0F : narrow);
    } else {
      text = fmt::format("{}", value);
    }
    if (text.find_first_of(".e") == std::string::npos) text += ".0";
    return single_ ? text + "F" : text;
  }

  /// {a, b, …}
  template <typename Values>
  std::string list(const Values& values) const {
    std::vector<std::string> texts;
    for (const double value : values) texts.push_back(number(value));
    return fmt::format("{{{}}}", fmt::join(texts, ", "));
  }

  /// {{a, b}, {c, d}}: one line for each of the rows.
  static std::string lines(const std::vector<std::string>& rows) {
    return fmt::format("{{\n    {}}}", fmt::join(rows, ",\n    "));
  }

  /// Row by row.
  template <typename Matrix>
  std::string matrix(const Matrix& values) const {
    std::vector<std::string> rows;
    for (int i = 0; i < static_cast<int>(values.rows()); ++i) {
      std::vector<double> row;
      for (int j = 0; j < static_cast<int>(values.cols()); ++j) row.push_back(values(i, j));
      rows.push_back(list(row));
    }
    return lines(rows);
  }

 private:
  bool single_;
};

}  // namespace photocoag
