#include "configured.hpp"

#include <fmt/format.h>

#include "console.hpp"

namespace photocoag {

Config configured(Use use, const std::string& file, const std::vector<std::string>& set) {
  std::vector<UnusedKey> unused;
  Config config = load_config(file, set, use, unused);
  std::string list;
  for (const UnusedKey& one : unused) {
    list += fmt::format("{}{}{}", list.empty() ? "" : ", ", one.key,
                        one.why.empty() ? "" : fmt::format(" ({})", one.why));
  }
  if (!list.empty()) say("note      no effect here: {}\n", list);
  return config;
}

}  // namespace photocoag
