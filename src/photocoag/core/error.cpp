#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

std::string message(const ErrorParts& parts) {
  std::string text;
  const auto append = [&text](std::string_view separator, std::string_view label,
                              const std::string& part) {
    if (part.empty()) return;
    if (!text.empty()) text += separator;
    text += label;
    text += part;
  };
  append(": ", "", parts.where);
  append(": ", "", parts.key);
  append(": ", "", parts.problem);
  append(parts.problem.empty() ? ": " : "; ", "found ", parts.found);
  append("; ", "accepted: ", parts.accepted);
  return text;
}

}  // namespace

Error::Error(ErrorParts parts) : std::runtime_error(message(parts)), parts_(std::move(parts)) {}

Error Error::at(std::string_view where) const {
  ErrorParts parts = parts_;
  if (parts.where.empty()) parts.where = where;
  return Error(std::move(parts));
}

}  // namespace photocoag
