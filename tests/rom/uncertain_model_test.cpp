// Responses over several uncertain quantities: derivatives, control model, file.
#include <gtest/gtest.h>

#include "photocoag/core/error.hpp"
#include "photocoag/rom/file.hpp"
#include "support/reduced_models.hpp"
#include "support/uncertain_eyes.hpp"

namespace photocoag::testing {
namespace {

struct Residues {
  StateVector peak;
  StateVector volume;
  ResidueSlopes peak_slope;
  ResidueSlopes volume_slope;
};

Residues residues_at(const QuantityVector& logs) {
  Residues r;
  seven_quantity_model()->evaluate(logs, r.peak, r.peak_slope, r.volume, r.volume_slope);
  return r;
}

TEST(UncertainModel, DerivativesAreTheDifferences) {
  const QuantityVector at = logs_at({0.3, 0.6, 0.4, 0.7, 0.5, 0.2, 0.5});
  const Residues here = residues_at(at);
  for (Eigen::Index q = 0; q < at.size(); ++q) {
    constexpr double kStep = 1e-5;
    QuantityVector more = at;
    QuantityVector less = at;
    more[q] += kStep;
    less[q] -= kStep;
    const Residues above = residues_at(more);
    const Residues below = residues_at(less);
    const StateVector peak = (above.peak - below.peak) / (2.0 * kStep);
    const StateVector volume = (above.volume - below.volume) / (2.0 * kStep);
    // Central differences: the square of the step times a third derivative of order one.
    EXPECT_LT((peak - here.peak_slope.col(q)).norm(), 1e-7 * here.peak.norm()) << q;
    EXPECT_LT((volume - here.volume_slope.col(q)).norm(), 1e-7 * here.volume.norm()) << q;
  }
}

TEST(UncertainModel, TransmissionScalesBothAndCalibrationNeither) {
  const Residues here = residues_at(logs_at({0.5, 0.5, 0.5, 0.5, 0.2, 0.5, 0.1}));
  const Residues other = residues_at(logs_at({0.5, 0.5, 0.5, 0.5, 0.9, 0.5, 0.8}));
  const double ratio = std::exp(0.7 * std::log(1.0 / 0.85));
  EXPECT_LT((other.peak - ratio * here.peak).norm(), 1e-12 * here.peak.norm());
  EXPECT_LT((other.volume - ratio * here.volume).norm(), 1e-12 * here.volume.norm());
}

TEST(UncertainModel, OutsideTheBoxIsAsAtItsEdge) {
  const QuantityVector edge = logs_at({1.0, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5});
  const QuantityVector outside = logs_at({1.3, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5});
  EXPECT_EQ(residues_at(edge).peak, residues_at(outside).peak);
}

TEST(UncertainModel, MorePowerMoreAbsorptionMoreHeat) {
  StateVector decay;
  StateVector gain;
  const UncertainModel& model = *seven_quantity_model();
  model.step_of(model.period, decay, gain);
  double before = 0.0;
  for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    const Residues r = residues_at(logs_at({share, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5}));
    const double first = r.peak.dot(gain);
    EXPECT_GT(first, before);
    before = first;
  }
}

TEST(UncertainModelFile, ReadsBackBitByBit) {
  ReducedModel model = coarse_model();
  EXPECT_NE(to_json(model).find("\"version\": 1"), std::string::npos);
  model.uncertain = seven_quantity_model();
  const std::string text = to_json(model);
  EXPECT_NE(text.find("\"version\": 2"), std::string::npos);
  const ReducedModel back = from_json(text, "test");
  ASSERT_TRUE(back.uncertain);
  EXPECT_EQ(to_json(back), text);
  EXPECT_EQ(back.uncertain->quantities, model.uncertain->quantities);
  EXPECT_EQ(back.uncertain->peak, model.uncertain->peak);
  EXPECT_EQ(back.uncertain->volume, model.uncertain->volume);
}

TEST(UncertainModelFile, RefusesWhatDoesNotFitTogether) {
  ReducedModel model = coarse_model();
  model.uncertain = seven_quantity_model();
  const Json good = Json::parse(to_json(model));
  const auto refused = [&](const auto& change) {
    Json bad = good;
    change(bad["uncertain"]);
    EXPECT_THROW(from_json(sealed(bad), "test"), Error);
  };
  EXPECT_NO_THROW(from_json(sealed(good), "test"));
  refused([](Json& u) { u["rates_per_s"][0] = -1.0; });
  refused([](Json& u) { u["terms"][3][0] = 200; });
  refused([](Json& u) { u["terms"][3][2] = 9; });
  refused([](Json& u) { u["peak"].erase(0); });
  refused([](Json& u) { u["peak"][0].erase(0); });
  refused([](Json& u) { u["quantities"][0]["min"] = 0.0; });
  refused([](Json& u) { u["quantities"][1]["name"] = "mood"; });
  refused([](Json& u) { u["peak_exponents"].erase(0); });
  refused([](Json& u) { u.erase("volume"); });
  for (const char* output : {"peak", "volume"}) {
    refused([output](Json& u) {  // power cools
      for (Json& row : u[output]) {
        for (Json& number : row) number = -number.get<double>();
      }
    });
  }
}

}  // namespace
}  // namespace photocoag::testing
