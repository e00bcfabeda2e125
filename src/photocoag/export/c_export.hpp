// Role: setup; the controller as C99 for machines without an operating system. Used by the command
// export-c. Source: docs/embedding-c.md (what it carries and what not, sizes, instruction counts).
// Units: SI. Allocates.
#pragma once

#include <string>
#include <vector>

#include "photocoag/estimation/settings.hpp"
#include "photocoag/mpc/settings.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

struct CExportOptions {
  bool single_precision = false;
  std::string prefix = "pc_";  ///< of every name: a C identifier of lower-case letters, digits, _
  std::string config_sha256 = {};  ///< written down
};

struct ExportedFile {
  std::string name;
  std::string text;
};

/// Throws Error naming the key, what was found and what is accepted if the C controller does not
/// carry a setting; and if `options.prefix` is not a prefix.
void require_exportable(const ControlSettings& control, const EstimatorSettings& estimator,
                        const CExportOptions& options);

/// The files of a C99 controller that gives the powers of Controller(model, control, estimator).
/// Same input, same bytes. Throws Error as require_exportable() and as Controller does.
/// Tests: tests/export.
std::vector<ExportedFile> export_c(const ReducedModel& model, const ControlSettings& control,
                                   const EstimatorSettings& estimator,
                                   const CExportOptions& options);

}  // namespace photocoag
