// What is inside an FMU, without the C boundary (python/tests/test_fmu_calls.py has that): a step
// takes nothing from the heap, a minute is the most that is serialised, every unit of the
// configuration is known, handles are no pointers.
#include "photocoag/fmu/instance.hpp"

#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <memory>
#include <set>
#include <variant>

#include "photocoag/config/fields.hpp"
#include "photocoag/fmu/handles.hpp"
#include "photocoag/fmu/package.hpp"
#include "support/heap_guard.hpp"
#include "support/reduced_models.hpp"
#include "support/temporary_folder.hpp"
#include "support/thrown.hpp"

namespace photocoag::testing {
namespace {

Config coarse_config() {
  Config config;
  config.grid.min_cells = 2000;
  return config;
}

TissueMargin margin_of(double factor, std::vector<double> shares) {
  TissueMargin margin;
  margin.factor = factor;
  margin.shares = std::move(shares);
  return margin;
}

/// Resources in a folder, and the instance made from them.
struct Made {
  TemporaryFolder folder;
  std::string token;
  std::unique_ptr<FmuInstance> instance;

  Made(FmuKind kind, const Config& config, const TissueMargin& margin = {}) {
    static const ReducedModel model = coarse_model();
    const bool full = kind == FmuKind::kEye && config.plant.model == PlantModel::kFull;
    const FmuResources resources = fmu_resources(kind, config, full ? nullptr : &model, margin);
    for (const FmuFile& file : fmu_files(resources, config, FmiVersion::k3)) {
      const std::string name = std::filesystem::path(file.name).filename();
      std::ofstream(folder.file(name)) << file.text;
    }
    token = fmu_token(resources);
    instance = std::make_unique<FmuInstance>(folder.path(), token);
  }

  void begin() {
    instance->enter_initialization(0.0, false, 0.0);
    instance->exit_initialization();
  }
};

std::vector<Config> eyes() {
  std::vector<Config> all(4, coarse_config());
  all[1].plant.bench.timing.power_lag = 0.2;
  all[2].plant.model = PlantModel::kReduced;
  all[3].plant.model = PlantModel::kReduced;
  all[3].plant.bench.absorption_drift = 0.5;
  return all;
}

std::vector<Config> controllers() {
  std::vector<Config> all(3, coarse_config());
  all[1].safety.supervised = false;
  all[1].estimator.kind = EstimatorKind::kMhe;
  all[2].control.delay = 1;
  return all;
}

void expect_no_heap(FmuKind kind, const Config& config) {
  Made made(kind, config);
  made.begin();
  const double period = config.control.period;
  const HeapGuard guard;
  for (int k = 0; k < 200; ++k) {
    made.instance->set_value(kFirstFmuInput, {.number = kind == FmuKind::kEye ? 0.02 : 0.1 * k});
    made.instance->step(k * period, period);
  }
  const HeapUse used = guard.use();
  EXPECT_EQ(used, HeapUse{}) << to_string(kind);
}

TEST(FmuStep, TakesNothingFromTheHeap) {
  for (const Config& config : eyes()) expect_no_heap(FmuKind::kEye, config);
  for (const Config& config : controllers()) expect_no_heap(FmuKind::kController, config);
}

TEST(FmuStep, TheEyesSampleHasItsOffset) {
  const auto first_outputs = [](const Config& config) {
    Made made(FmuKind::kEye, config);
    made.begin();
    made.instance->set_value(kFirstFmuInput, {.number = 0.02});
    made.instance->step(0.0, config.control.period);
    std::array<double, 4> outputs{};  // sample, applied power, true volume, true peak
    for (std::uint32_t i = 0; i < 4; ++i) {
      outputs[i] = made.instance->value(kFirstFmuInput + 1 + i).number;
    }
    return outputs;
  };
  for (Config config : eyes()) {
    const std::array<double, 4> right = first_outputs(config);
    config.plant.bench.sample_offset = -3.0;
    const std::array<double, 4> seen = first_outputs(config);
    EXPECT_NEAR(seen[0], right[0] - 3.0, 1e-12);
    for (int i = 1; i < 4; ++i) EXPECT_EQ(seen[i], right[i]) << i;
    EXPECT_GT(seen[3], 0.0);
  }
}

TEST(FmuState, AMinuteIsTheMostThatIsSerialised) {
  Config config = coarse_config();
  config.control.period = 0.1;
  config.plant.model = PlantModel::kReduced;
  config.safety.supervised = false;
  ReducedModel model = coarse_model();
  model.discretize(config.control.period, model.discretization);
  TemporaryFolder folder;
  const FmuResources resources = fmu_resources(FmuKind::kEye, config, &model, {});
  for (const FmuFile& file : fmu_files(resources, config, FmiVersion::k3)) {
    std::ofstream(folder.file(std::filesystem::path(file.name).filename())) << file.text;
  }
  FmuInstance instance(folder.path(), fmu_token(resources));
  instance.enter_initialization(0.0, false, 0.0);
  instance.exit_initialization();
  for (int k = 0; k < 600; ++k) instance.step(instance.time(), config.control.period);
  const FmuState* minute = instance.save_state();
  EXPECT_GT(instance.serialized_size(minute), 600 * sizeof(double));
  instance.step(instance.time(), config.control.period);
  const FmuState* more = instance.save_state();
  EXPECT_EQ(thrown_by([&] { instance.serialize(more); }).accepted, "60 s");
  instance.restore(more);
  instance.step(instance.time(), config.control.period);
}

TEST(FmuState, BytesOfAnotherFmuAreRefused) {
  Config config = coarse_config();
  config.plant.model = PlantModel::kReduced;
  Made first(FmuKind::kEye, config);
  config.plant.noise = 0.1;
  Made second(FmuKind::kEye, config);
  const std::vector<std::uint8_t> bytes = first.instance->serialize(first.instance->save_state());
  EXPECT_NE(first.instance->deserialize(bytes), nullptr);
  EXPECT_EQ(thrown_by([&] { second.instance->deserialize(bytes); }).problem,
            "not a serialized state of this FMU");
}

TEST(FmuResources, WhatWasChangedAfterwardsIsRefused) {
  Made made(FmuKind::kController, coarse_config());
  FmuInstance again(made.folder.path(), made.token);
  std::ofstream(made.folder.file("config.toml"), std::ios::app) << "# one more line\n";
  EXPECT_EQ(thrown_by([&] { FmuInstance(made.folder.path(), made.token); }).found, made.token);
}

TEST(FmuResources, AMarginComesBackAsItWas) {
  const TissueMargin margin = margin_of(0.9123456789012345, {0.7, 1.0 / 3.0, 1.0});
  const TissueMargin back = margin_from(margin_text(margin));
  EXPECT_EQ(back.factor, margin.factor);
  EXPECT_EQ(back.shares, margin.shares);
  EXPECT_EQ(margin_text({}), "");
  EXPECT_FALSE(margin_from("").needed());
  EXPECT_EQ(thrown_by([] { margin_from("0.9\nx"); }).where, "margin.txt");
  EXPECT_EQ(thrown_by([] { margin_from("1.5\n"); }).where, "margin.txt");
}

TEST(FmuController, IsToldItsMargin) {
  Made plain(FmuKind::kController, coarse_config());
  Made careful(FmuKind::kController, coarse_config(), margin_of(0.5, {}));
  plain.begin();
  careful.begin();
  const auto power =
      static_cast<std::uint32_t>(kFirstFmuInput + fmu_layout(FmuKind::kController).inputs);
  EXPECT_LT(careful.instance->value(power).number, plain.instance->value(power).number);
}

TEST(FmuVariables, EveryUnitOfTheConfigurationIsKnown) {
  Config config;
  std::set<std::string_view> units;
  const auto note = [&units](const Field& field) {
    if (const auto* number = std::get_if<NumberField>(&field.value))
      units.insert(number->unit.name);
    if (const auto* some = std::get_if<OptionalNumberField>(&field.value)) {
      units.insert(some->unit.name);
    }
    if (const auto* several = std::get_if<NumbersField>(&field.value)) {
      units.insert(several->unit.name);
    }
  };
  for (const Field& field : fields(config)) note(field);
  for (const Field& field : layer_fields(config.tissue.layers[0], "layer")) note(field);
  EXPECT_GT(units.size(), 10U);
  for (const std::string_view unit : units) EXPECT_TRUE(si_unit(unit)) << unit;
  EXPECT_FALSE(si_unit("furlong"));
  // A parameter is set in the unit of its key: none may need a factor.
  for (const FmuKind kind : {FmuKind::kEye, FmuKind::kController}) {
    const std::vector<FmuVariable> all = fmu_variables(kind, config);
    for (const FmuVariable& one : all) EXPECT_EQ(si_unit(one.unit)->factor, 1.0) << one.name;
    const FmuLayout layout = fmu_layout(kind);
    for (std::size_t i = 0; i < all.size(); ++i) {
      const FmuRole expected = i == 0                                ? FmuRole::kTime
                               : i <= layout.inputs                  ? FmuRole::kInput
                               : i <= layout.inputs + layout.outputs ? FmuRole::kOutput
                                                                     : FmuRole::kParameter;
      EXPECT_EQ(all[i].role, expected) << all[i].name;
    }
  }
}

TEST(FmuVariables, WhatAMarginOrAPriorBelongsToIsNoParameter) {
  const auto count = [](const Config& config) {
    std::size_t n = 0;
    for (const FmuVariable& one : fmu_variables(FmuKind::kController, config)) {
      n += one.role == FmuRole::kParameter ? 1 : 0;
    }
    return n;
  };
  Config config;
  EXPECT_GT(count(config), 5U);
  config.uncertainty.spot_radius = 0.1;
  EXPECT_EQ(count(config), 0U);
  config.uncertainty = {};
  config.control.robust = Robustness::kChance;
  EXPECT_EQ(count(config), 0U);
}

TEST(FmuHandles, AreNoPointersAndNeverComeBack) {
  Handles<int> handles;
  EXPECT_EQ(handles.find(nullptr), nullptr);
  int somewhere = 0;
  EXPECT_EQ(handles.find(&somewhere), nullptr);
  void* first = handles.add(std::make_unique<int>(1));
  ASSERT_NE(handles.find(first), nullptr);
  handles.remove(first);
  EXPECT_EQ(handles.find(first), nullptr);
  void* second = handles.add(std::make_unique<int>(2));
  EXPECT_NE(second, first);
  EXPECT_EQ(handles.find(first), nullptr);
  std::vector<void*> all;
  for (std::size_t i = 1; i < Handles<int>::kMost; ++i) {
    all.push_back(handles.add(std::make_unique<int>(3)));
    ASSERT_NE(all.back(), nullptr);
  }
  EXPECT_EQ(handles.add(std::make_unique<int>(4)), nullptr) << "full";
  for (void* one : all) handles.remove(one);
  handles.remove(second);
}

// An importer's thread may have little.
TEST(FmuPart, FitsOnAStack) { EXPECT_LT(sizeof(FmuPart), 300'000U); }

}  // namespace
}  // namespace photocoag::testing
