#include "zip.hpp"

#include <minizip/zip.h>

#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"

namespace photocoag {
namespace {

void check(bool good) {
  if (!good) throw Error(ErrorParts{.where = "archive", .problem = "cannot be written"});
}

void add(zipFile archive, const FmuFile& file) {
  zip_fileinfo info{};
  info.tmz_date.tm_year = 1980;
  info.tmz_date.tm_mday = 1;
  check(zipOpenNewFileInZip(archive, file.name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr,
                            Z_DEFLATED, Z_DEFAULT_COMPRESSION) == ZIP_OK);
  check(zipWriteInFileInZip(archive, file.text.data(), static_cast<unsigned>(file.text.size())) ==
        ZIP_OK);
  check(zipCloseFileInZip(archive) == ZIP_OK);
}

}  // namespace

std::string zip_archive(const std::vector<FmuFile>& files) {
  return written_by([&files](const std::string& name) {
    zipFile archive = zipOpen(name.c_str(), APPEND_STATUS_CREATE);
    check(archive != nullptr);
    try {
      for (const FmuFile& file : files) add(archive, file);
    } catch (...) {
      zipClose(archive, nullptr);
      throw;
    }
    check(zipClose(archive, nullptr) == ZIP_OK);
  });
}

}  // namespace photocoag
