// A table as an HDF5 file: one dataset per column in the group "cycles", texts as attributes.
#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <utility>

#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/utf8.hpp"
#include "photocoag/tables/table.hpp"

namespace photocoag {
namespace {

[[noreturn]] void fail() { throw Error("HDF5 refused to write the table"); }

void need(herr_t status) {
  if (status < 0) fail();
}

// An identifier that closes itself.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {
    if (id_ < 0) fail();
  }
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle& operator=(Handle&&) = delete;
  operator hid_t() const noexcept { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

// The library replaces what is no regular file: it gets a file in memory.
Handle file_in_memory() {
  constexpr std::size_t kGrowth = std::size_t{1} << 20U;  // bytes
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  need(H5Pset_fapl_core(access, kGrowth, 0));
  return {H5Fcreate("memory", H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose};
}

std::string image_of(hid_t file) {
  need(H5Fflush(file, H5F_SCOPE_GLOBAL));
  const ssize_t size = H5Fget_file_image(file, nullptr, 0);
  need(size < 0 ? -1 : 0);
  std::string image(static_cast<std::size_t>(size), '\0');
  need(H5Fget_file_image(file, image.data(), image.size()) == size ? 0 : -1);
  return image;
}

// Octave reads no text that is declared as UTF-8: only what needs it is.
Handle text_type(std::size_t length, bool ascii) {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  need(H5Tset_size(type, std::max<std::size_t>(1, length)));
  need(H5Tset_cset(type, ascii ? H5T_CSET_ASCII : H5T_CSET_UTF8));
  need(H5Tset_strpad(type, H5T_STR_NULLPAD));
  return type;
}

void attribute(hid_t object, const std::string& name, const std::string& value) {
  const std::string text = valid_utf8(value);
  const Handle type = text_type(text.size(), is_ascii(text));
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle written(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT),
                       H5Aclose);
  need(H5Awrite(written, type, text.c_str()));
}

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
    attribute(data, "unit", column.unit);
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

void write_hdf5(const std::string& file, const Table& table) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // our own message is enough
  try {
    const Handle out = file_in_memory();
    const Handle group(H5Gcreate2(out, "cycles", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
    for (const TableColumn& one : table.columns) column(group, one);
    for (const auto& [key, text] : table.about) attribute(out, key, text);
    write_file(file, image_of(out));
  } catch (const Error& error) {
    throw error.at(file);
  }
}

}  // namespace photocoag
