// Role: offline and setup; the one exception type of the project. Used by everything that may
// throw. A step (estimator, solver, controller, gate) never throws: it returns a status.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace photocoag {

/// What the user needs to correct a bad input. Any part may be empty.
struct ErrorParts {
  std::string where = {};  ///< file, file:line, or the command-line option the value came from
  std::string key = {};    ///< full key with its unit, e.g. "control.power_max_W"
  std::string problem =
      {};  ///< what is wrong, in words; may be empty when found and accepted say it all
  std::string found = {};     ///< the value found, as it was written
  std::string accepted = {};  ///< what is accepted instead, with unit
};

/// Bad input or a failed set-up. what() reads "where: key: problem; found X; accepted: Y".
class Error : public std::runtime_error {
 public:
  explicit Error(ErrorParts parts);
  explicit Error(std::string problem) : Error(ErrorParts{.problem = std::move(problem)}) {}

  const ErrorParts& parts() const noexcept { return parts_; }

  /// The same error with `where` filled in, unless it is already set.
  Error at(std::string_view where) const;

 private:
  ErrorParts parts_;
};

}  // namespace photocoag
