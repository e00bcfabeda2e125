#include "photocoag/campaign/results_file.hpp"

#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/run_files/hdf5_file.hpp"

namespace photocoag {
namespace {

using namespace hdf5;

void count_attribute(hid_t object, const char* name, std::uint64_t value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(object, name, H5T_STD_U64LE, space, H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose);
  need(H5Awrite(attribute, H5T_NATIVE_UINT64, &value));
}

std::string describe(const RandomQuantity& input) {
  switch (input.distribution) {
    case Distribution::kNormal:
      return fmt::format("normal, mean {}, standard deviation {}, truncated to [{}, {}]",
                         input.center, input.spread, input.low, input.high);
    case Distribution::kLogNormal:
      return fmt::format(
          "log-normal, median {}, standard deviation of the logarithm {}, truncated to [{}, {}]",
          input.center, input.spread, input.low, input.high);
    case Distribution::kUniform:
      break;
  }
  return fmt::format("uniform, [{}, {}]", input.low, input.high);
}

struct Column {
  std::string name;
  std::string unit;
  std::string meaning;
};

std::vector<Column> columns_of(const Campaign& campaign) {
  std::vector<Column> columns = {{"spot", "1", "number of the spot"},
                                 {"noise_seed", "1", "run.seed of the spot"}};
  for (const RandomQuantity& input : campaign.inputs) {
    columns.push_back({input.key, std::string(input_unit(input.key)), describe(input)});
  }
  for (const OutcomeColumn& outcome : outcome_columns()) {
    columns.push_back(
        {std::string(outcome.name), std::string(outcome.unit), std::string(outcome.meaning)});
  }
  return columns;
}

}  // namespace

void write_results(const std::filesystem::path& file, const Campaign& campaign,
                   const std::vector<SpotRecord>& spots) {
  const std::vector<Column> columns = columns_of(campaign);
  const std::size_t row_bytes = columns.size() * 8;
  std::vector<char> rows(row_bytes * spots.size());
  for (std::size_t k = 0; k < spots.size(); ++k) {
    char* at = rows.data() + k * row_bytes;
    const auto put = [&at](const void* value) {
      std::memcpy(at, value, 8);
      at += 8;
    };
    put(&spots[k].spot);
    put(&spots[k].noise_seed);
    for (const double value : spots[k].inputs) put(&value);
    for (const double value : spots[k].outcomes) put(&value);
  }
  const Handle out = file_in_memory();
  const Handle memory(H5Tcreate(H5T_COMPOUND, row_bytes), H5Tclose);
  const Handle disk(H5Tcreate(H5T_COMPOUND, row_bytes), H5Tclose);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const bool count = i < 2;
    need(H5Tinsert(memory, columns[i].name.c_str(), i * 8,
                   count ? H5T_NATIVE_UINT64 : H5T_NATIVE_DOUBLE));
    need(H5Tinsert(disk, columns[i].name.c_str(), i * 8, count ? H5T_STD_U64LE : H5T_IEEE_F64LE));
  }
  const hsize_t size = spots.size();
  const Handle space(H5Screate_simple(1, &size, nullptr), H5Sclose);
  const Handle how(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  need(H5Pset_obj_track_times(how, false));  // the same campaign, the same bytes
  const Handle table(H5Dcreate2(out, "spots", disk, space, H5P_DEFAULT, how, H5P_DEFAULT),
                     H5Dclose);
  if (!spots.empty()) need(H5Dwrite(table, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, rows.data()));
  for (std::size_t i = 0; i < columns.size(); ++i) {
    text_attribute(table, ("unit of " + columns[i].name).c_str(), columns[i].unit);
    text_attribute(table, ("meaning of " + columns[i].name).c_str(), columns[i].meaning);
  }
  text_attribute(out, "notice", std::string(kResearchNotice));
  text_attribute(out, "program", fmt::format("photocoag {}", version()));
  text_attribute(out, "source_hash", std::string(source_hash()));
  text_attribute(out, "campaign_toml", campaign.text);
  text_attribute(out, "config_toml", to_toml(campaign.config));
  text_attribute(out, "config_sha256", config_sha256(campaign.config));
  count_attribute(out, "seed", campaign.seed);
  count_attribute(out, "spots_wanted", campaign.spots);
  write_file(file.string(), image_of(out));
}

}  // namespace photocoag
