// Models whose numbers are not those of the tissue, with a checksum that fits, are refused.
#include <gtest/gtest.h>

#include <sys/stat.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <filesystem>
#include <functional>

#include "photocoag/core/files.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/tissue_reference.hpp"
#include "support/reduced_models.hpp"
#include "support/temporary_folder.hpp"
#include "support/thrown.hpp"
#include "support/tissues.hpp"

namespace photocoag::testing {
namespace {

void scale(Json& matrix, double factor) {
  if (!matrix.is_array()) {
    matrix = matrix.get<double>() * factor;
    return;
  }
  for (Json& entry : matrix) scale(entry, factor);
}

std::string key_of(const ReducedModel& model, const Tissue& tissue = {},
                   const EstimatorSettings& estimator = {}) {
  return thrown_by([&] { check_model(model, tissue, estimator, "model.json"); }).key;
}

/// What is read after a change of the file; the discrete matrices made anew, as a reduction of
/// one's own would.
ReducedModel altered(const ReducedModel& good, const std::function<void(Json&)>& change) {
  Json json = Json::parse(to_json(good));
  change(json);
  ReducedModel model = good;
  const auto read = [](const Json& matrix, auto& out) {
    for (Eigen::Index i = 0; i < out.rows(); ++i) {
      for (Eigen::Index j = 0; j < out.cols(); ++j) {
        out(i, j) = matrix[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)].get<double>();
      }
    }
  };
  read(json["continuous"]["A"], model.A);
  read(json["continuous"]["B"], model.B);
  read(json["continuous"]["C_volume"], model.C_volume);
  for (Eigen::Index i = 0; i < model.C_peak.size(); ++i) {
    model.C_peak[i] = json["continuous"]["C_peak"][0][static_cast<std::size_t>(i)].get<double>();
  }
  model.discretize(good.period, good.discretization);
  return model;
}

TEST(ModelCheck, NumbersThatAreNotTheTissuesAreRefused) {
  const ReducedModel good = coarse_model();
  EXPECT_NO_THROW(check_model(good, Tissue{}, {}, ""));
  const std::string peak = "continuous.C_peak";
  const std::string volume = "continuous.C_volume";
  const auto refused = [&](const std::function<void(Json&)>& change) {
    const ReducedModel model = altered(good, change);
    EXPECT_NO_THROW(verify(model)) << "nothing else finds it";
    return key_of(model);
  };
  EXPECT_EQ(refused([](Json& j) { scale(j["continuous"]["C_peak"], 0.5); }), peak);
  EXPECT_EQ(refused([](Json& j) { scale(j["continuous"]["C_peak"], 1.04); }), peak);
  EXPECT_EQ(refused([](Json& j) { scale(j["continuous"]["C_peak"], 1e-3); }), peak);
  EXPECT_EQ(refused([](Json& j) { scale(j["continuous"]["C_peak"], 1e3); }), peak);
  EXPECT_EQ(refused([](Json& j) { scale(j["continuous"]["C_volume"], 1.2); }), volume);
  EXPECT_EQ(refused([](Json& j) { scale(j["continuous"]["C_volume"], 1e3); }), volume);
  EXPECT_EQ(refused([](Json& j) { scale(j["continuous"]["B"], 1.1); }), peak);
  EXPECT_EQ(refused([](Json& j) { scale(j["continuous"]["B"], 1e-3); }), peak);
  EXPECT_EQ(refused([](Json& j) { scale(j["continuous"]["A"], 1.1); }), peak);
  EXPECT_EQ(refused([](Json& j) { scale(j["continuous"]["A"], 0.9); }), peak);
  // The dependence on alpha stretched: right at alpha = 1 only.
  ReducedModel stretched = good;
  for (AbsorbedFraction& point : stretched.theta.points) {
    point.fixed_front += 0.3 * point.front[0];
    point.front[0] *= 0.7;
    point.fixed_back += 0.3 * point.back[0];
    point.back[0] *= 0.7;
  }
  EXPECT_NO_THROW(verify(stretched));
  EXPECT_EQ(key_of(stretched), peak);
  // A model that says it is bad is not believed for that.
  ReducedModel modest = altered(good, [](Json& j) { scale(j["continuous"]["C_peak"], 0.5); });
  for (double& error : modest.error.peak) error = 0.9;
  EXPECT_EQ(key_of(modest), peak);
  // That of another spot; the file may say what it likes.
  Tissue wide;
  wide.spot_radius = 150e-6;
  ReducedModel other = coarse_model(wide);
  other.tissue = Tissue{};
  EXPECT_EQ(key_of(other), peak);
}

TEST(ModelCheck, EveryTimeSchemeRateAndTissueIsAcceptedInItsOwn) {
  for (const Discretization how : kDiscretizations) {
    EXPECT_NO_THROW(check_model(coarse_model({}, 4e-3, how), Tissue{}, {}, "")) << to_string(how);
  }
  // Implicit Euler is 12 % low after the first step: it must not pass for the exact one.
  ReducedModel euler = coarse_model({}, 4e-3, Discretization::kImplicitEuler);
  euler.discretization = Discretization::kZeroOrderHold;
  EXPECT_EQ(key_of(euler), "continuous.C_peak");
  EXPECT_NO_THROW(check_model(coarse_model(layered()), layered(), {}, ""));
  EstimatorSettings both;
  both.unknowns = Unknowns::kRpeAndChoroid;
  EXPECT_NO_THROW(check_model(coarse_model(with_beta()), with_beta(), both, ""));
  ReducedModel blind = coarse_model(with_beta());
  for (AbsorbedFraction& point : blind.theta.points) {
    point.fixed_front += point.front[1];
    point.fixed_back += point.back[1];
    point.front[1] = point.back[1] = 0.0;
  }
  EXPECT_FALSE(key_of(blind, with_beta(), both).empty()) << "beta plays no part in it";
}

TEST(ModelCheck, ACertificateThatClaimsTooLittleIsRefused) {
  const ReducedModel good = coarse_model();
  ASSERT_TRUE(good.certificate.has_value());
  ReducedModel model = good;
  for (double& bound : model.certificate->peak.bound) bound *= 0.01;
  EXPECT_EQ(key_of(model), "certificate.peak.bound_K_per_W");
  model = good;
  for (double& scale : model.certificate->peak.scale) scale *= 0.01;
  EXPECT_EQ(key_of(model), "certificate.peak.scale_K_per_W");
  model = good;
  for (double& bound : model.certificate->volume.bound) bound *= 0.01;
  EXPECT_EQ(key_of(model), "certificate.volume.bound_K_per_W");
  // What needs no comparison.
  model = good;
  for (double& bound : model.certificate->peak.bound) bound = 0.0;
  EXPECT_EQ(thrown_by([&] { verify(model); }).key, "certificate.peak");
  model = good;
  ErrorCertificate& two = *model.certificate;
  const auto ends = [](std::vector<double>& values) { values = {values.front(), values.back()}; };
  ends(two.absorption_factors);
  for (OutputCertificate* output : {&two.peak, &two.volume}) {
    for (auto* values : {&output->bound, &output->relative, &output->treatment_bound,
                         &output->treatment_relative, &output->sum, &output->scale}) {
      ends(*values);
    }
  }
  EXPECT_EQ(thrown_by([&] { verify(model); }).key, "certificate.absorption_factors");
}

// A certificate whose bounds are right at both ends of every stretch that a few alphas would see,
// or for a constant power only.
TEST(ModelCheck, ACertificateIsHeldAgainstEveryKindOfPower) {
  const ReducedModel good =
      reduce(std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{.min_cells = 40'000}),
             {}, 1e-3, Discretization::kZeroOrderHold);
  EXPECT_NO_THROW(check_model(good, Tissue{}, {}, ""));
  ReducedModel model = good;
  for (double& bound : model.certificate->volume.treatment_bound) bound *= 0.01;
  EXPECT_EQ(key_of(model), "certificate.volume.treatment_bound_K_per_W");
  model = good;
  OutputCertificate& peak = model.certificate->peak;
  for (std::size_t i = 12; i < 17; ++i) peak.bound[i] = peak.treatment_bound[i] = 1e-9;
  EXPECT_EQ(key_of(model), "certificate.peak.bound_K_per_W") << "0.6 to 0.7";
  // Above the error of a constant power, below that of on/off powers.
  model = good;
  for (double& scale : model.certificate->peak.scale) scale *= 0.2;
  EXPECT_EQ(key_of(model), "certificate.peak.scale_K_per_W");
}

// The coefficients, in Chebyshev polynomials of x = (alpha - 1.1) / 0.9, of a polynomial that is
// zero at seven alphas from 0.3 to 1.7 spread evenly in logarithm, and at most 1 between them.
std::vector<double> hidden_polynomial() {
  const auto value = [](double x) {
    double product = 1.0;
    for (int i = 0; i < 7; ++i) product *= x - (0.3 * std::pow(1.7 / 0.3, i / 6.0) - 1.1) / 0.9;
    return product / 0.0659;
  };
  constexpr int kTerms = 8;
  std::vector<double> coefficients(kTerms, 0.0);
  for (int j = 0; j < kTerms; ++j) {
    for (int i = 0; i < kTerms; ++i) {
      const double angle = M_PI * (i + 0.5) / kTerms;
      coefficients[static_cast<std::size_t>(j)] +=
          (j == 0 ? 1.0 : 2.0) / kTerms * std::cos(j * angle) * value(std::cos(angle));
    }
  }
  return coefficients;
}

TEST(ModelCheck, NoErrorHidesBetweenTheAbsorptionsThatAreCompared) {
  const ReducedModel good =
      reduce(coarse_full_model(), {.parameter_dependence = ParameterDependence::kChebyshev}, 1e-3,
             Discretization::kZeroOrderHold);
  EXPECT_NO_THROW(check_model(good, Tissue{}, {}, ""));
  ASSERT_EQ(good.theta.terms, 8);
  ParametricMatrices at_one;
  good.evaluate({1.0, 1.0}, at_one);
  const std::vector<double> hidden = hidden_polynomial();
  ReducedModel model = good;
  model.certificate.reset();
  for (int j = 0; j < good.theta.terms; ++j) {
    for (Eigen::Index i = 0; i < good.order(); ++i) {
      model.C_volume(j, i) += 0.3 * hidden[static_cast<std::size_t>(j)] * at_one.volume[i];
    }
  }
  EXPECT_NO_THROW(verify(model));
  EXPECT_EQ(key_of(model), "continuous.C_volume");
}

// Right for 100 ms, wrong later; the file says that it was measured for 100 ms.
TEST(ModelCheck, AFileDoesNotShortenTheRunThatIsCompared) {
  ReducedModel model = coarse_model();
  model.certificate.reset();
  const Eigen::EigenSolver<Eigen::MatrixXd> modes{Eigen::MatrixXd(model.A)};
  Eigen::Index slowest = 0;
  modes.eigenvalues().real().maxCoeff(&slowest);
  Eigen::MatrixXcd share = Eigen::MatrixXcd::Zero(model.order(), model.order());
  share(slowest, slowest) = 0.5 * modes.eigenvalues()[slowest];
  model.A += (modes.eigenvectors() * share * modes.eigenvectors().inverse()).real();
  model.discretize(model.period, model.discretization);
  EXPECT_NO_THROW(verify(model));
  model.error.duration = 0.1;
  EXPECT_EQ(key_of(model), "continuous.C_volume");
}

// The one model in the cache; the full-order model's modes are there, too.
std::string cached_model() {
  for (const auto& entry : std::filesystem::directory_iterator(cache_folder())) {
    if (entry.path().extension() == ".json") return entry.path().string();
  }
  return {};
}

// Nothing but the cache's own files: a pipe is not waited for, a link's target stays as it is.
TEST(ModelCheck, APipeOrALinkInTheCacheIsReplaced) {
  const TemporaryFolder folder;
  setenv("XDG_CACHE_HOME", folder.path().c_str(), 1);
  const Config config = load_config("", {"grid.min_cells=2000", "control.period_ms=4"});
  const std::string right = to_json(ModelStore(config, true).reduced());
  const std::string file = cached_model();
  const std::string precious = (folder.path() / "precious").string();
  write_file(precious, "mine");
  for (const bool pipe : {true, false}) {
    std::filesystem::remove(file);
    if (pipe) {
      ASSERT_EQ(mkfifo(file.c_str(), 0600), 0);
    } else {
      std::filesystem::create_symlink(precious, file);
    }
    EXPECT_EQ(to_json(ModelStore(config, true).reduced()), right);
    EXPECT_EQ(read_file(file, 1 << 20), right);
  }
  EXPECT_EQ(read_file(precious, 100), "mine");
}

// The cache is a folder that anybody may write to who may run the program.
TEST(ModelCheck, AForeignModelInTheCacheIsReplaced) {
  const TemporaryFolder folder;
  setenv("XDG_CACHE_HOME", folder.path().c_str(), 1);
  const Config config = load_config("", {"grid.min_cells=2000", "control.period_ms=4"});
  const std::string right = to_json(ModelStore(config, true).reduced());
  const std::string file = cached_model();
  ASSERT_FALSE(file.empty());
  Tissue wide;
  wide.spot_radius = 150e-6;
  save_reduced_model(coarse_model(wide, 4e-3), file);
  EXPECT_EQ(to_json(ModelStore(config, true).reduced()), right);
  // And one of the same tissue that is wrong.
  Json json = Json::parse(right);
  scale(json["continuous"]["C_peak"], 0.5);
  write_file(file, sealed(json));
  EXPECT_EQ(to_json(ModelStore(config, true).reduced()), right);
  EXPECT_EQ(read_file(file, 1 << 20), right) << "and the file is mended";
}

}  // namespace
}  // namespace photocoag::testing
