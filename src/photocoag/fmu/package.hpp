// Role: setup; the files of an FMU: model description, resources, documentation. Used by the
// command export-fmu, which adds the library and writes the archive. Source: FMI 3.0, section 2.4
// (model description) and 2.5 (archive), FMI 2.0, sections 2.2 and 2.3; docs/fmu.md. Allocates.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/fmu/setup.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

struct FmuFile {
  std::string name;  ///< with folders, by slashes
  std::string text;
};

/// Throws Error naming the key, what was found and what is accepted if the FMU does not support a
/// setting.
void require_fmu_carries(FmuKind kind, const Config& config);

/// Content of resources/. `model`: the controller's, or the eye's reduced one; null: an eye at
/// full order. The configuration is written without model.file, which the FMU does not read.
FmuResources fmu_resources(FmuKind kind, const Config& config, const ReducedModel* model,
                           const TissueMargin& margin);

/// "photocoag_eye", "photocoag_controller"; also the library's file name.
std::string fmu_model_identifier(FmuKind kind);

enum class FmiVersion : std::uint8_t { k3, k2 };

/// "x86_64-linux" and the like; empty: the standard has no name for this machine.
std::string_view fmu_platform(FmiVersion version) noexcept;

struct FmuDescription {
  std::string identifier;
  std::string token;
  std::vector<FmuVariable> variables;
};

/// modelDescription.xml. The same input gives the same bytes: no date.
std::string fmu_model_description(const FmuDescription& fmu, const Config& config);
/// That of FMI 2.0. Throws Error naming a whole number that takes more than its 32 bits.
std::string fmi2_model_description(const FmuDescription& fmu, const Config& config);

/// Everything but the library, modelDescription.xml first.
std::vector<FmuFile> fmu_files(const FmuResources& resources, const Config& config,
                               FmiVersion version);

}  // namespace photocoag
