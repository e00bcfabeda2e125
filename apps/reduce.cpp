// `photocoag reduce`: full-order model to reduced model file.
#include "reduce.hpp"

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "command.hpp"
#include "configured.hpp"
#include "console.hpp"
#include "json_object.hpp"
#include "model_report.hpp"
#include "options.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/mor/certificate.hpp"
#include "photocoag/mor/reduce.hpp"
#include "photocoag/mor/uncertain_fit.hpp"
#include "photocoag/rom/file.hpp"
#include "progress.hpp"

namespace photocoag {
namespace {

// One line per alpha; with two parameters one per beta, the worst over alpha.
void print_error_table(const ErrorReport& error) {
  const bool two = !error.choroid_factors.empty();
  say("{}peak error %  volume error %   ({}constant and random on/off power, {:g} ms)\n",
      two ? "beta      " : "alpha     ", two ? "worst of all alpha; " : "", error.duration * 1e3);
  const std::vector<double>& along = two ? error.choroid_factors : error.absorption_factors;
  for (std::size_t i = 0; i < along.size();) {
    const double at = along[i];
    double peak = 0.0;
    double volume = 0.0;
    for (; i < along.size() && along[i] == at; ++i) {
      peak = std::max(peak, error.peak[i]);
      volume = std::max(volume, error.volume[i]);
    }
    say("{:5.2f}     {:12.3f}  {:14.3f}\n", at, 100.0 * peak, 100.0 * volume);
  }
}

void print_certificate(const ReducedModel& model) {
  if (!model.certificate) {
    say("no bound  {}\n", why_uncertified(model.discretization));
    return;
  }
  const ErrorCertificate& certificate = *model.certificate;
  say("proved    cold start, any power from 0 to u_max: within {:.2f} % (peak) and {:.2f} % "
      "(volume) of what u_max reaches in the end; in the first {:g} ms {:.2f} % and {:.2f} %\n",
      100.0 * certificate.peak.relative_max(), 100.0 * certificate.volume.relative_max(),
      certificate.treatment_duration * 1e3, 100.0 * certificate.peak.treatment_relative_max(),
      100.0 * certificate.volume.treatment_relative_max());
}

int reduce_command(const ReduceOptions& options) {
  if (options.compare) return compare_reductions(options);
  if (options.out.empty()) {
    throw Error(ErrorParts{.where = "--out",
                           .problem = "missing",
                           .accepted = "a model file to write, or - for standard output"});
  }
  if (options.json && options.out == "-") {
    throw Error(ErrorParts{
        .where = "--out", .found = "-", .accepted = "a file: --json has standard output"});
  }
  std::vector<std::string> overrides = options.set;
  if (!options.method.empty()) overrides.push_back("model.method=" + options.method);
  if (!options.order.empty()) overrides.push_back("model.order=" + options.order);
  const Config config = configured(Use::kReduce, options.config, overrides);
  const auto full = std::make_shared<const FullOrderModel>(config.tissue, config.grid);
  ReducedModel model = reduce(full, config.model.reduction, config.control.period,
                              config.model.discretization, progress_bar("reducing"));
  if (config.uses_prior()) {
    model.uncertain = std::make_shared<const UncertainModel>(fit_uncertain_model(
        config.tissue, config.grid, config.estimator.prior, config.control.period));
  }
  clear_progress();
  write_output(options.out, to_json(model));
  say("photocoag {}: {}\n", version(), kResearchNotice);
  say("full      {} states ({} radial x {} axial cells)\n", full->states(),
      full->grid().radial.cells(), full->grid().axial.cells());
  print_error_report(model);
  print_certificate(model);
  print_error_table(model.error);
  if (model.uncertain) {
    const UncertainModel& u = *model.uncertain;
    say("uncertain {} quantities, {} modes; of a step response, rms and largest: {:.2f} and {:.2f} "
        "% "
        "of the peak, {:.2f} and {:.2f} % of the volume temperature\n",
        u.count(), u.order(), 100.0 * u.peak_error_rms, 100.0 * u.peak_error_max,
        100.0 * u.volume_error_rms, 100.0 * u.volume_error_max);
  }
  if (options.out != "-") say("written   {}\n", options.out);
  return with_json(options.json, "reduce", 0, {}, reduction_object(model, *full, options.out));
}

const Command kReduce(
    "reduce", "make a reduced model file from [tissue], measure and prove its error",
    reduce_command, [](CommandLine& command, ReduceOptions& options) {
      add_common(command, options);
      command
          .add_option(
              "--out", options.out,
              "model file to write; - is standard output. With --compare: a folder for CSV and "
              "figure, or a .csv file; may be left out")
          .type_name("FILE");
      const CommandOption compare = command.add_flag(
          "--compare", options.compare, "no model: the error of every method against the order");
      add_json(command, options.json).excludes(compare);
      command
          .add_option("--method", options.method,
                      "same as --set model.method=M: pod-deim, balanced, balanced-two-sided, "
                      "irka, taylor")
          .check(given())
          .type_name("M");
      command.add_option("--order", options.order, "same as --set model.order=n: states, 1 to 14")
          .check(given())
          .type_name("n");
      command.footer(
          footer("  photocoag reduce --out model.json\n"
                 "  photocoag reduce --set control.period_ms=4 --order 8 --out model-250hz.json\n"
                 "  photocoag reduce --compare --out comparison\n"
                 "  photocoag simulate --set model.file=model.json"));
    });

}  // namespace

}  // namespace photocoag
