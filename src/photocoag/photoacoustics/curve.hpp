// Role: setup and online; the Grueneisen parameter of the absorbing tissue over its absolute
// temperature, which converts amplitudes into temperatures. Used by photoacoustics, rt, eye, run.
// Source: docs/photoacoustics.md (P5). Units: deg C; the Grueneisen parameter in any unit, since
// only ratios count. Real time: value and temperature are noexcept, bounded, allocation-free.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace photocoag {

/// A curve as a user writes it down: a polynomial or a table, never both.
struct CurveData {
  std::string source;                ///< origin of the data, free text
  std::vector<double> coefficients;  ///< c_0 + c_1 T + …; at most degree 5
  std::vector<double> temperatures;  ///< deg C, ascending; of a table, linear between its points
  std::vector<double> values;        ///< one per temperature
  double valid_from_celsius = 1.0;   ///< temperatures outside this range are not reported
  double valid_to_celsius = 100.0;
  bool operator==(const CurveData&) const = default;
};

/// 0.0053 + 0.0043 T: water-like, common in the field, NOT verified for the tissue of the fundus.
CurveData water_like_curve();

/// A checked curve: above 0 and strictly rising in its valid range.
class GrueneisenCurve {
 public:
  /// Throws Error naming the key of `data` that is wrong; `where` is the file.
  explicit GrueneisenCurve(const CurveData& data, const std::string& where = "");

  double low() const noexcept { return low_; }    ///< deg C
  double high() const noexcept { return high_; }  ///< deg C
  bool linear() const noexcept { return points_ == 0 && degree_ == 1; }
  /// At `celsius`, extrapolated outside the valid range.
  double value(double celsius) const noexcept;
  double slope(double celsius) const noexcept;  ///< per K
  /// The temperature at which the curve has this value, deg C; NaN outside the valid range.
  double temperature(double value) const noexcept;

 private:
  static constexpr std::size_t kMostPoints = 64;
  static constexpr std::size_t kMostCoefficients = 6;
  std::size_t segment(double celsius) const noexcept;

  std::array<double, kMostCoefficients> coefficients_{};
  std::size_t degree_ = 0;
  std::array<double, kMostPoints> temperatures_{};
  std::array<double, kMostPoints> values_{};
  std::size_t points_ = 0;  // 0: a polynomial
  double low_ = 0.0;
  double high_ = 0.0;
};

}  // namespace photocoag
