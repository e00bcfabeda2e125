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

}  // namespace

DeviceAddress parse_device(const std::string& text) {
  const std::size_t colon = text.find(':');
  std::string rest = colon == std::string::npos ? "" : text.substr(colon + 1);
  const auto* word = std::find_if(
      kDeviceWords.begin(), kDeviceWords.end(),
      [name = text.substr(0, colon)](const DeviceWord& one) { return one.word == name; });
  const bool known = word != kDeviceWords.end();
  const bool no_path = rest.empty() || rest.front() == ',';
  if (!known || (word->library ? no_path : rest.empty() && colon != std::string::npos)) {
    throw Error(
        ErrorParts{.where = "--device", .found = text, .accepted = std::string(kDeviceForms)});
  }
  DeviceAddress address{.kind = word->kind, .own_process = rest.empty(), .path = std::move(rest)};
  if (word->library) {
    const std::size_t comma = end_of_library(address.path);
    if (comma < address.path.size()) {
      address.settings = address.path.substr(comma + 1);
      address.path.resize(comma);
    }
  }
  return address;
}

Use use_of(const DeviceAddress& place) noexcept {
  for (const DeviceWord& word : kDeviceWords) {
    if (word.kind == place.kind) return word.use;
  }
  return place.kind == DeviceAddress::Kind::kPaced ? Use::kTreat : Use::kSimulate;
}

}  // namespace photocoag
