#include "photocoag/campaign/table_statistics.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "photocoag/campaign/pair_sorter.hpp"

namespace photocoag {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint64_t kSign = std::uint64_t{1} << 63U;

// Whole numbers in the order of the values; both zeros have the same.
std::uint64_t key_of(double value) noexcept {
  const auto bits = std::bit_cast<std::uint64_t>(value + 0.0);
  return (bits & kSign) != 0 ? ~bits : bits | kSign;
}

double value_of(std::uint64_t key) noexcept {
  return std::bit_cast<double>((key & kSign) != 0 ? key & ~kSign : ~key);
}

constexpr unsigned kDigitBits = 11;
constexpr unsigned kDigits = 6;  // 66 bits: the first digit has two bits less
constexpr std::size_t kDigitValues = std::size_t{1} << kDigitBits;
using DigitCounts = std::array<std::uint64_t, kDigitValues>;

unsigned shift_of(unsigned digit) noexcept { return (kDigits - 1 - digit) * kDigitBits; }

// All bits above those of a digit.
std::uint64_t prefix_of(std::uint64_t key, unsigned digit) noexcept {
  return digit == 0 ? 0 : key >> shift_of(digit - 1);
}

// A wanted value: the digits that are known, and its rank among the values that share them.
struct Wanted {
  std::uint64_t prefix = 0;
  std::uint64_t rank = 0;
};

// The values of a column that share a prefix, counted by their next digit.
struct Branch {
  std::uint64_t prefix = 0;
  DigitCounts counts{};
};

void count_digit(const SpotRows& rows, const std::vector<RowColumn>& columns, unsigned digit,
                 std::vector<std::vector<Branch>>& branches) {
  rows.for_each([&](const double* block) {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const double value = columns[c].of(block);
      if (!std::isfinite(value)) continue;
      const std::uint64_t key = key_of(value);
      const std::uint64_t prefix = prefix_of(key, digit);
      for (Branch& branch : branches[c]) {
        if (branch.prefix != prefix) continue;
        ++branch.counts[(key >> shift_of(digit)) % kDigitValues];
        break;
      }
    }
  });
}

void descend(const std::vector<Branch>& branches, Wanted& wanted) {
  const auto found = std::find_if(branches.begin(), branches.end(),
                                  [&wanted](const Branch& b) { return b.prefix == wanted.prefix; });
  std::size_t digit = 0;
  for (; wanted.rank >= found->counts[digit]; ++digit) wanted.rank -= found->counts[digit];
  wanted.prefix = (wanted.prefix << kDigitBits) | digit;
}

__extension__ using Whole = __int128;  // of some 10^36 for 10^12 rows

// Twice the mean rank of each row, in the order of the rows.
void rank_rows(const SpotRows& rows, RowColumn column, PairSorter& by_value, PairSorter& by_row) {
  std::uint64_t row = 0;
  rows.for_each([&](const double* block) {
    by_value.add({.key = key_of(column.of(block)), .value = row++});
  });
  by_value.finish();
  // One cursor ahead looks for the end of the ties, the other one follows.
  PairSorter::Cursor ahead(by_value);
  PairSorter::Cursor behind(by_value);
  KeyedValue next;
  KeyedValue pair;
  bool more = ahead.next(next);
  for (std::uint64_t begin = 0, end = 0; more; begin = end) {
    const std::uint64_t key = next.key;
    for (; more && next.key == key; more = ahead.next(next)) ++end;
    for (std::uint64_t k = begin; k < end && behind.next(pair); ++k) {
      by_row.add({.key = pair.value, .value = begin + end - 1});
    }
  }
  by_row.finish();
}

// Sums over all rows of products of twice the ranks' distances from their mean.
struct RankSums {
  Whole both = 0;
  Whole own = 0;
};

// Of pairs of a column's value and the other one's rank, ascending.
RankSums rank_sums(const PairSorter& by_value, std::uint64_t rows) {
  const auto mean = static_cast<Whole>(rows) - 1;
  RankSums sums;
  PairSorter::Cursor cursor(by_value);
  KeyedValue pair;
  bool more = cursor.next(pair);
  for (std::uint64_t begin = 0, end = 0; more; begin = end) {
    const std::uint64_t key = pair.key;
    Whole others = 0;
    for (; more && pair.key == key; more = cursor.next(pair), ++end) {
      others += static_cast<Whole>(pair.value) - mean;
    }
    const Whole own = static_cast<Whole>(begin) + static_cast<Whole>(end) - 1 - mean;
    sums.both += own * others;
    sums.own += own * own * static_cast<Whole>(end - begin);
  }
  return sums;
}

}  // namespace

double RowColumn::of(const double* block) const noexcept {
  return log10 ? std::log10(block[index]) : block[index];
}

RowColumn input_column(std::size_t input) noexcept { return {.index = 2 + input}; }

RowColumn outcome_column(std::string_view name, std::size_t inputs) {
  return {.index = 2 + inputs + outcome_index(name)};
}

std::vector<ColumnMoments> moments(const SpotRows& rows, const std::vector<RowColumn>& columns) {
  std::vector<ColumnMoments> all(columns.size());
  const auto each_finite = [&](const auto& add) {
    rows.for_each([&](const double* block) {
      for (std::size_t c = 0; c < columns.size(); ++c) {
        const double value = columns[c].of(block);
        if (std::isfinite(value)) add(all[c], value);
      }
    });
  };
  each_finite([](ColumnMoments& column, double value) {
    ++column.count;
    column.mean += value;
  });
  for (ColumnMoments& column : all) column.mean /= static_cast<double>(column.count);
  each_finite([](ColumnMoments& column, double value) {
    column.deviation += (value - column.mean) * (value - column.mean);
  });
  for (ColumnMoments& column : all) {
    column.deviation =
        column.count == 0 ? kNone
        : column.count == 1
            ? 0.0
            : std::sqrt(column.deviation / (static_cast<double>(column.count) - 1.0));
  }
  return all;
}

std::vector<std::vector<double>> quantiles(const SpotRows& rows,
                                           const std::vector<RowColumn>& columns,
                                           const std::vector<double>& fractions) {
  std::vector<std::vector<double>> found(columns.size(),
                                         std::vector<double>(fractions.size(), kNone));
  std::vector<std::vector<Wanted>> wanted(columns.size());
  for (unsigned digit = 0; digit < kDigits; ++digit) {
    std::vector<std::vector<Branch>> branches(columns.size());
    for (std::size_t c = 0; c < columns.size(); ++c) {
      if (digit == 0) branches[c].push_back({});
      for (const Wanted& one : wanted[c]) {
        const bool known = std::any_of(branches[c].begin(), branches[c].end(),
                                       [&one](const Branch& b) { return b.prefix == one.prefix; });
        if (!known) branches[c].push_back({.prefix = one.prefix, .counts = {}});
      }
    }
    count_digit(rows, columns, digit, branches);
    for (std::size_t c = 0; c < columns.size(); ++c) {
      if (digit == 0) {
        std::uint64_t count = 0;
        for (const std::uint64_t values : branches[c].front().counts) count += values;
        if (count == 0) continue;
        for (const double fraction : fractions) {
          wanted[c].push_back({.prefix = 0,
                               .rank = static_cast<std::uint64_t>(
                                   fraction * static_cast<double>(count - 1) + 0.5)});
        }
      }
      for (Wanted& one : wanted[c]) descend(branches[c], one);
    }
  }
  for (std::size_t c = 0; c < columns.size(); ++c) {
    for (std::size_t f = 0; f < wanted[c].size(); ++f) found[c][f] = value_of(wanted[c][f].prefix);
  }
  return found;
}

std::vector<double> rank_correlations(const SpotRows& rows, const std::vector<RowColumn>& columns,
                                      RowColumn other, const std::filesystem::path& folder,
                                      std::size_t in_memory) {
  PairSorter ranks(folder, in_memory);
  Whole others = 0;
  {
    PairSorter by_value(folder, in_memory);
    rank_rows(rows, other, by_value, ranks);
  }
  {
    PairSorter::Cursor cursor(ranks);
    const auto mean = static_cast<Whole>(rows.count) - 1;
    for (KeyedValue pair; cursor.next(pair);) {
      others += (static_cast<Whole>(pair.value) - mean) * (static_cast<Whole>(pair.value) - mean);
    }
  }
  std::vector<double> correlations;
  for (const RowColumn& column : columns) {
    PairSorter by_value(folder, in_memory);
    PairSorter::Cursor rank(ranks);
    rows.for_each([&](const double* block) {
      KeyedValue pair;
      rank.next(pair);
      by_value.add({.key = key_of(column.of(block)), .value = pair.value});
    });
    by_value.finish();
    const RankSums sums = rank_sums(by_value, rows.count);
    const bool constant = sums.own == 0 || others == 0;
    correlations.push_back(
        constant ? 0.0
                 : static_cast<double>(sums.both) /
                       std::sqrt(static_cast<double>(sums.own) * static_cast<double>(others)));
  }
  return correlations;
}

}  // namespace photocoag
