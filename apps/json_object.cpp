#include "json_object.hpp"

#include <nlohmann/json.hpp>

#include "console.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/rom/file.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {
namespace {

using Json = nlohmann::ordered_json;

Json proved(const OutputCertificate& output) {
  return {{"relative", output.relative_max()},
          {"relative_in_treatment", output.treatment_relative_max()}};
}

}  // namespace

CommandOption add_json(CommandLine& command, bool& wanted) {
  return command.add_flag("--json", wanted, "print one JSON object on standard output at the end");
}

int with_json(bool wanted, const std::string& command, int exit_code,
              const std::filesystem::path& folder, const Json& more) {
  if (!wanted) return exit_code;
  Json object = {{"command", command}, {"exit_code", exit_code}};
  if (!folder.empty()) object["folder"] = folder.string();
  object.update(more);
  print("{}\n", object.dump(2, ' ', false, Json::error_handler_t::replace));
  return exit_code;
}

std::string version_object() {
  const Json object = {{"name", "photocoag"},
                       {"version", version()},
                       {"source_hash", source_hash()},
                       {"osqp", PHOTOCOAG_HAS_OSQP != 0},
                       {"model_file_versions", {kModelFileVersion, kUncertainModelFileVersion}},
                       {"notice", kResearchNotice}};
  return object.dump(2);
}

Json summary_object(const std::string& text) { return {{"summary", Json::parse(text)}}; }

Json reduction_object(const ReducedModel& model, const FullOrderModel& full,
                      const std::string& file) {
  const ErrorReport& error = model.error;
  Json object = {{"notice", kResearchNotice},
                 {"file", file},
                 {"method", model.method},
                 {"refinement", model.refinement},
                 {"order", model.order()},
                 {"period_ms", model.period * 1e3},
                 {"full_order_states", full.states()},
                 {"absorption_min", model.parameters[0].min},
                 {"absorption_max", model.parameters[0].max},
                 {"peak_error_relative_max", error.peak_max()},
                 {"volume_error_relative_max", error.volume_max()},
                 {"errors", Json::array()}};
  for (std::size_t i = 0; i < error.absorption_factors.size(); ++i) {
    Json row = {{"absorption_factor", error.absorption_factors[i]}};
    if (!error.choroid_factors.empty()) row["choroid_factor"] = error.choroid_factors[i];
    row["peak_relative"] = error.peak[i];
    row["volume_relative"] = error.volume[i];
    object["errors"].push_back(std::move(row));
  }
  object["proved"] = Json();
  if (model.certificate) {
    object["proved"] = {{"peak", proved(model.certificate->peak)},
                        {"volume", proved(model.certificate->volume)},
                        {"treatment_ms", model.certificate->treatment_duration * 1e3}};
  }
  return object;
}

}  // namespace photocoag
