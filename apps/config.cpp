// `photocoag config`: a configuration checked and printed; the schema.

#include "photocoag/config/config.hpp"
#include "command.hpp"
#include "console.hpp"
#include "options.hpp"
#include "photocoag/config/schema.hpp"
#include "photocoag/core/files.hpp"

namespace photocoag {
namespace {

struct ConfigOptions : CommonOptions {
  bool schema = false;  ///< print the JSON Schema instead
};

int print_config(const ConfigOptions& options) {
  if (options.schema) {
    write_output("-", config_schema());
    return 0;
  }
  write_output("-", to_toml(load_config(options.config, options.set)));
  return 0;
}

const Command kConfig(
    "config", "check a configuration and print it complete and annotated", print_config,
    [](CommandLine& command, ConfigOptions& options) {
      add_common(command, options);
      command.add_flag("--schema", options.schema,
                       "instead: the JSON Schema of every key, for editors of TOML");
      command.footer(
          footer("  photocoag config > my.toml\n"
                 "  photocoag config --schema > photocoag.schema.json\n"
                 "  photocoag config --config my.toml --set control.peak_reference_K=20"));
    });

}  // namespace

}  // namespace photocoag
