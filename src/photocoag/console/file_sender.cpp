#include "photocoag/console/file_sender.hpp"

#include <libwebsockets.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>
#include <utility>

namespace photocoag {
namespace {

constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

constexpr std::size_t kChunk = 8192;  // bytes of a file at a time

bool send_headers(lws* wsi, const WebFile& file) {
  std::array<unsigned char, LWS_PRE + 2048> buffer{};
  unsigned char* const start = buffer.data() + LWS_PRE;
  unsigned char* at = start;
  unsigned char* const end = buffer.data() + buffer.size() - 1;
  const auto add = [&](const char* name, std::string_view value) {
    return lws_add_http_header_by_name(wsi, reinterpret_cast<const unsigned char*>(name),
                                       reinterpret_cast<const unsigned char*>(value.data()),
                                       static_cast<int>(value.size()), &at, end) == 0;
  };
  return lws_add_http_common_headers(wsi, HTTP_STATUS_OK, file.type.c_str(), file.content.size(),
                                     &at, end) == 0 &&
         add("content-security-policy:", file.page ? kPolicy : "frame-ancestors 'none'") &&
         add("x-content-type-options:", "nosniff") && add("referrer-policy:", "no-referrer") &&
         add("cross-origin-resource-policy:", "same-origin") && add("cache-control:", "no-store") &&
         lws_finalize_write_http_header(wsi, start, &at, end) == 0;
}

}  // namespace

bool FileSender::begin(lws* wsi, WebFile file) {
  if (!send_headers(wsi, file)) return false;
  sending_[wsi] = {.file = std::move(file)};
  lws_callback_on_writable(wsi);
  return true;
}

bool FileSender::go_on(lws* wsi) {
  const auto found = sending_.find(wsi);
  if (found == sending_.end()) return true;
  Sending& now = found->second;
  std::array<unsigned char, LWS_PRE + kChunk> buffer{};
  const std::size_t count = std::min(kChunk, now.file.content.size() - now.sent);
  std::memcpy(buffer.data() + LWS_PRE, now.file.content.data() + now.sent, count);
  now.sent += count;
  const bool last = now.sent == now.file.content.size();
  if (lws_write(wsi, buffer.data() + LWS_PRE, count, last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) <
      0) {
    return false;
  }
  if (!last) {
    lws_callback_on_writable(wsi);
    return true;
  }
  sending_.erase(found);
  return lws_http_transaction_completed(wsi) == 0;
}

}  // namespace photocoag
