// modelDescription.xml: what an importer reads of an FMU before it loads the library.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/fmu/package.hpp"
#include "photocoag/page/html.hpp"

namespace photocoag {
namespace {

// XML has the same five entities as escape_html().
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

// Common part of both standards; the type's attributes are separate, as FMI 2.0 has them in another
// element.
struct VariableText {
  std::string all;
  std::string of_type;
};

VariableText variable_text(std::size_t reference, const FmuVariable& one) {
  constexpr std::string_view kCausalities[] = {"independent", "input", "output", "parameter"};
  std::string text = attribute("name", one.name);
  text += attribute("valueReference", std::to_string(reference));
  text += attribute("causality", kCausalities[static_cast<std::size_t>(one.role)]);
  text += attribute("variability", one.role == FmuRole::kTime        ? "continuous"
                                   : one.role == FmuRole::kParameter ? "fixed"
                                                                     : "discrete");
  if (one.role == FmuRole::kParameter) text += attribute("initial", "exact");
  if (one.role == FmuRole::kOutput) text += attribute("initial", "calculated");
  text += attribute("description", one.description);
  std::string more;
  if (!one.unit.empty()) more += attribute("unit", one.unit);
  if (one.unit == "K") more += attribute("relativeQuantity", "true");  // a rise over ambient
  if (one.range) {
    more += attribute("min", fmt::format("{}", (*one.range)[0]));
    more += attribute("max", fmt::format("{}", (*one.range)[1]));
  }
  if (one.role == FmuRole::kInput || one.role == FmuRole::kParameter) {
    more += attribute("start", start_of(one));
  }
  return {std::move(text), std::move(more)};
}

std::string variable(std::size_t reference, const FmuVariable& one) {
  constexpr std::string_view kTypes[] = {"Float64", "Int64", "Boolean"};
  const VariableText text = variable_text(reference, one);
  return fmt::format("    <{}{}{}/>\n", kTypes[static_cast<std::size_t>(one.type)], text.all,
                     text.of_type);
}

std::string fmi2_variable(std::size_t reference, FmuVariable one) {
  constexpr std::string_view kTypes[] = {"Real", "Integer", "Boolean"};
  constexpr double kLargest = std::numeric_limits<std::int32_t>::max();
  if (one.type == FmuType::kInt64 && one.role == FmuRole::kParameter) {
    if (std::abs(static_cast<double>(one.start.whole)) > kLargest) {
      throw Error(ErrorParts{.key = one.name,
                             .problem = "a whole number of FMI 2.0 has 32 bits",
                             .found = fmt::format("{}", one.start.whole),
                             .accepted = fmt::format("up to {}, or FMI 3.0", kLargest)});
    }
    if (one.range) {
      for (double& end : *one.range) end = std::clamp(end, -kLargest, kLargest);
    }
  }
  const VariableText text = variable_text(reference, one);
  return fmt::format("    <ScalarVariable{}><{}{}/></ScalarVariable>\n", text.all,
                     kTypes[static_cast<std::size_t>(one.type)], text.of_type);
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

// Unknowns are counted from 1.
std::string fmi2_structure_of(const std::vector<FmuVariable>& variables) {
  std::string text = "  <ModelStructure>\n";
  for (const std::string_view kind : {"Outputs", "InitialUnknowns"}) {
    text += fmt::format("    <{}>\n", kind);
    for (std::size_t i = 0; i < variables.size(); ++i) {
      if (variables[i].role != FmuRole::kOutput) continue;
      text += fmt::format("      <Unknown index=\"{}\"{}/>\n", i + 1,
                          kind == "Outputs" ? " dependencies=\"\"" : "");
    }
    text += fmt::format("    </{}>\n", kind);
  }
  return text + "  </ModelStructure>\n";
}

std::string head_of(std::string_view standard, std::string_view token_name,
                    const FmuDescription& fmu) {
  std::string text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription";
  text += attribute("fmiVersion", standard);
  text += attribute("modelName", fmu.identifier);
  text += attribute(token_name, fmu.token);
  text += attribute("description", kResearchNotice);
  text += attribute("version", version());
  text += attribute("license", "Apache-2.0");
  text += attribute("generationTool", fmt::format("photocoag {}", version()));
  text += attribute("variableNamingConvention", "structured");
  return text + ">\n";
}

// Units, log categories, default experiment.
std::string middle_of(const FmuDescription& fmu, const Config& config) {
  const double period = config.control.period;
  std::string text = units_of(fmu.variables);
  text +=
      "  <LogCategories>\n    <Category name=\"logStatusError\" description=\"why a call was "
      "refused\"/>\n  </LogCategories>\n";
  text += "  <DefaultExperiment";
  text += attribute("startTime", "0");
  text += attribute("stopTime", fmt::format("{}", static_cast<double>(config.cycles()) * period));
  text += attribute("stepSize", fmt::format("{}", period));
  return text + "/>\n";
}

}  // namespace

std::string fmu_model_description(const FmuDescription& fmu, const Config& config) {
  std::string text = head_of("3.0", "instantiationToken", fmu) + "  <CoSimulation";
  text += attribute("modelIdentifier", fmu.identifier);
  text += attribute("canGetAndSetFMUState", "true");
  text += attribute("canSerializeFMUState", "true");
  text += attribute("canHandleVariableCommunicationStepSize", "false");
  text += attribute("fixedInternalStepSize", fmt::format("{}", config.control.period));
  text += "/>\n" + middle_of(fmu, config) + "  <ModelVariables>\n";
  for (std::size_t i = 0; i < fmu.variables.size(); ++i) text += variable(i, fmu.variables[i]);
  return text + "  </ModelVariables>\n" + structure_of(fmu.variables) + "</fmiModelDescription>\n";
}

std::string fmi2_model_description(const FmuDescription& fmu, const Config& config) {
  std::string text = head_of("2.0", "guid", fmu) + "  <CoSimulation";
  text += attribute("modelIdentifier", fmu.identifier);
  text += attribute("canHandleVariableCommunicationStepSize", "false");
  text += attribute("canGetAndSetFMUstate", "true");
  text += attribute("canSerializeFMUstate", "true");
  text += "/>\n" + middle_of(fmu, config) + "  <ModelVariables>\n";
  for (std::size_t i = 0; i < fmu.variables.size(); ++i) text += fmi2_variable(i, fmu.variables[i]);
  return text + "  </ModelVariables>\n" + fmi2_structure_of(fmu.variables) +
         "</fmiModelDescription>\n";
}

}  // namespace photocoag
