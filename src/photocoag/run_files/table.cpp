#include "photocoag/run_files/table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/csv.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/log/fields.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kLargestRun = std::size_t{1} << 30;  // bytes

bool to_number(const std::string& cell, double& value) {
  if (cell.empty()) {
    value = std::numeric_limits<double>::quiet_NaN();
    return true;
  }
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  return error == std::errc() && end == cell.data() + cell.size();
}

std::string unit_of(const std::string& name) {
  const CycleField* field = field_named(name);
  return field == nullptr ? "1" : std::string(field->unit);
}

/// One field of all records as a column.
TableColumn column_of(const CycleField& field, const std::vector<LogRecord>& records) {
  TableColumn column{
      .name = std::string(field.name), .unit = std::string(field.unit), .values = {}};
  const auto fill = [&]<typename T>(std::vector<T> values, auto value_of) {
    for (const LogRecord& record : records) values.push_back(value_of(field.get(record)));
    column.values = std::move(values);
  };
  switch (field.type) {
    case FieldType::kReal:
      fill(std::vector<double>(), [](std::uint64_t bits) { return std::bit_cast<double>(bits); });
      break;
    case FieldType::kInteger:
      fill(std::vector<std::int64_t>(),
           [](std::uint64_t bits) { return static_cast<std::int64_t>(bits); });
      break;
    case FieldType::kWord:
      fill(std::vector<std::string>(),
           [&](std::uint64_t bits) { return std::string(field.word(bits)); });
      break;
  }
  return column;
}

}  // namespace

DataTable table_of(const LogContent& log) {
  DataTable table;
  table.about = {{"notice", std::string(kResearchNotice)},
                 {"program", log.header.program},
                 {"config_sha256", log.header.config_sha256},
                 {"model_sha256", log.header.model_sha256},
                 {"period_s", fmt::format("{}", log.header.period)},
                 {"closed", log.closed ? "yes" : "no"},
                 {"records_produced", fmt::format("{}", log.totals.produced)}};
  for (const CycleField& field : cycle_fields()) {
    table.columns.push_back(column_of(field, log.records));
  }
  return table;
}

DataTable table_of_csv(const std::filesystem::path& file) {
  CsvReader rows(read_file(file.string(), kLargestRun, "run.csv"), file.string());
  rows.next();
  const std::vector<std::string> names(rows.cells().begin(), rows.cells().end());
  std::vector<std::vector<std::string>> columns(names.size());
  while (rows.next()) {
    const std::vector<std::string_view>& cells = rows.cells();
    if (cells.size() != names.size()) {
      throw Error(ErrorParts{.where = rows.place(),
                             .found = fmt::format("{} cells", cells.size()),
                             .accepted = fmt::format("{} cells", names.size())});
    }
    for (std::size_t k = 0; k < cells.size(); ++k) columns[k].emplace_back(cells[k]);
  }
  DataTable table;
  table.about = {{"notice", std::string(kResearchNotice)}, {"source", file.string()}};
  for (std::size_t k = 0; k < names.size(); ++k) {
    std::vector<double> numbers(columns[k].size());
    bool numeric = true;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      numeric = numeric && to_number(columns[k][i], numbers[i]);
    }
    TableColumn column{.name = names[k], .unit = unit_of(names[k]), .values = {}};
    if (numeric) {
      column.values = std::move(numbers);
    } else {
      column.values = std::move(columns[k]);
    }
    table.columns.push_back(std::move(column));
  }
  return table;
}

void add_truth(DataTable& log, const DataTable& run) {
  const auto find = [](auto& table, std::string_view name) {
    const auto found = std::find_if(table.columns.begin(), table.columns.end(),
                                    [name](const auto& column) { return column.name == name; });
    return found == table.columns.end() ? nullptr : &*found;
  };
  const auto* cycles = find(log, "cycle");
  const auto* rows = find(run, "cycle");
  if (cycles == nullptr || rows == nullptr) return;
  const auto* logged = std::get_if<std::vector<std::int64_t>>(&cycles->values);
  const auto* told = std::get_if<std::vector<double>>(&rows->values);
  if (logged == nullptr || told == nullptr) return;
  for (const std::string_view name : {"volume_true_K", "peak_true_K"}) {
    auto* to = find(log, name);
    const auto* from = find(run, name);
    if (to == nullptr || from == nullptr) continue;
    auto* missing = std::get_if<std::vector<double>>(&to->values);
    const auto* values = std::get_if<std::vector<double>>(&from->values);
    if (missing == nullptr || values == nullptr) continue;
    std::map<std::int64_t, double> truth;
    for (std::size_t i = 0; i < told->size(); ++i) {
      truth[static_cast<std::int64_t>((*told)[i])] = (*values)[i];
    }
    for (std::size_t i = 0; i < missing->size(); ++i) {
      const auto known = truth.find((*logged)[i]);
      if (std::isnan((*missing)[i]) && known != truth.end()) (*missing)[i] = known->second;
    }
  }
}

std::string csv_text(const DataTable& table) {
  std::string text;
  auto out = std::back_inserter(text);
  for (std::size_t k = 0; k < table.columns.size(); ++k) {
    fmt::format_to(out, "{}{}", k == 0 ? "" : ",", table.columns[k].name);
  }
  text += '\n';
  for (std::size_t i = 0; i < table.rows(); ++i) {
    for (std::size_t k = 0; k < table.columns.size(); ++k) {
      if (k > 0) text += ',';
      const auto& values = table.columns[k].values;
      if (const auto* reals = std::get_if<std::vector<double>>(&values)) {
        if (!std::isnan((*reals)[i])) fmt::format_to(out, "{}", (*reals)[i]);
      } else if (const auto* integers = std::get_if<std::vector<std::int64_t>>(&values)) {
        if ((*integers)[i] != LogRecord::kNoTime) fmt::format_to(out, "{}", (*integers)[i]);
      } else {
        text += std::get<std::vector<std::string>>(values)[i];
      }
    }
    text += '\n';
  }
  return text;
}

}  // namespace photocoag
