// Role: setup; content of an FMU's folder resources/, read when it is instantiated: the
// configuration, the reduced model, the margin for declared uncertainty. Used by fmu. Source:
// docs/fmu.md. Units: SI. Allocates. Threads: immutable after construction.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/fmu/variables.hpp"
#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/rom/reduced_model.hpp"
#include "photocoag/run/tissue_margin.hpp"

namespace photocoag {

/// The texts of resources/; empty: no such file.
struct FmuResources {
  FmuKind kind = FmuKind::kEye;
  std::string config;  ///< config.toml, complete
  std::string model;   ///< model.json; an eye at full order needs none
  std::string margin;  ///< margin.txt: factor, then shares, one a line
};

/// Identifies an FMU: the same 64 characters for the same resources and program.
std::string fmu_token(const FmuResources& resources);

/// The texts in `folder`. Throws Error if it is not an FMU's resources folder.
FmuResources read_fmu_resources(const std::filesystem::path& folder);

std::string margin_text(const TissueMargin& margin);
TissueMargin margin_from(const std::string& text);

/// Everything both kinds of parts are made from.
struct FmuSetup {
  FmuKind kind = FmuKind::kEye;
  Config config;
  std::shared_ptr<const ReducedModel> reduced;  ///< null: none
  std::shared_ptr<const FullOrderModel> full;   ///< of an eye at full order
  TissueMargin margin;
  std::string token;
  std::vector<FmuVariable> variables;
};

/// Reads, verifies and assembles. `config_file`: that of the resources. Throws Error.
FmuSetup fmu_setup(const FmuResources& resources, const std::filesystem::path& folder);

/// The configuration with the parameters of `values` (one per variable), validated. Throws Error.
Config with_parameters(const FmuSetup& setup, const std::vector<FmuValue>& values);

}  // namespace photocoag
