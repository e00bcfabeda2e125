// A table as a MAT file (version 5): struct "cycles" with one field per column, struct "units",
// struct "about".
#include <matio.h>

#include <memory>

#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/utf8.hpp"
#include "photocoag/run_files/table.hpp"

namespace photocoag {
namespace {

struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
struct CloseFile {
  void operator()(mat_t* file) const { Mat_Close(file); }
};
using Variable = std::unique_ptr<matvar_t, FreeVariable>;

// Without the time, so that the same run gives the same bytes.
constexpr const char* kHeader = "MATLAB 5.0 MAT-file, photocoag";

// The library copies its argument but takes a non-const pointer.
void* unchanged(const void* data) { return const_cast<void*>(data); }

matvar_t* checked(matvar_t* variable) {
  if (variable == nullptr) throw Error("the MAT library refused a variable");
  return variable;
}

// UTF-16, as MATLAB writes it: the size of a text is the number of its characters.
matvar_t* text(const std::string& value) {
  const std::u16string units = to_utf16(value);
  std::size_t size[2] = {units.empty() ? 0U : 1U, units.size()};
  return checked(
      Mat_VarCreate(nullptr, MAT_C_CHAR, MAT_T_UTF16, 2, size, unchanged(units.data()), 0));
}

matvar_t* column(const TableColumn& column) {
  std::size_t size[2] = {column.size(), 1};
  if (const auto* reals = std::get_if<std::vector<double>>(&column.values)) {
    return checked(
        Mat_VarCreate(nullptr, MAT_C_DOUBLE, MAT_T_DOUBLE, 2, size, unchanged(reals->data()), 0));
  }
  if (const auto* integers = std::get_if<std::vector<std::int64_t>>(&column.values)) {
    return checked(
        Mat_VarCreate(nullptr, MAT_C_INT64, MAT_T_INT64, 2, size, unchanged(integers->data()), 0));
  }
  const auto& words = std::get<std::vector<std::string>>(column.values);
  matvar_t* cells = checked(Mat_VarCreate(nullptr, MAT_C_CELL, MAT_T_CELL, 2, size, nullptr, 0));
  for (std::size_t i = 0; i < words.size(); ++i) {
    Mat_VarSetCell(cells, static_cast<int>(i), text(words[i]));
  }
  return cells;
}

Variable structure(const char* name, const std::vector<const char*>& fields) {
  std::size_t size[2] = {1, 1};
  return Variable(
      checked(Mat_VarCreateStruct(name, 2, size, const_cast<const char**>(fields.data()),
                                  static_cast<unsigned>(fields.size()))));
}

}  // namespace

void write_mat(const std::string& file, const DataTable& table) {
  std::vector<const char*> names;
  for (const TableColumn& one : table.columns) names.push_back(one.name.c_str());
  std::vector<const char*> about_names;
  for (const auto& [name, value] : table.about) about_names.push_back(name.c_str());
  const Variable cycles = structure("cycles", names);
  const Variable units = structure("units", names);
  const Variable about = structure("about", about_names);
  for (const TableColumn& one : table.columns) {
    Mat_VarSetStructFieldByName(cycles.get(), one.name.c_str(), 0, column(one));
    Mat_VarSetStructFieldByName(units.get(), one.name.c_str(), 0, text(one.unit));
  }
  for (const auto& [name, value] : table.about) {
    Mat_VarSetStructFieldByName(about.get(), name.c_str(), 0, text(value));
  }
  write_file(
      file, written_by([&](const std::string& name) {
        const std::unique_ptr<mat_t, CloseFile> out(
            Mat_CreateVer(name.c_str(), kHeader, MAT_FT_MAT5));
        bool good = out != nullptr;
        for (matvar_t* variable : {cycles.get(), units.get(), about.get()}) {
          good = good && Mat_VarWrite(out.get(), variable, MAT_COMPRESSION_NONE) == 0;
        }
        if (!good)
          throw Error(ErrorParts{.where = file, .problem = "the MAT file cannot be written"});
      }));
}

}  // namespace photocoag
