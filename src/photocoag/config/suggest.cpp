#include "photocoag/config/suggest.hpp"

#include <algorithm>
#include <cctype>
#include <numeric>

namespace photocoag {
namespace {

char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

// Insertions, deletions and substitutions.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t change = diagonal + (lower(a[i - 1]) == lower(b[j - 1]) ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, change});
    }
  }
  return row[b.size()];
}

// A forgotten unit ("period" for "period_ms") is one slip, however long the unit.
std::size_t slips(std::string_view written, std::string_view candidate) {
  const bool forgotten = !written.empty() && candidate.size() > written.size() &&
                         candidate.starts_with(written) && candidate[written.size()] == '_';
  return forgotten ? 1 : edit_distance(written, candidate);
}

std::string_view last_part(std::string_view key) {
  return key.substr(key.find_last_of('.') + 1);  // npos + 1 = 0
}

}  // namespace

std::string nearest_key(std::string_view written, const std::vector<std::string>& candidates) {
  constexpr std::size_t kLongest = 200;
  if (written.size() > kLongest) return "";
  const std::string_view last = last_part(written);
  std::size_t least = std::max<std::size_t>(2, last.size() / 3) + 1;
  std::string best;
  for (const std::string& candidate : candidates) {
    const std::size_t distance =
        std::min(slips(written, candidate), slips(last, last_part(candidate)) + 1);
    if (distance >= least) continue;
    least = distance;
    best = candidate;
  }
  return best;
}

}  // namespace photocoag
