// `photocoag response`: temperatures after switching on a constant power.
#include <fmt/format.h>

#include <iterator>
#include <string>
#include <vector>

#include "command.hpp"
#include "configured.hpp"
#include "console.hpp"
#include "options.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/step_response.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/loop/plant.hpp"
#include "photocoag/rom/file.hpp"
#include "photocoag/run/model_cache.hpp"
#include "progress.hpp"

namespace photocoag {
namespace {

struct ResponseOptions : CommonOptions {
  std::string model = "full";
  std::string rom;
  double power = 0.0;         ///< W
  std::vector<double> times;  ///< s
  std::string csv = "-";
};

int response(const ResponseOptions& options) {
  const Config config =
      configured(options.model == "full" ? Use::kResponseFull : Use::kResponseReduced,
                 options.config, options.set);
  ascending_times(options.times);  // refuse bad times before the models are built
  if (options.model == "full" && !options.rom.empty()) {
    throw Error(ErrorParts{.where = "--rom",
                           .found = options.rom,
                           .accepted = "a model file together with --model reduced"});
  }
  ModelStore models(config, !options.no_cache, progress_bar("reducing"));
  std::vector<Outputs> outputs;
  const AbsorptionFactors absorption = config.plant.absorption();
  if (options.model == "full") {
    FullOrderPlant plant(models.plant_full(), config.plant.discretization, config.control.period,
                         absorption, 0.0);
    outputs = sample_step_response(plant, config.plant.discretization, config.control.period,
                                   options.power, options.times);
  } else {
    const ReducedModel model =
        options.rom.empty() ? models.reduced() : load_reduced_model(options.rom);
    clear_progress();
    ReducedPlant plant(model, absorption);
    outputs = sample_step_response(plant, model.discretization, model.period, options.power,
                                   options.times);
  }
  std::string csv = "time_s,peak_K,volume_K\n";
  for (std::size_t i = 0; i < options.times.size(); ++i) {
    fmt::format_to(std::back_inserter(csv), "{},{},{}\n", options.times[i], outputs[i].peak,
                   outputs[i].volume);
  }
  write_output(options.csv, csv);
  return 0;
}

const Command kResponse(
    "response",
    "temperatures after switching on a constant power, from the full or the reduced model",
    response, [](CommandLine& command, ResponseOptions& options) {
      add_common(command, options);
      add_cache(command, options);
      command.add_option("--model", options.model, "full or reduced")
          .required()
          .one_of({"full", "reduced"});
      command.add_option("--rom", options.rom, "reduced model file (with --model reduced)")
          .type_name("FILE");
      command.add_option("--power", options.power, "laser power, W")
          .required()
          .check(number_from(0.0, 1e6))
          .type_name("W");
      add_times(command, options.times,
                "times after switching on, s, comma-separated, in any order");
      command.add_option("--csv", options.csv, "output file; - is standard output")
          .type_name("FILE");
      command.footer(footer(
          "  photocoag response --model full --power 0.03 --times 0.001,0.01,0.1 --csv -\n"
          "  photocoag response --model reduced --rom model.json --power 1 --times 0.004 --csv -\n"
          "The eye is that of [plant]: its absorption_factor, tissue and discretization."));
    });

}  // namespace

}  // namespace photocoag
