#include "photocoag/config/decimal.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <system_error>

namespace photocoag {
namespace {

int read_exponent(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  constexpr int kFar = 100000;  // beyond every double, and safe to add to
  if (error == std::errc::result_out_of_range || std::abs(value) > kFar) {
    return text.front() == '-' ? -kFar : kFar;
  }
  return value;
}

// digits d1 d2 d3..., value d1.d2d3... times 10^exponent, without an exponent in the text.
std::string plain(const std::string& digits, int exponent) {
  if (exponent < 0)
    return "0." + std::string(static_cast<std::size_t>(-exponent - 1), '0') + digits;
  const auto whole = static_cast<std::size_t>(exponent) + 1;
  if (digits.size() <= whole) return digits + std::string(whole - digits.size(), '0') + ".0";
  return fmt::format("{}.{}", digits.substr(0, whole), digits.substr(whole));
}

}  // namespace

double scaled_decimal(std::string_view text, int exponent) {
  std::string number;
  for (const char c : text) {
    if (c != '_') number += c;
  }
  if (!number.empty() && number.front() == '+') number.erase(0, 1);
  const std::size_t e = number.find_first_of("eE");
  if (e != std::string::npos) {
    exponent += read_exponent(std::string_view(number).substr(e + 1));
    number.resize(e);
  }
  number += fmt::format("e{}", exponent);
  double value = 0.0;
  std::from_chars(number.data(), number.data() + number.size(), value);
  return value + 0.0;  // -0.0 + 0.0 = 0.0
}

std::string shortest_decimal(double value, int exponent) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value > 0.0 ? "inf" : "-inf";
  std::array<char, 32> buffer{};
  const auto written = std::to_chars(buffer.data(), buffer.data() + buffer.size(), std::abs(value),
                                     std::chars_format::scientific);
  const std::string_view text(buffer.data(), static_cast<std::size_t>(written.ptr - buffer.data()));
  const std::size_t e = text.find('e');
  std::string digits(text.substr(0, e));
  if (digits.size() > 1) digits.erase(1, 1);  // the point
  const int power = value == 0.0 ? 0 : read_exponent(text.substr(e + 1)) - exponent;
  const std::string sign = value < 0.0 ? "-" : "";
  if (power >= -3 && power < 15) return sign + plain(digits, power);
  const std::string point = digits.size() > 1 ? "." : "";
  return fmt::format("{}{}{}{}e{}", sign, digits.substr(0, 1), point, digits.substr(1), power);
}

}  // namespace photocoag
