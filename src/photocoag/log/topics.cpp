#include "photocoag/log/topics.hpp"

#include <array>
#include <utility>

namespace photocoag {

std::string_view topic_of(std::string_view name, std::string_view unit, bool word) noexcept {
  if (word) return "/state";
  constexpr std::array<std::pair<std::string_view, std::string_view>, 6> kTopics = {
      {{"K", "/temperature"},
       {"W", "/power"},
       {"J", "/energy"},
       {"s", "/time"},
       {"ns", "/durations"},
       {"-", "/state"}}};
  for (const auto& [of, topic] : kTopics) {
    if (unit == of) return topic;
  }
  return name.starts_with("absorption") || name.starts_with("choroid") ? "/absorption" : "/numbers";
}

}  // namespace photocoag
