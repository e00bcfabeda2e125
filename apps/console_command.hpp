// Role: the program; the options of `console`, for its two files.
#pragma once

#include <string>
#include <vector>

#include "options.hpp"

namespace photocoag {

struct ConsoleOptions : CommonOptions {
  std::string out;      ///< folder for the run folders of all spots; empty: new ones below runs/
  std::string device;   ///< empty, or see run/device_address.hpp
  std::string session;  ///< file of a session; empty: spot after spot of one configuration
  bool foxglove = false;
  std::vector<std::string> foxglove_origins;  ///< pages that may connect as Foxglove clients
  int port = 0;                               ///< 0: any free port
};

}  // namespace photocoag
