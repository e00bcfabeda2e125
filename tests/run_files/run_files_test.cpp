// Tables of a run as other programs read them.
#include <gtest/gtest.h>
#include <hdf5.h>
#include <matio.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "photocoag/core/files.hpp"
#include "photocoag/run_files/table.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag {
namespace {

using testing::TemporaryFolder;

const std::string kInvalid = "l\xE4uft";  // Latin 1

DataTable example() {
  return {
      .about = {{"ascii", "run"}, {"umlaut", "läuft"}, {"invalid", kInvalid}, {"empty", ""}},
      .columns = {
          {.name = "power_W", .unit = "W", .values = std::vector<double>{0.1, 0.2}},
          {.name = "word", .unit = "1", .values = std::vector<std::string>{"solved", "no"}},
          {.name = "name", .unit = "1", .values = std::vector<std::string>{"läuft", kInvalid}}}};
}

// An HDF5 text as Octave reads it: H5T_C_S1 of the size on disk, for what is ASCII.
std::string read_text(hid_t object, hid_t type, bool is_dataset, std::size_t count = 1) {
  EXPECT_EQ(H5Tis_variable_str(type), 0);
  const std::size_t size = H5Tget_size(type);
  const hid_t memory = H5Tcopy(H5T_C_S1);
  H5Tset_size(memory, size);
  H5Tset_strpad(memory, H5T_STR_NULLPAD);
  H5Tset_cset(memory, H5Tget_cset(type));
  std::string text(size * count, '\0');
  const herr_t status = is_dataset
                            ? H5Dread(object, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data())
                            : H5Aread(object, memory, text.data());
  EXPECT_GE(status, 0);
  H5Tclose(memory);
  return text;
}

TEST(Hdf5, TextsHaveAFixedLengthAndAreUtf8OnlyWhereTheyMustBe) {
  const TemporaryFolder folder;
  write_hdf5(folder.file("t.h5"), example());
  const hid_t file = H5Fopen(folder.file("t.h5").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  ASSERT_GE(file, 0);
  const auto attribute = [&](const char* name, H5T_cset_t cset) {
    const hid_t one = H5Aopen(file, name, H5P_DEFAULT);
    const hid_t type = H5Aget_type(one);
    EXPECT_EQ(H5Tget_cset(type), cset) << name;
    const std::string text = read_text(one, type, false);
    H5Tclose(type);
    H5Aclose(one);
    return text;
  };
  EXPECT_EQ(attribute("ascii", H5T_CSET_ASCII), "run");
  EXPECT_EQ(attribute("umlaut", H5T_CSET_UTF8), "läuft");
  EXPECT_EQ(attribute("invalid", H5T_CSET_UTF8), "l\xEF\xBF\xBDuft");
  const auto column = [&](const char* name, H5T_cset_t cset) {
    const hid_t data = H5Dopen2(file, name, H5P_DEFAULT);
    const hid_t type = H5Dget_type(data);
    EXPECT_EQ(H5Tget_cset(type), cset) << name;
    const std::string text = read_text(data, type, true, 2);
    H5Tclose(type);
    H5Dclose(data);
    return text;
  };
  using std::string_literals::operator""s;
  EXPECT_EQ(column("cycles/word", H5T_CSET_ASCII), "solvedno\0\0\0\0"s);
  EXPECT_EQ(column("cycles/name", H5T_CSET_UTF8),
            "läuft\0"s.substr(0, 6) + "\0"s + "l\xEF\xBF\xBDuft");
  H5Fclose(file);
}

TEST(Mat, TextsCountCharactersNotBytes) {
  const TemporaryFolder folder;
  write_mat(folder.file("t.mat"), example());
  struct Close {
    void operator()(mat_t* file) const { Mat_Close(file); }
    void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
  };
  const std::unique_ptr<mat_t, Close> file(Mat_Open(folder.file("t.mat").c_str(), MAT_ACC_RDONLY));
  ASSERT_NE(file, nullptr);
  const std::unique_ptr<matvar_t, Close> about(Mat_VarRead(file.get(), "about"));
  ASSERT_NE(about, nullptr);
  const auto text = [&](const char* name) {
    const matvar_t* field = Mat_VarGetStructFieldByName(about.get(), name, 0);
    if (field == nullptr || field->class_type != MAT_C_CHAR || field->rank != 2)
      return std::u16string();
    EXPECT_EQ(field->data_type, MAT_T_UTF16) << name;
    const auto* units = static_cast<const char16_t*>(field->data);
    return std::u16string(units, units + field->dims[0] * field->dims[1]);
  };
  EXPECT_EQ(text("ascii"), u"run");
  EXPECT_EQ(text("umlaut"), u"läuft");
  EXPECT_EQ(text("invalid"), u"l\uFFFDuft");
  EXPECT_EQ(text("empty"), u"");
}

LogContent device_log(int schema, double truth) {
  LogHeader header;
  header.schema = schema;
  header.program = "p";
  header.device = "eye, socket";
  header.period = 1e-3;
  std::string bytes = segment_header(header);
  std::vector<std::byte> block(sizeof(BlockHeader) + log_record_bytes());
  BlockHeader head;
  head.records = 1;
  head.totals = {.produced = 1, .written = 1, .dropped = 0};
  LogRecord record;
  record.cycle = 7;
  record.truth = {.volume = truth, .peak = truth};
  std::memcpy(block.data(), &head, sizeof(head));
  pack(record, block.data() + sizeof(head));
  seal_block(block);
  bytes.append(reinterpret_cast<const char*>(block.data()), block.size());
  return parse_segment(bytes, "t.seg");
}

const std::vector<double>& reals(const DataTable& table, std::string_view name) {
  for (const TableColumn& column : table.columns) {
    if (column.name == name) return std::get<std::vector<double>>(column.values);
  }
  throw std::runtime_error("no such column");
}

// Logs of schema 2 said 0 of what a device does not tell.
TEST(Truth, WhatADeviceDoesNotTellIsNoNumber) {
  for (const DataTable& table :
       {table_of(device_log(2, 0.0)), table_of(device_log(kLogSchema, LogRecord::kNone))}) {
    EXPECT_TRUE(std::isnan(reals(table, "peak_true_K").at(0)));
    EXPECT_TRUE(std::isnan(reals(table, "volume_true_K").at(0)));
  }
  EXPECT_EQ(reals(table_of(device_log(kLogSchema, 3.5)), "peak_true_K").at(0), 3.5);
}

TEST(Truth, ComesFromTheTableOfTheSameRunWhereTheEyeHasToldIt) {
  DataTable log = table_of(device_log(kLogSchema, LogRecord::kNone));
  const TemporaryFolder folder;
  write_file(folder.file("run.csv"), "cycle,volume_true_K,peak_true_K\n6,1,2\n7,3,4\n8,,\n");
  add_truth(log, table_of_csv(folder.file("run.csv")));
  EXPECT_EQ(reals(log, "volume_true_K").at(0), 3.0);
  EXPECT_EQ(reals(log, "peak_true_K").at(0), 4.0);
}

}  // namespace
}  // namespace photocoag
