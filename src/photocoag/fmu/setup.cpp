#include "photocoag/fmu/setup.hpp"

#include <fmt/format.h>

#include <cstdlib>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/sha256.hpp"
#include "photocoag/rom/file.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kLargest = 10'000'000;  // bytes, of a file

std::string text_if_there(const std::filesystem::path& file) {
  return std::filesystem::exists(file) ? read_file(file, kLargest) : std::string();
}

}  // namespace

std::string fmu_token(const FmuResources& resources) {
  return sha256_hex(fmt::format("{}\n{}\n{}\n{}\n{}", version(), to_string(resources.kind),
                                sha256_hex(resources.config), sha256_hex(resources.model),
                                sha256_hex(resources.margin)));
}

FmuResources read_fmu_resources(const std::filesystem::path& folder) {
  const std::string kind = read_file(folder / "kind.txt", kLargest);
  if (kind != "eye\n" && kind != "controller\n") {
    throw Error(ErrorParts{.where = folder / "kind.txt", .accepted = "eye or controller"});
  }
  return {.kind = kind == "eye\n" ? FmuKind::kEye : FmuKind::kController,
          .config = read_file(folder / "config.toml", kLargest),
          .model = text_if_there(folder / "model.json"),
          .margin = text_if_there(folder / "margin.txt")};
}

std::string margin_text(const TissueMargin& margin) {
  if (!margin.needed()) return {};
  std::string text = fmt::format("{}\n", margin.factor);  // shortest that reads back the same
  for (const double share : margin.shares) text += fmt::format("{}\n", share);
  return text;
}

TissueMargin margin_from(const std::string& text) {
  TissueMargin margin;
  bool first = true;
  for (const char* at = text.c_str(); *at != '\0';) {
    char* end = nullptr;
    const double value = std::strtod(at, &end);
    if (end == at || !(value > 0.0 && value <= 1.0)) {
      throw Error(ErrorParts{.where = "margin.txt", .accepted = "numbers above 0, at most 1"});
    }
    if (first) {
      margin.factor = value;
    } else {
      margin.shares.push_back(value);
    }
    first = false;
    at = *end == '\n' ? end + 1 : end;
  }
  return margin;
}

FmuSetup fmu_setup(const FmuResources& resources, const std::filesystem::path& folder) {
  FmuSetup setup;
  setup.kind = resources.kind;
  setup.config = load_config(folder / "config.toml", {});
  setup.token = fmu_token(resources);
  setup.margin = margin_from(resources.margin);
  setup.variables = fmu_variables(setup.kind, setup.config);
  if (!resources.model.empty()) {
    setup.reduced = std::make_shared<const ReducedModel>(
        from_json(resources.model, (folder / "model.json").string()));
  } else if (setup.kind == FmuKind::kEye && setup.config.plant.model == PlantModel::kFull) {
    setup.full =
        std::make_shared<const FullOrderModel>(setup.config.plant.tissue, setup.config.grid);
  } else {
    throw Error(ErrorParts{.where = folder / "model.json", .problem = "is missing"});
  }
  return setup;
}

Config with_parameters(const FmuSetup& setup, const std::vector<FmuValue>& values) {
  Config config = setup.config;
  for (std::size_t i = 0; i < setup.variables.size(); ++i) {
    const FmuVariable& variable = setup.variables[i];
    if (variable.role != FmuRole::kParameter) continue;
    set_fmu_parameter(config, variable.name, values[i]);
  }
  config.validate();
  return config;
}

}  // namespace photocoag
