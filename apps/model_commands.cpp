#include "model_commands.hpp"

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "commands.hpp"
#include "json_object.hpp"
#include "options.hpp"

namespace photocoag {
namespace {

constexpr double kLongestTime = 1e4;  // s

void add_certify(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<CertifyCommandOptions>();
  CLI::App* certify_app = app.add_subcommand(
      "certify", "prove how many active-set changes the solver needs at most (horizons 2 to 5)");
  add_common(*certify_app, *options);
  add_cache(*certify_app, *options);
  const auto add_range = [&](const char* name, std::string& value, const char* what) {
    certify_app->add_option(name, value, what)->type_name("LOW,HIGH");
  };
  add_range("--alpha", options->absorption, "absorption factors; default: the estimator's bounds");
  add_range("--beta", options->choroid, "choroid factors, of a model with two");
  add_range("--free", options->free,
            "peak temperatures without further powers, K, at every stage by itself; default: 0 to "
            "1.25 times control.peak_max_K");
  add_range("--previous", options->previous,
            "the power before, W, and the first cycle's reference power; default: all powers");
  certify_app->add_option("--boxes", options->boxes, "most boxes to look at")
      ->check(whole_number_from(1, 100'000'000))
      ->capture_default_str()
      ->type_name("n");
  certify_app
      ->add_option("--out", options->out,
                   "model file to write, with the proof in it; may be "
                   "model.file itself")
      ->type_name("FILE");
  certify_app->add_flag("--again", options->again, "even if model.file has the proof already");
  add_json(*certify_app, options->json);
  certify_app->footer(
      footer("  photocoag certify --config configs/paper-1khz.toml\n"
             "  photocoag certify --set control.horizon=3 --out model.json\n"
             "  photocoag certify --set control.horizon=3 --set model.file=model.json\n"
             "  photocoag certify --set control.horizon=4 --free 20,32 --boxes 100000\n"
             "Ctrl-C ends the search; what is proved so far is printed."));
  certify_app->callback([options, &exit_code] { exit_code = certify_command(*options); });
}

}  // namespace

void add_model_commands(CLI::App& app, int& exit_code) {
  const auto response_options = std::make_shared<ResponseOptions>();
  CLI::App* response_app = app.add_subcommand(
      "response",
      "temperatures after switching on a constant power, from the full or the reduced model");
  add_common(*response_app, *response_options);
  add_cache(*response_app, *response_options);
  response_app->add_option("--model", response_options->model, "full or reduced")
      ->required()
      ->check(CLI::IsMember({"full", "reduced"}));
  response_app
      ->add_option("--rom", response_options->rom, "reduced model file (with --model reduced)")
      ->type_name("FILE");
  response_app->add_option("--power", response_options->power, "laser power, W")
      ->required()
      ->check(number_from(0.0, 1e6))
      ->type_name("W");
  response_app
      ->add_option_function<std::string>(
          "--times",
          [response_options](const std::string& text) {
            response_options->times = number_list("--times", text, 0.0, kLongestTime);
          },
          "times after switching on, s, by comma, in any order")
      ->required()
      ->type_name("t1,t2,...");
  response_app->add_option("--csv", response_options->csv, "output file; - is standard output")
      ->type_name("FILE");
  response_app->footer(footer(
      "  photocoag response --model full --power 0.03 --times 0.001,0.01,0.1 --csv -\n"
      "  photocoag response --model reduced --rom model.json --power 1 --times 0.004 --csv -\n"
      "The eye is that of [plant]: its absorption_factor, tissue and discretization."));
  response_app->callback(
      [response_options, &exit_code] { exit_code = response(*response_options); });

  const auto reduce_options = std::make_shared<ReduceOptions>();
  CLI::App* reduce_app = app.add_subcommand(
      "reduce", "make a reduced model file from [tissue], measure and prove its error");
  add_common(*reduce_app, *reduce_options);
  reduce_app
      ->add_option(
          "--out", reduce_options->out,
          "model file to write; - is standard output. With --compare: a folder for CSV and "
          "figure, or a .csv file; may be left out")
      ->type_name("FILE");
  CLI::Option* compare =
      reduce_app->add_flag("--compare", reduce_options->compare,
                           "no model: the error of every method against the order");
  add_json(*reduce_app, reduce_options->json)->excludes(compare);
  reduce_app
      ->add_option("--method", reduce_options->method,
                   "same as --set model.method=M: pod-deim, balanced, balanced-two-sided, "
                   "irka, taylor")
      ->check(given())
      ->type_name("M");
  reduce_app
      ->add_option("--order", reduce_options->order, "same as --set model.order=n: states, 1 to 14")
      ->check(given())
      ->type_name("n");
  reduce_app->footer(
      footer("  photocoag reduce --out model.json\n"
             "  photocoag reduce --set control.period_ms=4 --order 8 --out model-250hz.json\n"
             "  photocoag reduce --compare --out comparison\n"
             "  photocoag simulate --set model.file=model.json"));
  reduce_app->callback(
      [reduce_options, &exit_code] { exit_code = reduce_command(*reduce_options); });

  const auto field_options = std::make_shared<FieldOptions>();
  CLI::App* field_app = app.add_subcommand(
      "field", "temperatures in all cells at chosen times as VTK files, for ParaView");
  add_common(*field_app, *field_options);
  field_app
      ->add_option("--model", field_options->model,
                   "full, or reduced: the field of the reduced state, T = V x")
      ->check(CLI::IsMember({"full", "reduced"}));
  field_app->add_option("--power", field_options->power, "constant laser power, W")
      ->check(number_from(0.0, 1e6))
      ->type_name("W");
  field_app->add_option("--run", field_options->run, "or the powers of this run folder")
      ->type_name("DIR");
  field_app
      ->add_option_function<std::string>(
          "--times",
          [field_options](const std::string& text) {
            field_options->times = number_list("--times", text, 0.0, kLongestTime);
          },
          "times, s, by comma: whole multiples of control.period_ms")
      ->required()
      ->type_name("t1,t2,...");
  field_app->add_option("--out", field_options->out, "folder, new or empty")
      ->required()
      ->type_name("DIR");
  field_app->footer(
      footer("  photocoag field --power 0.03 --times 0.001,0.01,0.1 --out fields\n"
             "  photocoag field --model reduced --power 0.03 --times 0.1 --out reduced-fields\n"
             "  photocoag field --run runs/first --times 0.005,0.25 --out runs/first-fields\n"
             "The eye is that of [plant]. fields.pvd is the series of all times."));
  field_app->callback([field_options, &exit_code] { exit_code = field_command(*field_options); });

  const auto export_options = std::make_shared<ExportOptions>();
  CLI::App* export_app = app.add_subcommand(
      "export",
      "write the full-order model as sparse matrices (Matrix Market), for other programs");
  add_common(*export_app, *export_options);
  export_app->add_option("--out", export_options->out, "folder, new or empty")
      ->required()
      ->type_name("DIR");
  export_app
      ->add_option_function<std::string>(
          "--alphas",
          [export_options](const std::string& text) {
            export_options->absorption_factors = number_list("--alphas", text, 0.0, 10.0);
          },
          "absorption factors of the columns of B and the rows of C, by comma")
      ->required()
      ->type_name("a1,a2,...");
  export_app->footer(
      footer("  photocoag export --alphas 0.5,0.7363,1.1 --out matrices\n"
             "Writes E.mtx, A.mtx, B.mtx, C.mtx, and validation.csv: the powers that reduce\n"
             "measures errors with and the full-order model's temperatures for them."));
  export_app->callback(
      [export_options, &exit_code] { exit_code = export_command(*export_options); });

  const auto c_options = std::make_shared<ExportCOptions>();
  CLI::App* c_app = app.add_subcommand(
      "export-c", "write the controller as C99 for a microcontroller (without the supervisor)");
  add_common(*c_app, *c_options);
  add_cache(*c_app, *c_options);
  c_app->add_option("--out", c_options->out, "folder, new or empty")->required()->type_name("DIR");
  c_app->add_flag("--float", c_options->single_precision, "single precision instead of double");
  c_app->add_option("--prefix", c_options->prefix, "of every name and file in C")
      ->type_name("NAME")
      ->capture_default_str();
  c_app->footer(
      footer("  photocoag export-c --config configs/paper-1khz.toml --out controller\n"
             "  photocoag export-c --float --prefix left_eye_ --out controller\n"
             "Settings that the C controller does not carry are refused by their key."));
  c_app->callback([c_options, &exit_code] { exit_code = export_c_command(*c_options); });

  add_certify(app, exit_code);

  const auto boundaries_options = std::make_shared<CommonOptions>();
  CLI::App* boundaries_app = app.add_subcommand(
      "boundaries",
      "tell whether [tissue] is large enough: move each boundary out, compare the peak");
  add_common(*boundaries_app, *boundaries_options);
  boundaries_app->footer(
      footer("  photocoag boundaries\n"
             "  photocoag boundaries --set tissue.domain_radius_um=1000"));
  boundaries_app->callback(
      [boundaries_options, &exit_code] { exit_code = boundaries(*boundaries_options); });

  const auto schemes_options = std::make_shared<DiscretizationsOptions>();
  CLI::App* schemes_app = app.add_subcommand(
      "discretizations",
      "what implicit Euler (the paper's) and TR-BDF2 miss of the first steps, at 1 and at 4 ms");
  add_common(*schemes_app, *schemes_options);
  schemes_app
      ->add_option("--out", schemes_options->out, "folder for CSV and figure; may be left out")
      ->type_name("DIR");
  schemes_app->footer(
      footer("  photocoag discretizations --set plant.absorption_factor=0.7363\n"
             "  photocoag discretizations --out runs/discretizations\n"
             "The eye is that of [plant]: its absorption_factor and tissue."));
  schemes_app->callback(
      [schemes_options, &exit_code] { exit_code = discretizations(*schemes_options); });

  const auto information_options = std::make_shared<InformationOptions>();
  CLI::App* information_app = app.add_subcommand(
      "information",
      "what limits a treatment of eyes that differ: how well the peak is known, and what knowing "
      "each quantity of [[prior]] would buy");
  add_common(*information_app, *information_options);
  add_cache(*information_app, *information_options);
  information_app->add_option("--eyes", information_options->eyes, "treatments per row")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  information_app
      ->add_option("--out", information_options->out, "folder for CSV and figure; may be left out")
      ->type_name("DIR");
  information_app->footer(
      footer("  photocoag information --config configs/uncertain-eye.toml\n"
             "  photocoag information --config configs/uncertain-eye.toml --eyes 1000 --out "
             "runs/information"));
  information_app->callback(
      [information_options, &exit_code] { exit_code = information(*information_options); });
}

}  // namespace photocoag
