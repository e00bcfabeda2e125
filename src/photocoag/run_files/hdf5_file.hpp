// Role: offline; helpers for HDF5 files: handles, a file in memory, texts. Used by run_files and
// campaign. Source: the HDF5 reference manual, 1.10. Throws Error. Real time: none. Threads: one at
// a time, as HDF5 requires.
#pragma once

#include <hdf5.h>

#include <algorithm>
#include <string>
#include <utility>

#include "photocoag/core/error.hpp"
#include "photocoag/core/utf8.hpp"

namespace photocoag::hdf5 {

/// Throws Error if an HDF5 call has failed.
inline void need(herr_t status) {
  if (status < 0) throw Error("HDF5 refused to write the file");
}

/// An identifier that closes itself. Throws Error if it is invalid.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) { need(id_ < 0 ? -1 : 0); }
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

/// A file in memory: on disk the library would replace non-regular files.
inline Handle file_in_memory() {
  constexpr std::size_t kGrowth = std::size_t{1} << 20U;  // bytes
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  need(H5Pset_fapl_core(access, kGrowth, 0));
  return {H5Fcreate("memory", H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose};
}

/// The file's bytes.
inline std::string image_of(hid_t file) {
  need(H5Fflush(file, H5F_SCOPE_GLOBAL));
  const ssize_t size = H5Fget_file_image(file, nullptr, 0);
  need(size < 0 ? -1 : 0);
  std::string image(static_cast<std::size_t>(size), '\0');
  need(H5Fget_file_image(file, image.data(), image.size()) == size ? 0 : -1);
  return image;
}

/// Texts of `length` bytes. Declared as UTF-8 only if necessary, since Octave does not read that.
inline Handle text_type(std::size_t length, bool ascii) {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  need(H5Tset_size(type, std::max<std::size_t>(1, length)));
  need(H5Tset_cset(type, ascii ? H5T_CSET_ASCII : H5T_CSET_UTF8));
  need(H5Tset_strpad(type, H5T_STR_NULLPAD));
  return type;
}

inline void text_attribute(hid_t object, const std::string& name, const std::string& value) {
  const std::string text = valid_utf8(value);
  const Handle type = text_type(text.size(), is_ascii(text));
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose);
  need(H5Awrite(attribute, type, text.c_str()));
}

}  // namespace photocoag::hdf5
