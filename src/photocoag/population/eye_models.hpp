// Role: studies; the models shared by treatments of one eye, and one such treatment. Used by study,
// session, campaign. Threads: treat_eye() may run concurrently.
#pragma once

#include <limits>
#include <memory>
#include <optional>

#include "photocoag/config/config.hpp"
#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/rom/reduced_model.hpp"
#include "photocoag/run/treatment.hpp"

namespace photocoag {

struct EyeModels {
  ReducedModel reduced;                        ///< the controller's
  std::shared_ptr<const FullOrderModel> full;  ///< of the eye; null if it is a reduced one
  std::optional<ReducedModel> plant;

  EyeModel eye() const { return {.full = full, .reduced = plant ? &*plant : nullptr}; }
};

/// Throws Error if the models cannot be made.
EyeModels make_eye_models(const Config& config, bool use_cache);

/// In virtual time on the calling thread; the self-test is assumed passed, as for all eyes of a
/// population.
Treatment treat_eye(const Config& config, const ReducedModel& model, const EyeModel& eye);

/// Statistics of the cycles that end after some time; NaN if there are none or the treatment was
/// stopped.
struct Held {
  double error = std::numeric_limits<double>::quiet_NaN();         ///< K, mean of peak - reference
  double deviation = std::numeric_limits<double>::quiet_NaN();     ///< K, of the true peak
  double estimate_rms = std::numeric_limits<double>::quiet_NaN();  ///< K, of estimated - true peak
};

/// `after`: s. `reference`: K.
Held held(const Treatment& treatment, double after, double reference);

}  // namespace photocoag
