// The reduced model file: what is written comes back bit for bit, and the stored error can be
// measured again.
#include "photocoag/rom/file.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "support/reduced_models.hpp"
#include "support/temporary_folder.hpp"
#include "support/tissues.hpp"

namespace photocoag {
namespace {

using testing::coarse_full_model;
using testing::coarse_model;
using testing::Json;

void expect_same(const ReducedModel& a, const ReducedModel& b) {
  EXPECT_EQ(a.A, b.A);
  EXPECT_EQ(a.B, b.B);
  EXPECT_EQ(a.C_volume, b.C_volume);
  EXPECT_EQ(a.C_peak, b.C_peak);
  EXPECT_EQ(a.theta, b.theta);
  EXPECT_EQ(a.volume_normalized, b.volume_normalized);
  EXPECT_EQ(a.whole, b.whole);
  EXPECT_EQ(a.period, b.period);
  EXPECT_EQ(a.discretization, b.discretization);
  EXPECT_EQ(a.A_d, b.A_d);
  EXPECT_EQ(a.B_d, b.B_d);
  ASSERT_EQ(a.parameters.size(), b.parameters.size());
  for (std::size_t q = 0; q < a.parameters.size(); ++q) {
    EXPECT_EQ(a.parameters[q].min, b.parameters[q].min);
    EXPECT_EQ(a.parameters[q].max, b.parameters[q].max);
  }
  EXPECT_EQ(a.method, b.method);
  EXPECT_EQ(a.parameter_dependence, b.parameter_dependence);
  EXPECT_EQ(a.tissue, b.tissue);
  EXPECT_EQ(a.full_order_states, b.full_order_states);
  EXPECT_EQ(a.error.absorption_factors, b.error.absorption_factors);
  EXPECT_EQ(a.error.peak, b.error.peak);
  EXPECT_EQ(a.error.volume, b.error.volume);
  EXPECT_EQ(a.error.duration, b.error.duration);
  EXPECT_EQ(a.error.mean_dwell, b.error.mean_dwell);
  EXPECT_EQ(a.error.seed, b.error.seed);
}

TEST(ModelFile, RoundTripIsBitIdentical) {
  Tissue odd = testing::normalized(testing::literature_choroid());
  odd.layers[0].name = "ret\"ina \xC3\xA4\\";  // a quote, a backslash, a letter beyond ASCII
  odd.ambient_celsius = 37.1;
  for (const ReducedModel& model :
       {coarse_model(), coarse_model(odd, 4e-3, Discretization::kImplicitEuler),
        coarse_model(testing::ring_beam(testing::layered()), 4e-3, Discretization::kTrBdf2),
        coarse_model(testing::gaussian(Tissue{}), 4e-3)}) {
    const std::string text = to_json(model);
    const ReducedModel back = from_json(text, "memory");
    expect_same(model, back);
    EXPECT_EQ(to_json(back), text);
  }
}

TEST(ModelFile, SaveAndLoad) {
  const testing::TemporaryFolder folder;
  const ReducedModel model = coarse_model();
  save_reduced_model(model, folder.file("model.json"));
  expect_same(load_reduced_model(folder.file("model.json")), model);
  EXPECT_EQ(read_file(folder.file("model.json"), 1000000), to_json(model));
}

// The check recomputes from the file alone: load it, build the full-order model of the tissue it
// names, measure.
TEST(ModelFile, StoredErrorIsReproducedExactly) {
  for (const auto how : {Discretization::kZeroOrderHold, Discretization::kImplicitEuler}) {
    const std::string text = to_json(coarse_model({}, 1e-3, how));
    const ReducedModel loaded = from_json(text, "memory");
    const auto full = coarse_full_model(loaded.tissue);
    ASSERT_EQ(full->states(), loaded.full_order_states);
    const ErrorReport again = measure_error(loaded, full,
                                            {.absorption_factors = loaded.error.absorption_factors,
                                             .duration = loaded.error.duration,
                                             .mean_dwell = loaded.error.mean_dwell,
                                             .seed = loaded.error.seed});
    EXPECT_EQ(again.peak, loaded.error.peak);
    EXPECT_EQ(again.volume, loaded.error.volume);
    // Another signal gives other numbers of the same size.
    const ErrorReport other = measure_error(
        loaded, full,
        {.absorption_factors = loaded.error.absorption_factors, .mean_dwell = 25e-3, .seed = 4711});
    EXPECT_NE(other.peak, loaded.error.peak);
    EXPECT_NEAR(other.peak_max(), loaded.error.peak_max(), 0.3 * loaded.error.peak_max());
    EXPECT_NEAR(other.volume_max(), loaded.error.volume_max(), 0.3 * loaded.error.volume_max());
  }
}

TEST(ModelFile, SaysWhereItComesFrom) {
  const Json json = Json::parse(to_json(coarse_model()));
  EXPECT_EQ(json.at("version"), kModelFileVersion);
  EXPECT_EQ(json.at("program").at("version"), std::string(version()));
  EXPECT_EQ(json.at("program").at("source_hash"), std::string(source_hash()));
  EXPECT_EQ(json.at("parameters").at(0).at("name"), "alpha");
  EXPECT_EQ(json.at("notice"), std::string(kResearchNotice));
}

// The rule of docs/model-file.md, done here without the code under test: remove the key "checksum",
// write the rest without white space.
TEST(ModelFile, ChecksumRuleIsTheDocumentedOne) {
  const std::string text = to_json(coarse_model());
  const std::string key = ",\n \"checksum\": \"";
  const std::size_t at = text.find(key);
  ASSERT_NE(at, std::string::npos);
  const std::string stored = text.substr(at + key.size(), 64);
  std::string bare;
  bool in_text = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (i == at) i += key.size() + 65;  // to after the closing quote
    const char c = text[i];
    if (c == '"' && (i == 0 || text[i - 1] != '\\')) in_text = !in_text;
    if (in_text || (c != ' ' && c != '\n')) bare += c;
  }
  EXPECT_EQ(sha256_hex(bare), stored);
}

TEST(ModelFile, RefusedPathsAreNamed) {
  const testing::TemporaryFolder folder;
  EXPECT_THROW(load_reduced_model(folder.file("missing.json")), Error);
  EXPECT_THROW(load_reduced_model(folder.path().string()), Error);
  write_file(folder.file("large.json"), std::string(10'000'001, ' '));
  EXPECT_THROW(load_reduced_model(folder.file("large.json")), Error);
  EXPECT_THROW(save_reduced_model(coarse_model(), folder.file("missing/model.json")), Error);
}

}  // namespace
}  // namespace photocoag
