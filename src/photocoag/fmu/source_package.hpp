// Role: setup; the controller as an FMU of C99 sources, for importers that compile. Used by the
// command export-fmu. Source: docs/fmu.md, docs/embedding-c.md. Differences from the FMU with a
// library: no supervisor, no parameters, powers equal to rounding. Allocates.
#pragma once

#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/export/c_sources.hpp"
#include "photocoag/fmu/package.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

/// The C files of src/fmu/c, embedded when photocoag is built. In the order of their names.
const std::vector<CSource>& fmu_c_sources();

/// Throws Error naming the key if the C controller does not support a setting.
void require_fmu_source_carries(FmuKind kind, const Config& config);

/// All files of the archive. `config`: the controller's, with its margin. Throws Error.
std::vector<FmuFile> fmu_source_files(const Config& config, const ReducedModel& model);

}  // namespace photocoag
