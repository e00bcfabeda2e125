#include "photocoag/run/device_address.hpp"

namespace photocoag {

DeviceAddress parse_device(const std::string& text) {
  DeviceAddress address;
  const std::size_t colon = text.find(':');
  const std::string kind = text.substr(0, colon);
  std::string rest = colon == std::string::npos ? "" : text.substr(colon + 1);
  const bool bad = colon != std::string::npos && rest.empty();
  if (kind == "driver" && !rest.empty()) {
    address.kind = DeviceAddress::Kind::kDriver;
    const std::size_t comma = rest.find(',');
    address.path = rest.substr(0, comma);
    if (comma != std::string::npos) address.settings = rest.substr(comma + 1);
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
