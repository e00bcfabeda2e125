// Role: setup; the description of a session: many spots, one device, limits for the whole session.
// Used by `photocoag session`. Format: docs/sessions.md. Units: SI; um, ms, mJ and K in the file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/config/prior.hpp"
#include "photocoag/run/device_address.hpp"

namespace photocoag {

/// One spot as it is planned.
struct SpotPlan {
  std::string name;              ///< 1 to 40 letters, digits, - and _; no other spot's
  double x = 0.0;                ///< m, on the retina
  double y = 0.0;                ///< m
  std::vector<std::string> set;  ///< its keys as overrides of the configuration
};

/// Limits of a whole session, including interruptions. A spot that could exceed one is not begun.
struct SessionLimits {
  double energy = std::numeric_limits<double>::infinity();      ///< J
  double time = std::numeric_limits<double>::infinity();        ///< s, since the first spot began
  std::size_t spots = std::numeric_limits<std::size_t>::max();  ///< begun, repetitions included
};

struct Session {
  std::string file;
  std::string text;  ///< of the file
  std::string title;
  std::vector<SpotPlan> spots;
  std::string config_file;
  std::vector<std::string> set;
  std::string device;  ///< as --device; empty: the simulated eye of this process
  DeviceAddress place;
  double pause = 0.0;  ///< s, between two spots
  std::uint64_t seed = 1;
  bool learn = false;            ///< earlier spots' alpha is the next one's prior
  double learn_floor = 0.05;     ///< 1, smallest standard deviation of such a prior
  bool ends_with_a_stop = true;  ///< the session ends after a spot that the supervisor has stopped
  SessionLimits limits;
  Prior shared;  ///< of simulated eyes: quantities drawn once for a session …
  Prior varied;  ///< … and once for each spot
  /// The spots' configurations before learning: overrides, device, drawn eye, seed.
  std::vector<Config> configs;
  std::vector<std::string> remarks;  ///< keys without effect

  /// Hash of everything the spots depend on: file, configurations, device, program.
  std::string identity() const;
  /// Index of the spot of that name. Throws Error naming `option`.
  std::size_t find(const std::string& name, const std::string& option) const;
};

/// Reads and checks everything, each spot's configuration included. Throws Error naming file, key,
/// what was found and what is accepted.
Session load_session(const std::string& file);

/// The configurations for another seed of the session: other eyes and other noise.
std::vector<Config> session_configs(const Session& session, std::uint64_t seed);

/// Largest energy that supervisor and laser allow a spot of this configuration, J.
double worst_energy(const Config& config) noexcept;

}  // namespace photocoag
