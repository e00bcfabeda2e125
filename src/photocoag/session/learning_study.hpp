// Role: offline; benefit of learning alpha from a session's earlier spots: many simulated sessions,
// each with and without, same eyes and noise. Used by `photocoag session --study`. Source:
// docs/sessions.md ("What earlier spots teach"). Units: in the names.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "photocoag/session/session_file.hpp"

namespace photocoag {

/// A measure of the spots after the first, mean over the sessions of each session's mean.
struct LearningRow {
  std::string measure;
  std::string unit;
  double without = 0.0;
  double with = 0.0;
  double difference = 0.0;        ///< with minus without
  double difference_error = 0.0;  ///< standard error of that mean, over the sessions
};

struct LearningStudy {
  std::size_t sessions = 0;
  std::size_t spots = 0;  ///< of one session
  std::vector<LearningRow> rows;
};

/// `count` sessions with other seeds, in virtual time, self-tests assumed passed. Throws Error if
/// the session cannot learn or has one spot.
LearningStudy learning_study(const Session& session, std::size_t count, bool use_cache);

}  // namespace photocoag
