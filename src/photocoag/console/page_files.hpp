// Role: the program; the console's page, compiled in: console/dist. Used by console_command, tests.
#pragma once

#include <optional>
#include <string_view>

#include "photocoag/console/server.hpp"

namespace photocoag {

/// "/", "/app.js", "/app.css", "/icon.svg".
std::optional<WebFile> page_file(std::string_view path);

}  // namespace photocoag
