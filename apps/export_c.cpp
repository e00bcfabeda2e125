// `photocoag export-c`: the controller of a configuration as C99.

#include <filesystem>

#include "command.hpp"
#include "configured.hpp"
#include "console.hpp"
#include "options.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/export/c_export.hpp"
#include "photocoag/rom/uncertain_model.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/run_folder.hpp"
#include "photocoag/run/tissue_margin.hpp"
#include "progress.hpp"

namespace photocoag {
namespace {

struct ExportCOptions : CommonOptions {
  std::string out;  ///< folder, new or empty
  std::string prefix = "pc_";
  bool single_precision = false;
};

int export_c_command(const ExportCOptions& options) {
  const Config config = configured(Use::kExportC, options.config, options.set);
  if (config.photoacoustics.sampling == Sampling::kPulses) {
    throw Error(ErrorParts{.key = "photoacoustics.sampling",
                           .problem = "the exported C has no model of single pulses",
                           .found = "\"pulses\"",
                           .accepted = "\"instant\""});
  }
  const CExportOptions how{.single_precision = options.single_precision,
                           .prefix = options.prefix,
                           .config_sha256 = config_sha256(config)};
  require_exportable(config.control, config.estimator, how);
  const std::filesystem::path folder = options.out;
  check_run_folder(folder);

  ModelStore models(config, !options.no_cache, progress_bar("reducing"));
  const ReducedModel& model = models.reduced();
  clear_progress();
  // As in treat: with the margin for declared uncertainty.
  const Config controlled = controller_config(config, model);
  const std::vector<ExportedFile> files =
      export_c(model, controlled.control, config.estimator, how);

  const ClaimedFolder claimed = open_run_folder(folder, config);
  for (const ExportedFile& file : files) write_file(folder / file.name, file.text);
  say("photocoag {}: {}\ncontroller as C99, {} precision, horizon {}, order {}, for {:g} ms\n"
      "WARNING   the supervisor is not in it: see README.md in the folder\n"
      "written   {}\n",
      version(), kResearchNotice, options.single_precision ? "single" : "double",
      controlled.control.horizon, config.uses_prior() ? model.uncertain->order() : model.order(),
      model.period * 1e3, folder.string());
  return 0;
}

const Command kExportC(
    "export-c", "write the controller as C99 for a microcontroller (without the supervisor)",
    export_c_command, [](CommandLine& command, ExportCOptions& options) {
      add_common(command, options);
      add_cache(command, options);
      command.add_option("--out", options.out, "folder, new or empty").required().type_name("DIR");
      command.add_flag("--float", options.single_precision, "single precision instead of double");
      command.add_option("--prefix", options.prefix, "of every name and file in C")
          .type_name("NAME")
          .show_default();
      command.footer(
          footer("  photocoag export-c --config configs/paper-1khz.toml --out controller\n"
                 "  photocoag export-c --float --prefix left_eye_ --out controller\n"
                 "Settings that the C controller does not carry are refused by their key."));
    });

}  // namespace

}  // namespace photocoag
