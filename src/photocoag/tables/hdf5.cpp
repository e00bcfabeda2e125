// A table as an HDF5 file: one dataset per column in the group "cycles", texts as attributes.
#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <filesystem>

#include "photocoag/core/error.hpp"
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
  ~Handle() { close_(id_); }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  operator hid_t() const noexcept { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

Handle text_type(std::size_t length) {
  const hid_t type = H5Tcopy(H5T_C_S1);
  need(H5Tset_size(type, std::max<std::size_t>(1, length)));
  need(H5Tset_cset(type, H5T_CSET_UTF8));
  need(H5Tset_strpad(type, H5T_STR_NULLPAD));
  return {type, H5Tclose};
}

void attribute(hid_t object, const std::string& name, const std::string& text) {
  const Handle type = text_type(text.size());
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle written(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT),
                       H5Aclose);
  need(H5Awrite(written, type, text.c_str()));
}

void column(hid_t group, const TableColumn& column) {
  const hsize_t size = column.size();
  const Handle space(H5Screate_simple(1, &size, nullptr), H5Sclose);
  const auto dataset = [&](hid_t disk, hid_t memory, const void* values) {
    const Handle data(H5Dcreate2(group, column.name.c_str(), disk, space, H5P_DEFAULT, H5P_DEFAULT,
                                 H5P_DEFAULT),
                      H5Dclose);
    if (size > 0) need(H5Dwrite(data, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values));
    attribute(data, "unit", column.unit);
  };
  if (const auto* reals = std::get_if<std::vector<double>>(&column.values)) {
    dataset(H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, reals->data());
  } else if (const auto* integers = std::get_if<std::vector<std::int64_t>>(&column.values)) {
    dataset(H5T_STD_I64LE, H5T_NATIVE_INT64, integers->data());
  } else {
    const auto& words = std::get<std::vector<std::string>>(column.values);
    std::size_t longest = 1;
    for (const std::string& word : words) longest = std::max(longest, word.size());
    std::string cells(longest * words.size(), '\0');
    for (std::size_t i = 0; i < words.size(); ++i) {
      std::copy(words[i].begin(), words[i].end(), cells.begin() + static_cast<std::ptrdiff_t>(i * longest));
    }
    const Handle type = text_type(longest);
    dataset(type, type, cells.data());
  }
}

}  // namespace

void write_hdf5(const std::string& file, const Table& table) {
  const std::string part = file + ".part";
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // our own message is enough
  try {
    const Handle out(H5Fcreate(part.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose);
    const Handle group(H5Gcreate2(out, "cycles", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
    for (const TableColumn& one : table.columns) column(group, one);
    for (const auto& [name, text] : table.about) attribute(out, name, text);
  } catch (const Error& error) {
    std::error_code ignored;
    std::filesystem::remove(part, ignored);
    throw error.at(file);
  }
  std::filesystem::rename(part, file);
}

}  // namespace photocoag
