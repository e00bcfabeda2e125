// Role: the program; full temperature fields after a sequence of powers, from the full-order or the
// reduced model. Used by `field`, `treat`, `simulate`, session, python. Units: in
// TemperatureField's names; powers in W.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/core/vtk.hpp"
#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/run/treatment.hpp"

namespace photocoag {

enum class FieldModel { kFull, kReduced };

/// Fields at the ends of the periods `after` (ascending numbers of periods, 0: cold) of an eye with
/// config.plant's absorption factor and discretization, `powers`, W, held for config.control.period
/// each. `full`: of the same tissue; the reduced model is made from it as [model] says.
/// Precondition: no entry of `after` exceeds powers.size(). Throws Error if the reduction does.
std::vector<TemperatureField> temperature_fields(const std::shared_ptr<const FullOrderModel>& full,
                                                 FieldModel model, const Config& config,
                                                 const std::vector<double>& powers,
                                                 const std::vector<std::size_t>& after);

/// field.vtr of a run: the simulated eye at the end of the cycle with the highest true peak.
/// Nothing is written if there was no cycle, or if the eye was a reduced model. Throws Error.
void write_field(const std::filesystem::path& folder, const Config& config,
                 const Treatment& treatment, ModelStore& models);

}  // namespace photocoag
