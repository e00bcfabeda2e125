// The model file with its newer parts: kinds of theta, the certificate, files made before them.
#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "photocoag/core/sha256.hpp"
#include "photocoag/mor/reduce.hpp"
#include "photocoag/rom/file.hpp"
#include "support/thrown.hpp"

namespace photocoag {
namespace {

using Json = nlohmann::ordered_json;

ReducedModel model_with(const ReductionSettings& settings) {
  const auto full =
      std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{.min_cells = 1000});
  return reduce(full, settings, 4e-3, Discretization::kZeroOrderHold);
}

// As a careful forger would: the checksum made to fit again.
std::string signed_again(Json json) {
  json.erase("checksum");
  json["checksum"] = sha256_hex(json.dump());
  return json.dump(1);
}

TEST(ModelFile, EveryKindOfThetaComesBackAsItWas) {
  for (const ParameterDependence dependence :
       {ParameterDependence::kDeim, ParameterDependence::kQDeim, ParameterDependence::kChebyshev,
        ParameterDependence::kTaylor}) {
    const ReducedModel model = model_with({.parameter_dependence = dependence});
    const std::string text = to_json(model);
    const ReducedModel read = from_json(text, "file");
    EXPECT_EQ(to_json(read), text);
    EXPECT_EQ(read.theta, model.theta);
    EXPECT_EQ(read.parameter_dependence, to_string(dependence));
    ASSERT_TRUE(read.certificate.has_value());
    EXPECT_EQ(read.certificate->peak.bound, model.certificate->peak.bound);
    EXPECT_EQ(read.certificate->volume.majorant, model.certificate->volume.majorant);
    ParametricMatrices a, b;
    model.evaluate(0.77, a);
    read.evaluate(0.77, b);
    EXPECT_EQ(a.volume_slope[0], b.volume_slope[0]);
  }
}

TEST(ModelFile, FilesMadeBeforeTheCertificateStillLoad) {
  Json json = Json::parse(to_json(model_with({})));
  json.erase("certificate");
  json.erase("parameter_dependence");
  const ReducedModel model = from_json(signed_again(json), "old.json");
  EXPECT_FALSE(model.certificate.has_value());
  EXPECT_EQ(model.parameter_dependence, "deim");
}

TEST(ModelFile, ATamperedCertificateIsRefused) {
  const std::string text = to_json(model_with({}));
  Json json = Json::parse(text);
  json["certificate"]["peak"]["bound_K_per_W"][7] = 1e-3;
  EXPECT_EQ(testing::thrown_by([&] { from_json(json.dump(1), "m.json"); }).key, "checksum");
  json = Json::parse(text);
  json.erase("certificate");
  EXPECT_EQ(testing::thrown_by([&] { from_json(json.dump(1), "m.json"); }).key, "checksum");
}

TEST(ModelFile, ACertificateThatCannotBeRightIsRefused) {
  const Json good = Json::parse(to_json(model_with({})));
  const auto refused = [](Json json) {
    return testing::thrown_by([&] { from_json(signed_again(std::move(json)), "m.json"); }).key;
  };
  Json json = good;
  json["certificate"]["peak"]["bound_K_per_W"][7] = -1.0;
  EXPECT_EQ(refused(json), "certificate.peak");
  json = good;
  json["certificate"]["decay_per_period"][0] = 1.0;
  EXPECT_EQ(refused(json), "certificate.decay");
  json = good;
  json["certificate"]["volume"]["scale_K_per_W"].erase(3);
  EXPECT_EQ(refused(json), "certificate.volume");
  json = good;
  json["certificate"]["absorption_factors"][1] = 0.1;
  EXPECT_EQ(refused(json), "certificate.absorption_factors");
  json = good;
  json["certificate"].erase("peak");
  EXPECT_EQ(refused(json), "certificate.peak");
}

TEST(ModelFile, BadThetaIsNamed) {
  const Json good =
      Json::parse(to_json(model_with({.parameter_dependence = ParameterDependence::kChebyshev})));
  const auto refused = [](Json json) {
    return testing::thrown_by([&] { from_json(signed_again(std::move(json)), "m.json"); });
  };
  Json json = good;
  json["theta"]["kind"] = "splines";
  EXPECT_EQ(refused(json).key, "theta.kind");
  EXPECT_NE(refused(json).accepted.find("chebyshev"), std::string::npos);
  json = good;
  json["theta"]["terms"] = 13;
  EXPECT_EQ(refused(json).key, "theta.terms");
  json = good;
  json["theta"]["half_width"] = 0.0;
  EXPECT_EQ(refused(json).key, "theta.half_width");
  json = good;
  json["theta"]["terms"] = 7;  // not the number of columns of B
  EXPECT_EQ(refused(json).key, "B");
}

// The certificate is for the period it was made for.
TEST(ModelFile, AnotherPeriodDropsTheCertificate) {
  ReducedModel model = model_with({});
  model.discretize(2e-3, Discretization::kZeroOrderHold);
  EXPECT_FALSE(model.certificate.has_value());
}

}  // namespace
}  // namespace photocoag
