#include "photocoag/export/c_export.hpp"

#include <algorithm>
#include <cctype>
#include <string_view>

#include "photocoag/core/check.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/export/c_model.hpp"
#include "photocoag/export/c_sources.hpp"
#include "photocoag/loop/controller.hpp"
#include "photocoag/rom/intersample.hpp"

namespace photocoag {
namespace {

bool in_identifier(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) {
    return static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  });
  return text;
}

// pc_ at the beginning of a name becomes the prefix, PC_ the same in capitals.
std::string renamed(std::string_view text, const std::string& prefix) {
  const std::string capitals = upper(prefix);
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const std::string_view head = text.substr(i, 3);
    const bool begins = i == 0 || !in_identifier(text[i - 1]);
    if (begins && (head == "pc_" || head == "PC_")) {
      out += head == "pc_" ? prefix : capitals;
      i += head.size();
    } else {
      out += text[i++];
    }
  }
  return out;
}

std::string filled(const std::string& text, const std::map<std::string, std::string>& values) {
  std::string out;
  std::size_t from = 0;
  for (std::size_t at; (at = text.find('@', from)) != std::string::npos;) {
    const std::size_t end = text.find('@', at + 1);
    const std::string name = text.substr(at + 1, end - at - 1);
    const auto value = values.find(name);
    if (value == values.end()) {
      throw Error(ErrorParts{.where = "src/export/c", .problem = "no value for @" + name + "@"});
    }
    out.append(text, from, at - from).append(value->second);
    from = end + 1;
  }
  return out.append(text, from, std::string::npos);
}

bool is_prefix(const std::string& prefix) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
  };
  return !prefix.empty() && prefix.size() <= 20 && prefix[0] >= 'a' && prefix[0] <= 'z' &&
         std::all_of(prefix.begin(), prefix.end(), allowed);
}

}  // namespace

void require_exportable(const ControlSettings& control, const EstimatorSettings& estimator,
                        const CExportOptions& options) {
  require(is_prefix(options.prefix), "--prefix", std::string_view(options.prefix),
          "1 to 20 lower-case letters, digits and underscores, a letter first");
  require(estimator.kind != EstimatorKind::kMhe, "estimator.kind", std::string_view("\"mhe\""),
          "\"ekf\" or \"posterior\" in exported C");
  require(estimator.unknowns == Unknowns::kRpe, "estimator.unknowns",
          std::string_view("\"rpe-and-choroid\""),
          "\"rpe\": the exported C estimates the absorption factor alone");
  if (estimator.kind == EstimatorKind::kPosterior) {
    require(control.robust != Robustness::kCertified, "control.robust",
            std::string_view("\"certified\""),
            "\"none\" or \"chance\" with estimator.kind = \"posterior\" in exported C");
    require(estimator.timing.plain(), "estimator.sample_averaging_periods",
            estimator.timing.averaging,
            "0, and no lags, with estimator.kind = \"posterior\" in exported C");
  }
  require(control.solver == SolverKind::kDense, "control.solver",
          std::string_view(control.solver == SolverKind::kOsqp ? "\"osqp\"" : "\"osqp-condensed\""),
          "\"dense\": the exported C has the exact solver alone");
}

std::vector<ExportedFile> export_c(const ReducedModel& model, const ControlSettings& control,
                                   const EstimatorSettings& estimator,
                                   const CExportOptions& options) {
  require_exportable(control, estimator, options);
  static_cast<void>(Controller(controller_model(model, estimator.timing), control, estimator));
  const std::map<std::string, std::string> values =
      c_placeholders(model, control, estimator, options);
  std::vector<ExportedFile> files;
  const bool posterior = estimator.kind == EstimatorKind::kPosterior;
  for (const CSource& source : c_sources()) {
    std::string name(source.name);
    // Two estimators with the same functions: the one that is asked for is the filter.
    if (name.starts_with(posterior ? "pc_filter." : "pc_posterior.")) continue;
    if (name.starts_with("pc_posterior.")) name.replace(0, 13, "pc_filter.");
    if (name.ends_with(".in")) name.resize(name.size() - 3);
    files.push_back({renamed(name, options.prefix),
                     renamed(filled(std::string(source.text), values), options.prefix)});
  }
  return files;
}

}  // namespace photocoag
