#include "photocoag/fmu/source_package.hpp"

#include <fmt/format.h>

#include <string>
#include <string_view>

#include "photocoag/core/error.hpp"
#include "photocoag/core/sha256.hpp"
#include "photocoag/export/c_export.hpp"

namespace photocoag {
namespace {

constexpr std::string_view kIdentifier = "photocoag_controller_c";

// Of export-c's files those that belong to a library.
bool is_source(std::string_view name) {
  return (name.ends_with(".c") || name.ends_with(".h")) && name != "example.c";
}

std::string build_description(const std::vector<FmuFile>& sources) {
  std::string text = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiBuildDescription fmiVersion=\"3.0\">\n"
      "  <BuildConfiguration modelIdentifier=\"{}\">\n    <SourceFileSet language=\"C99\">\n",
      kIdentifier);
  for (const FmuFile& file : sources) {
    if (!file.name.ends_with(".c")) continue;
    text += fmt::format("      <SourceFile name=\"{}\"/>\n", file.name);
  }
  return text +
         "    </SourceFileSet>\n    <Library name=\"m\"/>\n  </BuildConfiguration>\n"
         "</fmiBuildDescription>\n";
}

}  // namespace

void require_fmu_source_carries(FmuKind kind, const Config& config) {
  if (kind == FmuKind::kEye) {
    throw Error(ErrorParts{.where = "--source",
                           .problem = "the simulated eye is C++ and has no C sources",
                           .found = "eye",
                           .accepted = "controller, or the eye without --source"});
  }
  require_exportable(config.control, config.estimator, {});
}

std::vector<FmuFile> fmu_source_files(const Config& config, const ReducedModel& model) {
  std::vector<FmuFile> sources;
  const CExportOptions how{.config_sha256 = config_sha256(config)};
  std::string all;
  for (const ExportedFile& file : export_c(model, config.control, config.estimator, how)) {
    if (is_source(file.name)) sources.push_back({file.name, file.text});
  }
  for (const CSource& file : fmu_c_sources()) {
    sources.push_back({std::string(file.name), std::string(file.text)});
  }
  for (const FmuFile& file : sources) all += file.text;
  const std::string token = sha256_hex(all);
  sources.push_back(
      {"fmu_token.h", fmt::format("/* Of these sources. */\n#define FMU_TOKEN \"{}\"\n", token)});
  std::vector<FmuFile> files = {
      {"modelDescription.xml",
       fmu_model_description({std::string(kIdentifier), token, fmu_source_variables()}, config)},
      {"sources/buildDescription.xml", build_description(sources)}};
  for (FmuFile& file : sources) {
    files.push_back({fmt::format("sources/{}", file.name), std::move(file.text)});
  }
  return files;
}

}  // namespace photocoag
