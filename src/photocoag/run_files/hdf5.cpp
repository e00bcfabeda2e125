// A table as an HDF5 file: one dataset per column in a group, texts as attributes.
#include <hdf5.h>

#include <algorithm>
#include <utility>

#include "photocoag/core/files.hpp"
#include "photocoag/core/utf8.hpp"
#include "photocoag/run_files/hdf5_file.hpp"
#include "photocoag/run_files/table.hpp"

namespace photocoag {
namespace {

using namespace hdf5;

void column(hid_t group, const TableColumn& column) {
  const hsize_t size = column.size();
  const Handle space(H5Screate_simple(1, &size, nullptr), H5Sclose);
  const Handle how(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  need(H5Pset_obj_track_times(how, false));  // the same run, the same bytes
  const auto dataset = [&](hid_t disk, hid_t memory, const void* values) {
    const Handle data(
        H5Dcreate2(group, column.name.c_str(), disk, space, H5P_DEFAULT, how, H5P_DEFAULT),
        H5Dclose);
    if (size > 0) need(H5Dwrite(data, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values));
    text_attribute(data, "unit", column.unit);
  };
  if (const auto* reals = std::get_if<std::vector<double>>(&column.values)) {
    dataset(H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, reals->data());
  } else if (const auto* integers = std::get_if<std::vector<std::int64_t>>(&column.values)) {
    dataset(H5T_STD_I64LE, H5T_NATIVE_INT64, integers->data());
  } else {
    std::vector<std::string> words;
    std::size_t longest = 1;
    bool ascii = true;
    for (const std::string& word : std::get<std::vector<std::string>>(column.values)) {
      words.push_back(valid_utf8(word));
      longest = std::max(longest, words.back().size());
      ascii = ascii && is_ascii(word);
    }
    std::string cells(longest * words.size(), '\0');
    for (std::size_t i = 0; i < words.size(); ++i) {
      std::copy(words[i].begin(), words[i].end(),
                cells.begin() + static_cast<std::ptrdiff_t>(i * longest));
    }
    const Handle type = text_type(longest, ascii);
    dataset(type, type, cells.data());
  }
}

}  // namespace

void write_hdf5(const std::string& file, const DataTable& table) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors are reported as exceptions
  try {
    const Handle out = file_in_memory();
    const Handle group(
        H5Gcreate2(out, table.rows_are.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
    for (const TableColumn& one : table.columns) column(group, one);
    for (const auto& [key, text] : table.about) text_attribute(out, key, text);
    write_file(file, image_of(out));
  } catch (const Error& error) {
    throw error.at(file);
  }
}

}  // namespace photocoag
