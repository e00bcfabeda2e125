// Role: setup; the controller as C99 for machines without an operating system. Used by the command
// export-c. Source: docs/embedding-c.md (features, sizes, instruction counts).
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
  std::string prefix =
      "pc_";  ///< prefix of every name: a C identifier of lower-case letters, digits, _
  std::string config_sha256 = {};  ///< recorded in the files
};

struct ExportedFile {
  std::string name;
  std::string text;
};

/// Throws Error naming the key, what was found and what is accepted if the C controller does not
/// support a setting or `options.prefix` is not valid.
void require_exportable(const ControlSettings& control, const EstimatorSettings& estimator,
                        const CExportOptions& options);

/// The files of a C99 controller that computes the same powers as Controller(model, control,
/// estimator). Same input, same bytes. Throws Error as require_exportable() and as Controller does.
/// Tests: tests/export.
std::vector<ExportedFile> export_c(const ReducedModel& model, const ControlSettings& control,
                                   const EstimatorSettings& estimator,
                                   const CExportOptions& options);

}  // namespace photocoag
