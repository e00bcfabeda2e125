#include "options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

// A whole text as a number in decimal digits. "001" is refused: it results from a decimal comma.
template <typename T>
std::optional<T> number_of(std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  const std::string_view digits = text.substr(text.starts_with('-') ? 1 : 0);
  const bool padded = digits.size() > 1 && digits[0] == '0' && digits[1] >= '0' && digits[1] <= '9';
  if (padded || !std::isfinite(static_cast<double>(value))) return std::nullopt;
  return value;
}

template <typename T>
Check from(std::string_view what, T low, T high) {
  const std::string range = fmt::format("{} from {} to {}", what, low, high);
  return [=](const std::string& text) {
    const std::optional<T> value = number_of<T>(text);
    if (value && *value >= low && *value <= high) return std::string();
    return fmt::format("found {}; accepted: {}", text, range);
  };
}

}  // namespace

void add_common(CommandLine& command, CommonOptions& options) {
  command.add_option("--config", options.config, "TOML file; without it the defaults")
      .type_name("FILE");
  command
      .add_option("--set", options.set,
                  "one key of the configuration, e.g. control.horizon=10 or "
                  "tissue.layers.RPE.thickness_um=5; may be repeated, later ones win")
      .type_name("KEY=VALUE")
      .one_value_each();
}

void add_cache(CommandLine& command, CommonOptions& options) {
  command.add_flag(
      "--no-cache", options.no_cache,
      "make the reduced model again, without the cache (the result is the same to the last bit)");
}

void add_new_folder(CommandLine& command, std::string& out) {
  command.add_option("--out", out, "folder, new or empty; default: a new one below runs/")
      .type_name("DIR");
}

void add_times(CommandLine& command, std::vector<double>& times, const char* description) {
  constexpr double kLongest = 1e4;  // s
  command
      .add_text(
          "--times",
          [&times](const std::string& text) {
            times = number_list("--times", text, 0.0, kLongest);
          },
          description)
      .required()
      .type_name("t1,t2,...");
}

std::string footer(std::string_view examples) {
  return fmt::format(
      "Examples:\n{}\n"
      "Exit code: 0 good; 1 finished but a check failed, or stopped; 2 bad input; 3 device "
      "fault.\n{}",
      examples, kResearchNotice);
}

Check number_from(double low, double high) { return from("a number", low, high); }

Check whole_number_from(std::int64_t low, std::int64_t high) {
  return from("a whole number", low, high);
}

Check given() {
  return [](const std::string& text) {
    return text.empty() ? std::string("found nothing") : std::string();
  };
}

std::vector<double> number_list(const std::string& option, const std::string& text, double low,
                                double high) {
  std::vector<double> numbers;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t comma = std::min(text.find(',', at), text.size());
    const std::optional<double> value =
        number_of<double>(std::string_view(text).substr(at, comma - at));
    const bool twice = value && std::find(numbers.begin(), numbers.end(), *value) != numbers.end();
    if (!value || twice || *value < low || *value > high) {
      throw Error(ErrorParts{
          .where = option,
          .found = text.empty() ? "nothing" : text,
          .accepted = fmt::format("comma-separated numbers from {} to {}, none twice", low, high)});
    }
    numbers.push_back(*value);
    at = comma + 1;
  }
  return numbers;
}

}  // namespace photocoag
