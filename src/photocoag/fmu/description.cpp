// modelDescription.xml: what an importer reads of an FMU before it loads the library.
#include <fmt/format.h>

#include <set>
#include <string>
#include <string_view>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/fmu/package.hpp"
#include "photocoag/page/html.hpp"

namespace photocoag {
namespace {

// XML knows the same five entities.
std::string attribute(std::string_view name, std::string_view value) {
  return fmt::format(" {}=\"{}\"", name, escape_html(value));
}

std::string base_unit(const SiUnit& si) {
  std::string text = "<BaseUnit";
  const auto add = [&text](std::string_view name, int power) {
    if (power != 0) text += attribute(name, std::to_string(power));
  };
  add("kg", si.kg);
  add("m", si.m);
  add("s", si.s);
  add("K", si.K);
  if (si.factor != 1.0) text += attribute("factor", fmt::format("{}", si.factor));
  if (si.offset != 0.0) text += attribute("offset", fmt::format("{}", si.offset));
  return text + "/>";
}

std::string units_of(const std::vector<FmuVariable>& variables) {
  std::set<std::string_view> used;
  for (const FmuVariable& one : variables) {
    if (!one.unit.empty()) used.insert(one.unit);
  }
  std::string text = "  <UnitDefinitions>\n";
  for (const std::string_view unit : used) {
    const std::optional<SiUnit> si = si_unit(unit);
    if (!si) throw Error(ErrorParts{.where = std::string(unit), .problem = "no SI unit is known"});
    text += fmt::format("    <Unit{}>{}</Unit>\n", attribute("name", unit), base_unit(*si));
  }
  return text + "  </UnitDefinitions>\n";
}

std::string start_of(const FmuVariable& one) {
  if (one.type == FmuType::kFloat64) return fmt::format("{}", one.start.number);
  return fmt::format("{}", one.start.whole);
}

std::string variable(std::size_t reference, const FmuVariable& one) {
  constexpr std::string_view kTypes[] = {"Float64", "Int64", "Boolean"};
  constexpr std::string_view kCausalities[] = {"independent", "input", "output", "parameter"};
  std::string text = fmt::format("    <{}", kTypes[static_cast<std::size_t>(one.type)]);
  text += attribute("name", one.name);
  text += attribute("valueReference", std::to_string(reference));
  text += attribute("causality", kCausalities[static_cast<std::size_t>(one.role)]);
  text += attribute("variability", one.role == FmuRole::kTime        ? "continuous"
                                   : one.role == FmuRole::kParameter ? "fixed"
                                                                     : "discrete");
  if (one.role == FmuRole::kParameter) text += attribute("initial", "exact");
  if (one.role == FmuRole::kOutput) text += attribute("initial", "calculated");
  text += attribute("description", one.description);
  if (!one.unit.empty()) text += attribute("unit", one.unit);
  if (one.unit == "K") text += attribute("relativeQuantity", "true");  // a rise over ambient
  if (one.range) {
    text += attribute("min", fmt::format("{}", (*one.range)[0]));
    text += attribute("max", fmt::format("{}", (*one.range)[1]));
  }
  if (one.role == FmuRole::kInput || one.role == FmuRole::kParameter) {
    text += attribute("start", start_of(one));
  }
  return text + "/>\n";
}

// Outputs do not change between steps, whatever is set: no direct feedthrough.
std::string structure_of(const std::vector<FmuVariable>& variables) {
  std::string text = "  <ModelStructure>\n";
  for (const std::string_view kind : {"Output", "InitialUnknown"}) {
    for (std::size_t i = 0; i < variables.size(); ++i) {
      if (variables[i].role != FmuRole::kOutput) continue;
      text += fmt::format("    <{} valueReference=\"{}\"{}/>\n", kind, i,
                          kind == "Output" ? " dependencies=\"\"" : "");
    }
  }
  return text + "  </ModelStructure>\n";
}

}  // namespace

std::string fmu_model_description(const FmuDescription& fmu, const Config& config) {
  const auto& [identifier, token, variables] = fmu;
  const std::string period = fmt::format("{}", config.control.period);
  std::string text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription";
  text += attribute("fmiVersion", "3.0");
  text += attribute("modelName", identifier);
  text += attribute("instantiationToken", token);
  text += attribute("description", kResearchNotice);
  text += attribute("version", version());
  text += attribute("license", "Apache-2.0");
  text += attribute("generationTool", fmt::format("photocoag {}", version()));
  text += attribute("variableNamingConvention", "structured");
  text += ">\n  <CoSimulation";
  text += attribute("modelIdentifier", identifier);
  text += attribute("canGetAndSetFMUState", "true");
  text += attribute("canSerializeFMUState", "true");
  text += attribute("canHandleVariableCommunicationStepSize", "false");
  text += attribute("fixedInternalStepSize", period);
  text += "/>\n";
  text += units_of(variables);
  text +=
      "  <LogCategories>\n    <Category name=\"logStatusError\" description=\"why a call was "
      "refused\"/>\n  </LogCategories>\n";
  text += "  <DefaultExperiment";
  text += attribute("startTime", "0");
  text += attribute(
      "stopTime", fmt::format("{}", static_cast<double>(config.cycles()) * config.control.period));
  text += attribute("stepSize", period);
  text += "/>\n  <ModelVariables>\n";
  for (std::size_t i = 0; i < variables.size(); ++i) text += variable(i, variables[i]);
  return text + "  </ModelVariables>\n" + structure_of(variables) + "</fmiModelDescription>\n";
}

}  // namespace photocoag
