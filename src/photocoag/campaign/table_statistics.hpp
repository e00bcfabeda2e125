// Role: offline; exact statistics of a campaign's columns in bounded memory: rows are read again
// for each step. Used by campaign/campaign_statistics. Sums run in the order of the rows. Sources:
// quantiles by counting digits of the ordered bits from the highest on (Knuth 3, section 5.2.5);
// Spearman's rank correlation with mean ranks of ties, in whole numbers.
// Units: of the columns. Real-time promise: none.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "photocoag/campaign/spot_rows.hpp"

namespace photocoag {

/// A number of each row.
struct RowColumn {
  std::size_t index = 0;  ///< in the row's block
  bool log10 = false;     ///< its logarithm instead

  double of(const double* block) const noexcept;
};
RowColumn input_column(std::size_t input) noexcept;
/// Precondition: the outcome exists.
RowColumn outcome_column(std::string_view name, std::size_t inputs);

/// Of a column's finite values.
struct ColumnMoments {
  std::uint64_t count = 0;
  double mean = 0.0;       ///< NaN: there are none
  double deviation = 0.0;  ///< of the sample
};
std::vector<ColumnMoments> moments(const SpotRows& rows, const std::vector<RowColumn>& columns);

/// Per column and fraction the nearest rank among the finite values; NaN if there are none. Zeros
/// are unsigned.
std::vector<std::vector<double>> quantiles(const SpotRows& rows,
                                           const std::vector<RowColumn>& columns,
                                           const std::vector<double>& fractions);

/// Per column Spearman's rank correlation with `other`; ties get their mean rank. 0 if one of them
/// is constant. `folder`: for temporary files (campaign/pair_sorter.hpp), none below `in_memory`
/// rows.
std::vector<double> rank_correlations(const SpotRows& rows, const std::vector<RowColumn>& columns,
                                      RowColumn other, const std::filesystem::path& folder,
                                      std::size_t in_memory);

}  // namespace photocoag
