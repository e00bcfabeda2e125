#include "photocoag/fmu/package.hpp"

#include <fmt/format.h>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/check.hpp"
#include "photocoag/rom/file.hpp"

namespace photocoag {
namespace {

std::string documentation(FmuKind kind, const Config& config) {
  return fmt::format(
      "<!DOCTYPE html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>photocoag {0}</title>"
      "</head><body><h1>photocoag {0}</h1><p>{1}</p><p>{2} One communication step is one control "
      "period, {3} ms. Variables: modelDescription.xml; how to couple eye and controller: "
      "docs/fmu.md of photocoag {4}.</p></body></html>\n",
      to_string(kind), kResearchNotice,
      kind == FmuKind::kEye ? "The simulated eye with its laser, sensor noise and watchdog."
                            : "Estimator, optimal control and, unless switched off, supervisor.",
      config.control.period * 1e3, version());
}

}  // namespace

void require_fmu_carries(FmuKind kind, const Config& config) {
  require(config.photoacoustics.sampling == Sampling::kInstant, "photoacoustics.sampling",
          std::string_view("\"pulses\""), "\"instant\": an FMU has no single pulses");
  if (kind == FmuKind::kEye) return;
  require(config.control.solver == SolverKind::kDense, "control.solver",
          std::string_view(config.control.solver == SolverKind::kOsqp ? "\"osqp\""
                                                                      : "\"osqp-condensed\""),
          "\"dense\": OSQP's memory cannot be saved as an FMU's state");
}

FmuResources fmu_resources(FmuKind kind, const Config& config, const ReducedModel* model,
                           const TissueMargin& margin) {
  Config inside = config;
  inside.model.file.clear();
  return {.kind = kind,
          .config = to_toml(inside),
          .model = model == nullptr ? std::string() : to_json(*model),
          .margin = margin_text(margin)};
}

std::string fmu_model_identifier(FmuKind kind) {
  return fmt::format("photocoag_{}", to_string(kind));
}

std::string_view fmu_platform(FmiVersion version) noexcept {
#if defined(__linux__) && defined(__x86_64__)
  return version == FmiVersion::k2 ? "linux64" : "x86_64-linux";
#elif defined(__linux__) && defined(__aarch64__)
  return version == FmiVersion::k2 ? "" : "aarch64-linux";
#else
  return {};
#endif
}

std::vector<FmuFile> fmu_files(const FmuResources& resources, const Config& config,
                               FmiVersion version) {
  const FmuDescription fmu{fmu_model_identifier(resources.kind), fmu_token(resources),
                           fmu_variables(resources.kind, config)};
  std::vector<FmuFile> files = {
      {"modelDescription.xml", version == FmiVersion::k2 ? fmi2_model_description(fmu, config)
                                                         : fmu_model_description(fmu, config)},
      {"documentation/index.html", documentation(resources.kind, config)},
      {"resources/kind.txt", fmt::format("{}\n", to_string(resources.kind))},
      {"resources/config.toml", resources.config}};
  if (!resources.model.empty()) files.push_back({"resources/model.json", resources.model});
  if (!resources.margin.empty()) files.push_back({"resources/margin.txt", resources.margin});
  return files;
}

}  // namespace photocoag
