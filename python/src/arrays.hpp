// Role: the Python package; numbers to and from NumPy, always double, always copied or owned.
#pragma once

#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "photocoag/core/error.hpp"
#include "photocoag/core/outputs.hpp"

namespace photocoag::python {

namespace nb = nanobind;

template <typename T>
nb::object array_of(const T* values, std::vector<std::size_t> shape) {
  std::size_t size = 1;
  for (const std::size_t n : shape) size *= n;
  T* copy = new T[size];
  if (size > 0) std::memcpy(copy, values, size * sizeof(T));
  const nb::capsule owner(copy, [](void* p) noexcept { delete[] static_cast<T*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, T>(copy, shape.size(), shape.data(), owner));
}

template <typename T>
nb::object array_of(const std::vector<T>& values) {
  return array_of(values.data(), {values.size()});
}

/// A matrix as rows x columns in C order; a column vector as a one-dimensional array.
template <typename D>
nb::object array_of(const Eigen::MatrixBase<D>& matrix) {
  const auto rows = static_cast<std::size_t>(matrix.rows());
  const auto columns = static_cast<std::size_t>(matrix.cols());
  const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> copy = matrix;
  if (D::ColsAtCompileTime == 1) return array_of(copy.data(), {rows});
  return array_of(copy.data(), {rows, columns});
}

/// Text of a value for an error message, at most 80 characters.
inline std::string found(nb::handle value) {
  constexpr std::size_t kMost = 80;
  PyObject* text = PyObject_Repr(value.ptr());
  if (text == nullptr) {
    PyErr_Clear();
    return "?";
  }
  const nb::object owned = nb::steal<nb::object>(text);
  const char* utf8 = PyUnicode_AsUTF8AndSize(text, nullptr);
  if (utf8 == nullptr) {
    PyErr_Clear();
    return "?";
  }
  std::string result(utf8);
  return result.size() > kMost ? result.substr(0, kMost) + "..." : result;
}

[[noreturn]] inline void refuse(const std::string& key, nb::handle value, std::string accepted) {
  throw Error(ErrorParts{.key = key, .found = found(value), .accepted = std::move(accepted)});
}

/// A real number: int, float or an object with __float__ or __index__; no bool, no text.
inline double number_of(const std::string& key, nb::handle value, const char* accepted,
                        bool may_be_nan = false) {
  const double number = PyBool_Check(value.ptr()) || PyUnicode_Check(value.ptr())
                            ? std::nan("")
                            : PyFloat_AsDouble(value.ptr());
  if (PyErr_Occurred() != nullptr) {
    PyErr_Clear();
    refuse(key, value, accepted);
  }
  const bool is_number = PyFloat_Check(value.ptr()) || std::isfinite(number);
  if (!is_number || (!may_be_nan && !std::isfinite(number))) refuse(key, value, accepted);
  return number;
}

/// A one-dimensional sequence of finite numbers; `size` 0: any length. Throws Error.
inline std::vector<double> numbers_of(const std::string& key, nb::handle value, std::size_t size,
                                      const std::string& accepted) {
  if (PyUnicode_Check(value.ptr()) || PyBytes_Check(value.ptr())) refuse(key, value, accepted);
  const nb::object sequence = nb::steal<nb::object>(PySequence_Fast(value.ptr(), ""));
  if (!sequence.is_valid()) {
    PyErr_Clear();
    refuse(key, value, accepted);
  }
  std::vector<double> numbers;
  for (const nb::handle item : nb::cast<nb::iterable>(sequence)) {
    numbers.push_back(number_of(key, item, accepted.c_str()));
  }
  if (size > 0 && numbers.size() != size) refuse(key, value, accepted);
  return numbers;
}

}  // namespace photocoag::python
