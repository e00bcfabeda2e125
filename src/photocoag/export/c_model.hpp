// Role: setup; the values of the placeholders in the exported C files. Used by export.
// Source: docs/equations.md (E9), (E15) to (E22), (E28). Allocates.
#pragma once

#include <map>
#include <string>

#include "photocoag/export/c_export.hpp"

namespace photocoag {

/// By the placeholder's name. Preconditions: require_exportable() and Controller accept it.
std::map<std::string, std::string> c_placeholders(const ReducedModel& model,
                                                  const ControlSettings& control,
                                                  const EstimatorSettings& estimator,
                                                  const CExportOptions& options);

}  // namespace photocoag
