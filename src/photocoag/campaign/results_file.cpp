#include "photocoag/campaign/results_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <bit>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/descriptor.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/run_files/hdf5_file.hpp"

namespace photocoag {
namespace {

using namespace hdf5;
namespace fs = std::filesystem;

// Rows are written and read directly, not through HDF5, for better error messages about the disk;
// the layout in memory is that of the file.
static_assert(std::endian::native == std::endian::little);

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

// Writes the file with space for the rows; returns their offset in bytes.
std::uint64_t write_frame(const fs::path& file, const Campaign& campaign, std::uint64_t rows) {
  const std::vector<Column> columns = columns_of(campaign);
  const std::size_t row_bytes = columns.size() * 8;
  const Handle out(H5Fcreate(file.c_str(), H5F_ACC_EXCL, H5P_DEFAULT, H5P_DEFAULT), H5Fclose);
  const Handle memory(H5Tcreate(H5T_COMPOUND, row_bytes), H5Tclose);
  const Handle disk(H5Tcreate(H5T_COMPOUND, row_bytes), H5Tclose);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const bool count = i < 2;
    need(H5Tinsert(memory, columns[i].name.c_str(), i * 8,
                   count ? H5T_NATIVE_UINT64 : H5T_NATIVE_DOUBLE));
    need(H5Tinsert(disk, columns[i].name.c_str(), i * 8, count ? H5T_STD_U64LE : H5T_IEEE_F64LE));
  }
  const hsize_t size = rows;
  const Handle space(H5Screate_simple(1, &size, nullptr), H5Sclose);
  const Handle how(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  need(H5Pset_obj_track_times(how, false));  // the same campaign, the same bytes
  const Handle table(H5Dcreate2(out, "spots", disk, space, H5P_DEFAULT, how, H5P_DEFAULT),
                     H5Dclose);
  if (rows > 0) {
    // The first row makes HDF5 allot the room for all of them.
    const hsize_t first = 0;
    const hsize_t one = 1;
    need(H5Sselect_hyperslab(space, H5S_SELECT_SET, &first, nullptr, &one, nullptr));
    const Handle row(H5Screate_simple(1, &one, nullptr), H5Sclose);
    const std::vector<char> zeros(row_bytes);
    need(H5Dwrite(table, memory, row, space, H5P_DEFAULT, zeros.data()));
  }
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
  need(H5Fflush(out, H5F_SCOPE_GLOBAL));
  return rows > 0 ? H5Dget_offset(table) : 0;
}

Descriptor open_table(const fs::path& file, int how) {
  Descriptor opened(open(file.c_str(), how | O_CLOEXEC | O_NOFOLLOW));
  if (!opened.open()) fail_by_errno(file.string(), "cannot be opened");
  return opened;
}

// Puts blocks into their rows of `table`. They come nearly in order: many neighbours are written at
// once.
class RowWriter {
 public:
  RowWriter(const fs::path& table, std::uint64_t offset, std::size_t row_size, const SpotSet& spots)
      : name_(table.string()),
        file_(open_table(table, O_WRONLY)),
        offset_(offset),
        row_size_(row_size),
        row_of_(spots) {}

  void add(const double* block) {
    rows_.push_back({row_of_(std::bit_cast<std::uint64_t>(block[0])), rows_.size()});
    blocks_.insert(blocks_.end(), block, block + row_size_);
    if (rows_.size() == kChunk) flush();
  }
  void flush() {
    std::sort(rows_.begin(), rows_.end());
    for (std::size_t i = 0; i < rows_.size();) {
      const std::uint64_t first = rows_[i].first;
      run_.clear();
      for (; i < rows_.size() && rows_[i].first == first + run_.size() / row_size_; ++i) {
        const double* const block = blocks_.data() + rows_[i].second * row_size_;
        run_.insert(run_.end(), block, block + row_size_);
      }
      if (!file_.write_at(run_.data(), run_.size() * sizeof(double),
                          offset_ + first * row_size_ * sizeof(double))) {
        fail_by_errno(name_, "cannot be written");
      }
    }
    rows_.clear();
    blocks_.clear();
  }

 private:
  static constexpr std::size_t kChunk = 8192;  // rows

  std::string name_;
  Descriptor file_;
  std::uint64_t offset_;
  std::size_t row_size_;
  RowOfSpot row_of_;
  std::vector<std::pair<std::uint64_t, std::size_t>> rows_;  // and their places in blocks_
  std::vector<double> blocks_;
  std::vector<double> run_;
};

}  // namespace

std::size_t bytes_per_row(const Campaign& campaign) {
  return block_size(campaign.inputs.size()) * sizeof(double);
}

void write_results(const fs::path& file, const Campaign& campaign, const Journal& journal) {
  const fs::path part = file.string() + ".part";
  std::error_code ignored;
  fs::remove(part, ignored);
  try {
    const std::uint64_t rows = journal.spots().size();
    const std::uint64_t offset = write_frame(part, campaign, rows);
    if (rows > 0) {
      RowWriter writer(part, offset, block_size(campaign.inputs.size()), journal.spots());
      journal.for_each([&writer](const double* block) { writer.add(block); });
      writer.flush();
    }
    std::error_code error;
    fs::rename(part, file, error);
    if (!error) return;
    throw Error(
        ErrorParts{.where = file.string(), .problem = "cannot be written: " + error.message()});
  } catch (...) {
    fs::remove(part, ignored);
    throw;
  }
}

SpotRows open_results(const fs::path& file, const Campaign& campaign) {
  SpotRows rows{.count = 0, .inputs = campaign.inputs.size(), .read = {}};
  std::uint64_t offset = 0;
  {
    const Handle in(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
    const Handle table(H5Dopen2(in, "spots", H5P_DEFAULT), H5Dclose);
    const Handle space(H5Dget_space(table), H5Sclose);
    rows.count = static_cast<std::uint64_t>(H5Sget_simple_extent_npoints(space));
    if (rows.count > 0) offset = H5Dget_offset(table);
  }
  const auto in = std::make_shared<const Descriptor>(open_table(file, O_RDONLY));
  rows.read = [in, name = file.string(), offset, bytes = bytes_per_row(campaign)](
                  std::uint64_t first, std::size_t count, double* blocks) {
    if (in->read_all_at(blocks, count * bytes, offset + first * bytes)) return;
    fail_by_errno(name, "cannot be read");
  };
  return rows;
}

}  // namespace photocoag
