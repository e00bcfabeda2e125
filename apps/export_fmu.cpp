// `photocoag export-fmu`: the simulated eye, or the controller, for other simulation programs.

#include <fmt/format.h>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "command.hpp"
#include "configured.hpp"
#include "console.hpp"
#include "full_program.hpp"
#include "options.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/fmu/package.hpp"
#include "photocoag/fmu/source_package.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/tissue_margin.hpp"
#include "progress.hpp"
#include "zip.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

struct ExportFmuOptions : CommonOptions {
  std::string kind;
  std::string out;  ///< file
  bool source = false;
  std::string standard = "3.0";

  FmiVersion version() const { return standard == "2.0" ? FmiVersion::k2 : FmiVersion::k3; }
};

void require_new(const std::string& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error) || fs::file_size(file, error) == 0) return;
  throw Error(ErrorParts{.where = "--out",
                         .problem = "exists and is not empty",
                         .found = file,
                         .accepted = "a new file"});
}

// Beside the program, or where it is installed.
std::string fmu_library() {
  constexpr std::size_t kLargest = 100'000'000;
  const fs::path found = find_from_program(
      {"photocoag_fmu.so", "lib/photocoag/photocoag_fmu.so", "lib64/photocoag/photocoag_fmu.so",
       "lib/x86_64-linux-gnu/photocoag/photocoag_fmu.so",
       "lib/aarch64-linux-gnu/photocoag/photocoag_fmu.so"},
      2);
  if (!found.empty()) return read_file(found, kLargest, "library");
  throw Error(
      ErrorParts{.where = "photocoag_fmu.so",
                 .problem = "the FMU's library was not built with this program",
                 .accepted = "a build with -DPHOTOCOAG_EMBEDDABLE=ON, as ./photocoag does"});
}

std::vector<FmuFile> files_with_library(FmuKind kind, const Config& config,
                                        const ExportFmuOptions& options) {
  const std::string_view platform = fmu_platform(options.version());
  if (platform.empty()) {
    throw Error(fmt::format("FMI {} has no name for this machine's platform", options.standard));
  }
  const std::string library = fmu_library();
  ModelStore models(config, !options.no_cache, progress_bar("reducing"));
  std::optional<ReducedModel> model;
  TissueMargin margin;
  if (kind == FmuKind::kController) {
    model = models.reduced();
    if (wants_margin(config)) margin = tissue_margin(config, *model);
  } else if (config.plant.model == PlantModel::kReduced) {
    model = models.plant_reduced();
  }
  clear_progress();
  const FmuResources resources = fmu_resources(kind, config, model ? &*model : nullptr, margin);
  std::vector<FmuFile> files = fmu_files(resources, config, options.version());
  files.push_back(
      {fmt::format("binaries/{}/{}.so", platform, fmu_model_identifier(kind)), library});
  return files;
}

int export_fmu(const ExportFmuOptions& options) {
  const FmuKind kind = options.kind == "eye" ? FmuKind::kEye : FmuKind::kController;
  const Config config = configured(kind == FmuKind::kEye ? Use::kFmuEye : Use::kFmuController,
                                   options.config, options.set);
  require_fmu_carries(kind, config);
  if (options.source) require_fmu_source_carries(kind, config);
  require_new(options.out);
  if (options.source) {
    ModelStore models(config, !options.no_cache, progress_bar("reducing"));
    const ReducedModel& model = models.reduced();
    clear_progress();
    write_file(options.out, zip_archive(fmu_source_files(controller_config(config, model), model)));
    say("WARNING   the supervisor is not in the sources: see docs/fmu.md\n");
  } else {
    write_file(options.out, zip_archive(files_with_library(kind, config, options)));
  }
  say("photocoag {}: {}\n{} as FMI {} co-simulation, communication step {:g} ms\nwritten   {}\n",
      version(), kResearchNotice, options.kind, options.standard, config.control.period * 1e3,
      options.out);
  return 0;
}

const Command kExportFmu(
    "export-fmu",
    "write the simulated eye or the controller as an FMU (FMI 3.0 or 2.0, co-simulation)",
    export_fmu, [](CommandLine& command, ExportFmuOptions& options) {
      command.add_option("KIND", options.kind, "eye, or controller with its supervisor")
          .required()
          .one_of({"eye", "controller"});
      add_common(command, options);
      add_cache(command, options);
      command.add_option("--out", options.out, "file to write, NAME.fmu")
          .required()
          .type_name("FILE");
      const CommandOption source = command.add_flag(
          "--source", options.source,
          "the controller as C99 sources instead of a library (without the supervisor)");
      command.add_option("--fmi", options.standard, "version of the standard")
          .one_of({"3.0", "2.0"})
          .show_default()
          .excludes(source);
      command.footer(footer(
          "  photocoag export-fmu controller --out controller.fmu\n"
          "  photocoag export-fmu eye --set plant.absorption_factor=0.5 --out eye.fmu\n"
          "  photocoag export-fmu eye --fmi 2.0 --out eye.fmu\n"
          "  photocoag export-fmu controller --source --out controller-c.fmu\n"
          "Stepped one after the other, eye first, they give the powers of simulate with the "
          "same configuration\nbit for bit: docs/fmu.md."));
    });

}  // namespace

}  // namespace photocoag
