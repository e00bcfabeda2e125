#include "photocoag/core/files.hpp"

#include <unistd.h>

#include <fmt/format.h>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

[[noreturn]] void fail(const std::string& path, std::string problem, std::string accepted = {}) {
  throw Error(
      ErrorParts{.where = path, .problem = std::move(problem), .accepted = std::move(accepted)});
}

}  // namespace

std::string read_file(const std::string& path, std::size_t max_bytes) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (error || !std::filesystem::exists(status)) {
    fail(path, error ? "cannot be read: " + error.message() : "no such file");
  }
  // A pipe or a device could block or never end.
  if (!std::filesystem::is_regular_file(status)) fail(path, "not a regular file");
  const auto size = std::filesystem::file_size(path, error);
  if (error) fail(path, "cannot be read: " + error.message());
  if (size > max_bytes) {
    fail(path, fmt::format("too large: {} bytes", size),
         fmt::format("at most {} bytes", max_bytes));
  }
  std::ifstream stream(path, std::ios::binary);
  std::string content(size, '\0');
  if (!stream || !stream.read(content.data(), static_cast<std::streamsize>(size))) {
    fail(path, "cannot be read");
  }
  return content;
}

void write_file(const std::string& path, std::string_view content) {
  const std::string temporary = fmt::format("{}.part{}", path, getpid());
  {
    std::ofstream stream(temporary, std::ios::binary | std::ios::trunc);
    stream.write(content.data(), static_cast<std::streamsize>(content.size()));
    stream.flush();
    if (!stream) {
      std::error_code ignored;
      std::filesystem::remove(temporary, ignored);
      fail(path, "cannot be written: does the folder exist, and is there room?");
    }
  }
  std::error_code error;
  std::filesystem::rename(temporary, path, error);
  if (error) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    fail(path, "cannot be written: " + error.message());
  }
}

}  // namespace photocoag
