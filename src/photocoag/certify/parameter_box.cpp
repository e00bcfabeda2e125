#include "photocoag/certify/parameter_box.hpp"

#include <fmt/format.h>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

void require_range(const BoxRange& range, double low, double high, const char* name,
                   const char* accepted) {
  if (range.low >= low && range.high <= high && range.low <= range.high) return;
  throw Error(ErrorParts{.key = name,
                         .found = fmt::format("{:g} to {:g}", range.low, range.high),
                         .accepted = accepted});
}

void refuse(const char* key, std::string found, std::string accepted) {
  throw Error(ErrorParts{.key = key,
                         .problem = "the number of active-set changes cannot be proved for it",
                         .found = std::move(found),
                         .accepted = std::move(accepted)});
}

}  // namespace

void CertifiedBox::validate() const {
  require_range(absorption, 0.05, 5.0, "--alpha", "a range from 0.05 to 5");
  require_range(choroid, 0.05, 5.0, "--beta", "a range from 0.05 to 5");
  for (const BoxRange& stage : free) {
    require_range(stage, -150.0, 300.0, "--free", "a range from -150 to 300 K");
  }
  require_range(previous, -1.0, 2.0, "--previous", "a range from -1 to 2 W");
}

CertifiedBox usual_box(const ControlSettings& settings, BoxRange absorption, BoxRange choroid) {
  CertifiedBox box{.absorption = absorption,
                   .choroid = choroid,
                   .previous = {settings.power_min, settings.power_max}};
  box.free.fill({0.0, 1.25 * settings.peak_max});
  return box;
}

void require_certifiable(const ReducedModel& model, const ControlSettings& settings) {
  if (settings.horizon > kMaxCertifiedHorizon) {
    refuse("control.horizon", fmt::format("{}", settings.horizon),
           fmt::format("2 to {}", kMaxCertifiedHorizon));
  }
  if (settings.solver != SolverKind::kDense) {
    refuse("control.solver", "\"osqp\" or \"osqp-condensed\"", "\"dense\"");
  }
  if (settings.robust != Robustness::kNone) {
    refuse("control.robust", "\"certified\" or \"chance\"", "\"none\"");
  }
  if (!settings.reference_times.empty()) {
    refuse("control.reference_times_ms", "a profile", "a constant control.peak_reference_K");
  }
  if (!settings.shares.empty()) {
    refuse("uncertainty", "a share of the limit for every period", "no declared uncertainty");
  }
  if (model.uncertain != nullptr) {
    refuse("model", "a model of several uncertain quantities", "one with alpha, or alpha and beta");
  }
}

}  // namespace photocoag
