// Role: setup; which configuration keys a command uses: keys without effect are reported,
// contradictions refused. Used by apps, campaign, run, session, python. Source:
// docs/configuration.md.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/config/reader.hpp"

namespace photocoag {

/// Purpose of a configuration. Values are bits: a rule may name several.
enum class Use : std::uint32_t {
  kSimulate = 1U << 0U,         ///< also campaign, sweep
  kTreat = 1U << 1U,            ///< with the simulated eye of the same process
  kTreatEye = 1U << 2U,         ///< --device eye
  kTreatDriver = 1U << 3U,      ///< --device driver
  kEye = 1U << 4U,              ///< the eye's own process
  kResponseFull = 1U << 5U,     ///< response and field
  kResponseReduced = 1U << 6U,  ///< the same of a reduced model
  kReduce = 1U << 7U,
  kCompareReductions = 1U << 8U,
  kExport = 1U << 9U,
  kBoundaries = 1U << 10U,
  kSchemeComparison = 1U << 11U,  ///< discretizations
  kEstimation = 1U << 12U,
  kSpots = 1U << 13U,
  kCalibrate = 1U << 14U,  ///< --example
  kExportC = 1U << 15U,    ///< the controller as C
  kFmuEye = 1U << 16U,     ///< export-fmu eye
  kFmuController = 1U << 17U,
};

/// A value that was given but has no effect in this use.
struct UnusedKey {
  std::string key;
  std::string why;  ///< empty: the use ignores the whole group
};

/// Values that were given, differ from the defaults and have no effect, in the order of the keys.
std::vector<UnusedKey> unused_keys(const Config& config, const Places& places, Use use);

/// Throws Error if a given value contradicts the use.
void refuse_contradictions(const Config& config, const Places& places, Use use);

/// load_config() for a use; keys without effect are added to `unused`. Throws Error.
Config load_config(const std::string& file, const std::vector<std::string>& overrides, Use use,
                   std::vector<UnusedKey>& unused);

/// Whether a use reads a key at all; unused_keys() refines this. For tests.
bool uses(Use use, std::string_view key) noexcept;

}  // namespace photocoag
