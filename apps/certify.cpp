// `photocoag certify`: proves the largest number of active-set changes of `dense` for a
// configuration.

#include <nlohmann/json.hpp>
#include <optional>

#include "command.hpp"
#include "configured.hpp"
#include "console.hpp"
#include "json_object.hpp"
#include "options.hpp"
#include "photocoag/certify/certify.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/stop_signal.hpp"
#include "photocoag/rom/file.hpp"
#include "photocoag/rom/iteration_proof.hpp"
#include "photocoag/run/model_cache.hpp"
#include "progress.hpp"

namespace photocoag {
namespace {

struct CertifyCommandOptions : CommonOptions {
  std::string absorption;      ///< "low,high"; empty: the estimator's bounds
  std::string choroid;         ///< the same of beta
  std::string free;            ///< K
  std::string previous;        ///< W; empty: the configured powers
  std::size_t boxes = 20'000;  ///< most boxes to examine
  std::string out;             ///< model file with the proof in it; may be empty
  bool again = false;          ///< prove again even if the model file has a proof
  bool json = false;
};

constexpr std::size_t kLargestModelFile = 10'000'000;
constexpr int kExitStopped = 1;

BoxRange range_of(const std::string& option, const std::string& text, BoxRange otherwise) {
  if (text.empty()) return otherwise;
  const std::vector<double> ends = number_list(option, text, -1e3, 1e3);
  if (ends.size() != 2 || ends[0] > ends[1]) {
    throw Error(ErrorParts{.where = option, .found = text, .accepted = "two numbers, LOW,HIGH"});
  }
  return {ends[0], ends[1]};
}

CertifiedBox box_of(const CertifyCommandOptions& options, const Config& config,
                    const ReducedModel& model) {
  const EstimatorSettings& estimator = config.estimator;
  const bool two = model.parameters.size() == 2;
  if (!two && !options.choroid.empty()) {
    throw Error(ErrorParts{.where = "--beta",
                           .problem = "the model has no second factor",
                           .found = options.choroid,
                           .accepted = "none, or a layer with scaled_by = \"beta\""});
  }
  CertifiedBox box =
      usual_box(config.control, {estimator.absorption_min, estimator.absorption_max},
                two ? BoxRange{estimator.choroid_min, estimator.choroid_max} : BoxRange{1.0, 1.0});
  box.absorption = range_of("--alpha", options.absorption, box.absorption);
  box.choroid = range_of("--beta", options.choroid, box.choroid);
  box.free.fill(range_of("--free", options.free, box.free[0]));
  box.previous = range_of("--previous", options.previous, box.previous);
  return box;
}

IterationProof proof_of(const Certificate& found, std::string claim) {
  return {.claim = std::move(claim),
          .seen = found.seen,
          .proved = found.proved,
          .hard_bound = found.hard_bound,
          .share = found.share,
          .covers_rounding = found.covers_rounding(),
          .boxes = found.boxes};
}

void print_proof(const IterationProof& proof) {
  const char* everywhere = proof.share == 1.0 ? "everywhere" : "in all of the box";
  print("proved    at most {} {} of the active set {}\n", proof.proved,
        proof.proved == 1 ? "change" : "changes", everywhere);
  if (proof.share < 1.0) {
    print("          at most {} in {:.4f} % of its volume\n", proof.seen, 100.0 * proof.share);
  }
  print("seen      {} at most\n", proof.seen);
  print("gives up  after {}, whatever the problem\n", proof.hard_bound);
  print("rounding  {}\n", proof.covers_rounding ? "covered by the reserve of every comparison"
                                                : "not covered: exact arithmetic only");
}

nlohmann::ordered_json proof_object(const IterationProof& proof, bool stopped, bool from_file) {
  return {{"notice", kResearchNotice},
          {"claim", proof.claim},
          {"changes_proved", proof.proved},
          {"changes_seen", proof.seen},
          {"hard_bound", proof.hard_bound},
          {"share_of_box", proof.share},
          {"covers_rounding", proof.covers_rounding},
          {"boxes", proof.boxes},
          {"from_file", from_file},
          {"stopped", stopped}};
}

int certify_command(const CertifyCommandOptions& options) {
  const Config config = configured(Use::kExportC, options.config, options.set);
  ModelStore models(config, !options.no_cache, progress_bar("reducing"));
  const ReducedModel& model = models.reduced();
  clear_progress();
  const CertifiedBox box = box_of(options, config, model);
  require_certifiable(model, config.control);
  box.validate();
  const CertifyOptions how{.boxes = options.boxes};
  const std::string claim = claim_text(config.control, box, how);
  const std::string file = config.model.file;
  const std::string text = file.empty() ? to_json(model) : read_file(file, kLargestModelFile);

  say("photocoag {}: {}\n", version(), kResearchNotice);
  std::optional<IterationProof> proof;
  if (!options.again) proof = iteration_proof(text, claim);
  const bool from_file = proof.has_value();
  bool stopped = false;
  if (!proof) {
    stop_on_signals();
    const Certificate found =
        certify(model, config.control, box, how, stop_requested(),
                [](std::string_view stage, double fraction) {
                  draw_progress(stage, fraction, "of the box, Ctrl-C: what is proved so far");
                });
    clear_progress();
    stopped = found.stopped;
    say("search    {} boxes, {} left open, {} problems solved\n", found.boxes, found.open_boxes,
        found.solved);
    proof = proof_of(found, claim);
  }
  if (!options.json) {
    print("claim     {}\n", proof->claim);
    print_proof(*proof);
  }
  if (from_file) say("from      {}\n", file);
  if (!options.out.empty() && !stopped) {
    write_output(options.out, with_iteration_proof(text, *proof));
    if (options.out != "-") say("written   {}\n", options.out);
  }
  return with_json(options.json, "certify", stopped ? kExitStopped : 0, {},
                   proof_object(*proof, stopped, from_file));
}

const Command kCertify(
    "certify", "prove an upper bound on the active-set changes of the solver (horizons 2 to 5)",
    certify_command, [](CommandLine& command, CertifyCommandOptions& options) {
      add_common(command, options);
      add_cache(command, options);
      const auto add_range = [&](const char* name, std::string& value, const char* what) {
        command.add_option(name, value, what).type_name("LOW,HIGH");
      };
      add_range("--alpha", options.absorption,
                "range of absorption factors; default: the estimator's bounds");
      add_range("--beta", options.choroid, "range of choroid factors, of a model with both");
      add_range("--free", options.free,
                "range of the free response of the peak, K, independent at each stage; default: 0 "
                "to 1.25 times control.peak_max_K");
      add_range("--previous", options.previous,
                "range of the previous power, W, and of the first cycle's reference power; "
                "default: all powers");
      command.add_option("--boxes", options.boxes, "most boxes to look at")
          .check(whole_number_from(1, 100'000'000))
          .show_default()
          .type_name("n");
      command
          .add_option("--out", options.out,
                      "model file to write, with the proof in it; may be "
                      "model.file itself")
          .type_name("FILE");
      command.add_flag("--again", options.again, "even if model.file has the proof already");
      add_json(command, options.json);
      command.footer(
          footer("  photocoag certify --config configs/paper-1khz.toml\n"
                 "  photocoag certify --set control.horizon=3 --out model.json\n"
                 "  photocoag certify --set control.horizon=3 --set model.file=model.json\n"
                 "  photocoag certify --set control.horizon=4 --free 20,32 --boxes 100000\n"
                 "Ctrl-C ends the search; what is proved so far is printed."));
    });

}  // namespace

}  // namespace photocoag
