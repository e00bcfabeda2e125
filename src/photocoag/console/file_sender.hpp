// Role: the program; sends files over HTTP: headers at once, data as the client accepts it. Used by
// server. Source: docs/console.md (policy). Real time: none. Threads: the server's.
#pragma once

#include <cstddef>
#include <map>

#include "photocoag/console/server.hpp"

struct lws;

namespace photocoag {

class FileSender {
 public:
  /// Status 200 with type, length and policies. False: the connection must be closed.
  bool begin(lws* wsi, WebFile file);
  /// Sends the next bytes. False: the connection is finished.
  bool go_on(lws* wsi);
  void forget(lws* wsi) { sending_.erase(wsi); }

 private:
  struct Sending {
    WebFile file;
    std::size_t sent = 0;
  };
  std::map<lws*, Sending> sending_;
};

}  // namespace photocoag
