#include "photocoag/run/device_address.hpp"

#include <algorithm>
#include <filesystem>

namespace photocoag {
namespace {

// Where LIBRARY ends in "LIBRARY[,SETTINGS]": both may contain commas. The longest part that is a
// file; otherwise a name for the loader's search, which has no comma.
std::size_t end_of_library(const std::string& text) {
  std::error_code ignored;
  if (std::filesystem::is_regular_file(text, ignored)) return text.size();
  for (std::size_t at = text.rfind(','); at != std::string::npos && at > 0;
       at = text.rfind(',', at - 1)) {
    if (std::filesystem::is_regular_file(text.substr(0, at), ignored)) return at;
  }
  return text.find(',');
}

const DeviceWord* row_of(const DeviceAddress& place) noexcept {
  for (const DeviceWord& row : kDeviceWords) {
    if (row.kind == place.kind) return &row;
  }
  return nullptr;
}

}  // namespace

DeviceAddress parse_device(const std::string& text) {
  const std::size_t colon = text.find(':');
  std::string rest = colon == std::string::npos ? "" : text.substr(colon + 1);
  const auto* word = std::find_if(
      kDeviceWords.begin(), kDeviceWords.end(),
      [name = text.substr(0, colon)](const DeviceWord& one) { return one.word == name; });
  const auto fits = [&] {
    using Path = DeviceWord::Path;
    if (word->path == Path::kOptional && colon == std::string::npos) return true;
    return !rest.empty() && !(word->path == Path::kLibrary && rest.front() == ',');
  };
  if (word == kDeviceWords.end() || !fits()) {
    throw Error(
        ErrorParts{.where = "--device", .found = text, .accepted = std::string(kDeviceForms)});
  }
  DeviceAddress address{.kind = word->kind, .own_process = rest.empty(), .path = std::move(rest)};
  if (word->path == DeviceWord::Path::kLibrary) {
    const std::size_t comma = end_of_library(address.path);
    if (comma < address.path.size()) {
      address.settings = address.path.substr(comma + 1);
      address.path.resize(comma);
    }
  }
  return address;
}

Use use_of(const DeviceAddress& place) noexcept {
  if (const DeviceWord* row = row_of(place)) return row->use;
  return place.kind == DeviceAddress::Kind::kPaced ? Use::kTreat : Use::kSimulate;
}

std::string_view word_of(const DeviceAddress& place) noexcept {
  const DeviceWord* row = row_of(place);
  return row != nullptr ? row->word : std::string_view();
}

std::string describe(const DeviceAddress& place) {
  const DeviceWord* row = row_of(place);
  if (row == nullptr) return {};
  std::string text(row->described);
  return row->path == DeviceWord::Path::kOptional ? text : text + ", " + place.path;
}

}  // namespace photocoag
