#include "photocoag/run/device_address.hpp"

#include <filesystem>

namespace photocoag {
namespace {

// Where LIBRARY ends in "LIBRARY[,SETTINGS]": both may hold commas. The longest part that is a
// file; without any, a name for the loader's own search, which has none.
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
  DeviceAddress address;
  const std::size_t colon = text.find(':');
  const std::string kind = text.substr(0, colon);
  std::string rest = colon == std::string::npos ? "" : text.substr(colon + 1);
  const bool bad = colon != std::string::npos && rest.empty();
  if (kind == "driver" && !rest.empty() && rest.front() != ',') {
    address.kind = DeviceAddress::Kind::kDriver;
    const std::size_t comma = end_of_library(rest);
    address.path = rest.substr(0, comma);
    if (comma < rest.size()) address.settings = rest.substr(comma + 1);
    return address;
  }
  if ((kind != "eye" && kind != "eye+socket") || bad) {
    throw Error(ErrorParts{
        .where = "--device",
        .found = text,
        .accepted = "eye, eye:SOCKET, eye+socket[:SOCKET] or driver:LIBRARY[,SETTINGS]"});
  }
  address.over_socket = kind == "eye+socket";
  address.own_process = rest.empty();
  address.path = rest;
  return address;
}

}  // namespace photocoag
