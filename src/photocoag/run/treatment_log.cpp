#include "photocoag/run/treatment_log.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/sha256.hpp"
#include "photocoag/rom/file.hpp"

namespace photocoag {
namespace {

LogHeader log_header(const Config& config, ModelStore& models, std::string device) {
  const std::size_t states = config.plant.model == PlantModel::kFull
                                 ? models.plant_full()->states()
                                 : models.reduced().full_order_states;
  return {.program = fmt::format("photocoag {} {}", version(), source_hash()),
          .config_sha256 = config_sha256(models.config()),
          .model_sha256 = sha256_hex(to_json(models.reduced())),
          .device = std::move(device),
          .period = config.control.period,
          .planned_cycles = static_cast<std::int64_t>(config.cycles()),
          .full_order_states = static_cast<std::int64_t>(states),
          .fields = {}};
}

}  // namespace

std::unique_ptr<LogWriter> start_log(const Config& config, ModelStore& models,
                                     const std::filesystem::path& folder, std::string device,
                                     LogOptions options) {
  if (options.ring_records == 0) {
    options.ring_records = static_cast<std::size_t>(std::ceil(1.0 / config.control.period));
  }
  auto log = std::make_unique<LogWriter>(folder, log_header(config, models, std::move(device)),
                                         std::move(options));
  const std::uint64_t bytes = 2 * log_record_bytes() * config.cycles();
  if (!disk_has_room(folder, bytes)) {
    throw Error(ErrorParts{.where = folder.string(),
                           .problem = "the disk has no room for the log",
                           .accepted = fmt::format("{} bytes free", bytes)});
  }
  return log;
}

LogOutcome finish_log(LogWriter& log) {
  LogOutcome outcome;
  outcome.totals = log.close();
  outcome.segments = log.segments();
  outcome.trouble = log.trouble();
  return outcome;
}

}  // namespace photocoag
