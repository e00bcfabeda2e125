// The certificate: that no power and no alpha violates it, and that it is not much larger than need
// be.
#include "photocoag/mor/certificate.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "photocoag/core/error.hpp"
#include "photocoag/core/random.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/mor/full_impulse.hpp"
#include "photocoag/mor/parameter_dependence.hpp"
#include "photocoag/mor/reduce.hpp"
#include "support/tissues.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr auto kHold = Discretization::kZeroOrderHold;

std::shared_ptr<const FullOrderModel> model_of(const Tissue& tissue, std::size_t cells = 3000) {
  return std::make_shared<const FullOrderModel>(tissue, GridSettings{.min_cells = cells});
}

ReducedModel projected(const FullOrderModel& full, const ReductionSettings& settings, double period,
                       Discretization how = kHold) {
  return project_model(full, reduction_space(full), settings, period, how);
}

// e_k of both outputs for one alpha and beta, by the time stepper that simulates the eye.
struct ImpulseError {
  std::vector<double> peak;
  std::vector<double> volume;
};

ImpulseError impulse_error(const ReducedModel& model,
                           const std::shared_ptr<const FullOrderModel>& full, AbsorptionFactors at,
                           int steps) {
  FullOrderPlant eye(full, model.discretization, model.period, at, 0.0);
  ReducedPlant plant(model, at);
  ImpulseError error;
  for (int k = 0; k < steps; ++k) {
    eye.step(k == 0 ? 1.0 : 0.0);
    plant.step(k == 0 ? 1.0 : 0.0);
    error.peak.push_back(eye.outputs().peak - plant.outputs().peak);
    error.volume.push_back(eye.outputs().volume - plant.outputs().volume);
  }
  return error;
}

double convolved(const std::vector<double>& response, const std::vector<double>& power) {
  double sum = 0.0;
  for (std::size_t k = 0; k < power.size(); ++k) {
    sum += response[k] * power[power.size() - 1 - k];
  }
  return sum;
}

// Powers from 0 to u_max of many kinds: constant, on/off, smooth, noise.
std::vector<double> random_power(std::uint64_t seed, int steps, double most) {
  const auto draw = [seed](std::uint64_t i) { return uniform(seed, i, RandomStream::kTest); };
  const auto kind = static_cast<int>(4.0 * draw(0));
  const double share = draw(1);
  const double frequency = std::pow(10.0, -3.0 * draw(2));
  std::vector<double> power;
  double held = 0.0;
  for (int k = 0; k < steps; ++k) {
    const double random = draw(static_cast<std::uint64_t>(k) + 10);
    if (kind == 0) held = random;
    if (kind == 1) held = random < share ? 1.0 : 0.0;
    if (kind == 2) held = 0.5 + 0.5 * std::sin(6.28 * frequency * k + 6.28 * share);
    if (kind == 3 && (k == 0 || random < frequency)) held = held > 0.5 ? 0.0 : 1.0;
    power.push_back(most * held);
  }
  return power;
}

Tissue with_beta(Tissue tissue) {
  tissue.layers[3].scaled_by = ScaledBy::kBeta;
  return tissue;
}

struct Case {
  const char* name;
  Tissue tissue;
  ReductionSettings settings;
  double period;
  Discretization how = kHold;
};

std::vector<Case> cases() {
  return {
      {"order 6, 1 ms", Tissue{}, {}, 1e-3},
      {"order 10, 4 ms", Tissue{}, {.order = 10}, 4e-3},
      {"normalised, Euler",
       testing::normalized(testing::literature_choroid()),
       {.parameter_dependence = ParameterDependence::kChebyshev},
       1e-3,
       Discretization::kImplicitEuler},
      {"two-sided", Tissue{}, {.method = ReductionMethod::kBalancedTwoSided}, 4e-3},
      {"taylor", Tissue{}, {.method = ReductionMethod::kTaylor, .order = 4}, 1e-3},
      {"deep peak",
       [] {
         Tissue tissue;
         tissue.peak_layer = "choroid";
         return tissue;
       }(),
       {.order = 5},
       2e-3},
      {"ring beam, perfused",
       [] {
         Tissue tissue = testing::ring_beam(Tissue{});
         tissue.layers[3].perfusion = 1e7;
         return tissue;
       }(),
       {},
       1e-3},
      {"layered", testing::layered(), {}, 1e-3},
      {"layered, Euler", testing::layered(), {.order = 8}, 4e-3, Discretization::kImplicitEuler},
      {"two parameters", with_beta(Tissue{}), {}, 1e-3},
      {"two parameters, normalised, Chebyshev",
       testing::normalized(with_beta(Tissue{})),
       {.parameter_dependence = ParameterDependence::kChebyshev},
       4e-3},
      {"two parameters, layered", with_beta(testing::layered()), {.order = 8}, 4e-3}};
}

// Linear interpolation, as the certificate's users do it.
double interpolated(const std::vector<double>& x, const std::vector<double>& y, double at) {
  std::size_t i = 1;
  while (i + 1 < x.size() && x[i] < at) ++i;
  return y[i - 1] + (y[i] - y[i - 1]) * (at - x[i - 1]) / (x[i] - x[i - 1]);
}

// Thousands of random power sequences and the two worst ones, on nodes of alpha and between them.
TEST(Certificate, NoPowerViolatesIt) {
  constexpr double kMost = 0.1;
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    const auto full = model_of(c.tissue);
    const ReducedModel model = projected(*full, c.settings, c.period, c.how);
    const ErrorCertificate certificate = certify(model, *full);
    const int steps = static_cast<int>(std::lround(certificate.treatment_duration / c.period));
    double nearest = 0.0;
    const bool two = c.tissue.two_parameters();
    const std::vector<double> alphas =
        two ? std::vector{0.3, 0.61, 1.0375, 1.7}
            : std::vector{0.3, 0.3125, 0.61, 0.7363, 1.0375, 1.1, 1.6871, 1.7};
    for (const AbsorptionFactors& at :
         tensor(alphas, two ? std::vector{0.5, 0.5625, 2.0} : std::vector{1.0})) {
      const double alpha = at.alpha;
      const ImpulseError error = impulse_error(model, full, at, steps);
      const Outputs for_ever = certificate.bound(alpha, kMost);
      const std::vector<double>& nodes = certificate.absorption_factors;
      const Outputs bound{
          .volume = kMost * interpolated(nodes, certificate.volume.treatment_bound, alpha),
          .peak = kMost * interpolated(nodes, certificate.peak.treatment_bound, alpha)};
      ASSERT_LE(bound.peak, for_ever.peak);
      ASSERT_LE(bound.volume, for_ever.volume);
      RunningErrorBound running(certificate);
      const auto check = [&](const std::vector<double>& power) {
        running.reset();
        for (const double u : power) running.step(u);
        const double peak = std::abs(convolved(error.peak, power));
        const double volume = std::abs(convolved(error.volume, power));
        ASSERT_LE(peak, bound.peak) << alpha;
        ASSERT_LE(volume, bound.volume) << alpha;
        const Outputs now = running.bound(alpha);
        ASSERT_LE(peak, now.peak) << alpha;
        ASSERT_LE(volume, now.volume) << alpha;
        nearest = std::max({nearest, peak / bound.peak, volume / bound.volume});
      };
      for (std::uint64_t seed = 1; seed <= (two ? 20U : 150U); ++seed)
        check(random_power(seed, steps, kMost));
      // The worst: full power wherever its effect at the end has the wanted sign.
      for (const auto* response : {&error.peak, &error.volume}) {
        for (const double sign : {1.0, -1.0}) {
          std::vector<double> power;
          for (auto e = response->rbegin(); e != response->rend(); ++e) {
            power.push_back(sign * *e > 0.0 ? kMost : 0.0);
          }
          check(power);
        }
      }
    }
    EXPECT_GT(nearest, two ? 0.93 : 0.97) << "attained, but for what lies between the nodes";
  }
}

TEST(Certificate, IsRefusedWhereItIsNotProved) {
  const auto uniform = model_of(Tissue{}, 1000);
  const ReducedModel other = reduce(uniform, {}, 4e-3, Discretization::kTrBdf2);
  EXPECT_FALSE(other.certificate.has_value());
  EXPECT_NE(why_uncertified(Discretization::kTrBdf2).find("zero-order hold"),
            std::string_view::npos);
  EXPECT_THROW(certify(other, *uniform), Error);
  EXPECT_TRUE(why_uncertified(kHold).empty());
}

// Two ways to the same numbers: with axial modes common to all radial modes, and one by one.
TEST(Certificate, OfBarelyLayeredTissueIsThatOfUniformTissue) {
  for (const Tissue& tissue : {Tissue{}, with_beta(Tissue{})}) {
    const auto uniform = model_of(tissue, 1500);
    const auto layered = model_of(testing::barely_layered(tissue), 1500);
    ASSERT_TRUE(uniform->separable());
    ASSERT_FALSE(layered->separable());
    const ReducedModel model = projected(*uniform, {.order = 4}, 4e-3);
    const ErrorCertificate one = certify(model, *uniform);
    const ErrorCertificate other = certify(model, *layered);
    EXPECT_EQ(one.horizon, other.horizon);
    const auto same = [](const std::vector<double>& a, const std::vector<double>& b) {
      ASSERT_EQ(a.size(), b.size());
      for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-6 * std::abs(b[i]));
    };
    same(one.peak.bound, other.peak.bound);
    same(one.peak.scale, other.peak.scale);
    same(one.peak.treatment_relative, other.peak.treatment_relative);
    same(one.volume.bound, other.volume.bound);
    same(one.volume.sum, other.volume.sum);
    EXPECT_NEAR(one.tail_relative, other.tail_relative, 1e-3 * one.tail_relative);
  }
}

// The whole running bound, step by step, along one random treatment.
TEST(Certificate, RunningBoundHoldsAtEveryInstant) {
  const auto full = model_of(Tissue{}, 20000);
  const ReducedModel model = projected(*full, {}, 1e-3);
  const ErrorCertificate certificate = certify(model, *full);
  for (const double alpha : {0.3, 0.7363, 1.5}) {
    FullOrderPlant eye(full, kHold, 1e-3, alpha);
    ReducedPlant plant(model, alpha);
    RunningErrorBound running(certificate);
    const std::vector<double> power = on_off_power(1.0, 1e-3, 20e-3, 3);
    for (const double u : power) {
      eye.step(0.1 * u);
      plant.step(0.1 * u);
      running.step(0.1 * u);
      const Outputs bound = running.bound(alpha);
      ASSERT_LE(std::abs(eye.outputs().peak - plant.outputs().peak), bound.peak);
      ASSERT_LE(std::abs(eye.outputs().volume - plant.outputs().volume), bound.volume);
    }
  }
}

// The sum over k, computed to where nothing is left, on nodes and between: never above the
// certificate and not far below.
TEST(Certificate, IsTightOnAndBetweenTheNodes) {
  const auto full = model_of(Tissue{}, 1000);
  const ReducedModel model = projected(*full, {}, 4e-3);
  const ErrorCertificate certificate = certify(model, *full);
  ASSERT_LT(certificate.tail_relative, 1e-4);
  for (const double alpha : {0.3, 0.325, 0.3333, 0.8, 0.8127, 1.699}) {
    const ImpulseError error = impulse_error(model, full, alpha, 2500);
    double plus = 0.0;
    double minus = 0.0;
    for (const double e : error.peak) (e > 0.0 ? plus : minus) += std::abs(e);
    const Outputs bound = certificate.bound(alpha, 1.0);
    EXPECT_LE(std::max(plus, minus), bound.peak) << alpha;
    EXPECT_GE(std::max(plus, minus), 0.98 * bound.peak) << alpha;
  }
}

// With the coarsest grid of alpha the certificate still holds: what lies between is really bounded.
TEST(Certificate, CoarseNodesOnlyLoosenIt) {
  const auto full = model_of(Tissue{}, 1000);
  const ReducedModel model = projected(*full, {}, 4e-3);
  const ErrorCertificate fine = certify(model, *full);
  for (const int nodes : {3, 6, 15}) {
    const ErrorCertificate coarse = certify(model, *full, {.nodes = nodes});
    for (int i = 0; i <= 50; ++i) {
      const double alpha = 0.3 + 1.4 * i / 50;
      // The fine one is tight to about 2 %.
      EXPECT_GE(coarse.bound(alpha, 1.0).peak, 0.98 * fine.bound(alpha, 1.0).peak);
      EXPECT_GE(coarse.bound(alpha, 1.0).volume, 0.98 * fine.bound(alpha, 1.0).volume);
    }
  }
  // A horizon cut short moves what is left into the tail, which is proved, not measured.
  const ErrorCertificate cut = certify(model, *full, {.max_horizon = 50});
  EXPECT_EQ(cut.horizon, 50U);
  EXPECT_GT(cut.tail_relative, fine.tail_relative);
  for (int i = 0; i <= 50; ++i) {
    const double alpha = 0.3 + 1.4 * i / 50;
    EXPECT_GE(cut.bound(alpha, 1.0).peak, 0.98 * fine.bound(alpha, 1.0).peak);
  }
}

// Value and second derivatives of both responses against differences, in both directions; fourth
// derivatives against their bounds.
TEST(ImpulseError, DerivativesAreThoseOfTheError) {
  for (const Tissue& tissue : {with_beta(Tissue{}), with_beta(testing::layered())}) {
    const auto full = model_of(tissue, 1000);
    const ReducedModel model = projected(*full, {}, 1e-3);
    constexpr int kAlphas = 29;
    constexpr int kBetas = 31;
    const FactorNodes nodes({{0.3, 0.5}, {1.7, 2.0}}, kAlphas, kBetas);
    const double step = 0.05;
    const ReducedExpansion reduced = expand_reduced(model, nodes);
    FullImpulse impulse(*full, kHold, 1e-3, nodes, 30);
    Eigen::VectorXcd power = Eigen::VectorXcd::Ones(reduced.decay.size());
    const auto check = [&](const NodeValues& x) {
      const auto grid = [](const VectorXd& v) { return v.reshaped(kAlphas, kBetas); };
      const auto value = grid(x.value);
      const auto along_alpha = grid(x.second_alpha);
      const auto along_beta = grid(x.second_beta);
      const double largest = x.value.cwiseAbs().maxCoeff();
      const double square = step * step;
      const auto difference = [square](const auto& m, Index a, Index b, Index da, Index db) {
        return (m(a + da, b + db) - 2.0 * m(a, b) + m(a - da, b - db)) / square;
      };
      const double rounding = 1e-10 * largest / square;
      for (Index a = 1; a + 1 < kAlphas; a += 3) {
        for (Index b = 1; b + 1 < kBetas; b += 3) {
          EXPECT_NEAR(along_alpha(a, b), difference(value, a, b, 1, 0),
                      square / 12.0 * x.fourth_alpha + rounding);
          EXPECT_NEAR(along_beta(a, b), difference(value, a, b, 0, 1),
                      square / 12.0 * x.fourth_beta + rounding);
          EXPECT_LE(std::abs(difference(along_alpha, a, b, 1, 0)), x.fourth_alpha + rounding);
          EXPECT_LE(std::abs(difference(along_alpha, a, b, 0, 1)), x.fourth_mixed + rounding);
          EXPECT_LE(std::abs(difference(along_beta, a, b, 0, 1)), x.fourth_beta + rounding);
        }
      }
    };
    const auto of_reduced = [&power](const OutputExpansion<std::complex<double>>& x) {
      const VectorXd magnitude = power.cwiseAbs();
      return NodeValues{(x.value * power).real(),       (x.second_alpha * power).real(),
                        (x.second_beta * power).real(), x.fourth.alpha.dot(magnitude),
                        x.fourth.mixed.dot(magnitude),  x.fourth.beta.dot(magnitude)};
    };
    for (int k = 1; k <= 30; ++k) {
      const OutputNodeValues& now = impulse.now();
      const NodeValues peak = of_reduced(reduced.outputs.peak);
      const NodeValues volume = of_reduced(reduced.outputs.volume);
      if (k % 7 == 1) {
        for (const NodeValues* x : {&now.peak, &now.volume, &peak, &volume}) check(*x);
        for (const Index i : {Index{0}, Index{443}, nodes.size() - 1}) {
          const ImpulseError exact = impulse_error(model, full, nodes.at(i), k);
          EXPECT_NEAR(now.peak.value[i] - peak.value[i], exact.peak.back(), 1e-8);
          EXPECT_NEAR(now.volume.value[i] - volume.value[i], exact.volume.back(), 1e-8);
        }
      }
      power = power.cwiseProduct(reduced.decay).eval();
      impulse.advance();
    }
  }
}

// The project's promise for the paper's tissue on the default grid, relative to the steady gain:
// the default method, tailored to 400 ms, within a treatment; balanced truncation for all time.
TEST(Certificate, KeepsThePromisedFigures) {
  const auto full = std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{});
  const ImpulseSpace space = reduction_space(*full);
  const auto certificate = [&](ReductionMethod method, int order, double period) {
    const ReducedModel model =
        project_model(*full, space, {.method = method, .order = order}, period, kHold);
    ErrorCertificate result = certify(model, *full);
    EXPECT_EQ(result.absorption_factors.front(), 0.3);
    EXPECT_EQ(result.absorption_factors.back(), 1.7);
    EXPECT_LT(result.tail_relative, 1e-4);
    return result;
  };
  for (const double period : {1e-3, 4e-3}) {
    const ErrorCertificate pod = certificate(ReductionMethod::kPodDeim, 6, period);
    EXPECT_NEAR(pod.treatment_duration, 0.4, 1e-12);
    EXPECT_LE(pod.peak.treatment_relative_max(), 0.025);
    EXPECT_LE(pod.volume.treatment_relative_max(), 0.025);
    EXPECT_GE(pod.peak.relative_max(), pod.peak.treatment_relative_max());
    const ErrorCertificate six = certificate(ReductionMethod::kBalancedTwoSided, 6, period);
    EXPECT_LE(six.peak.relative_max(), 0.025);
    EXPECT_LE(six.volume.relative_max(), 0.025);
    const ErrorCertificate ten = certificate(ReductionMethod::kBalancedTwoSided, 10, period);
    EXPECT_LE(ten.peak.relative_max(), 0.008);
    EXPECT_LE(ten.volume.relative_max(), 0.008);
    EXPECT_GT(ten.peak.relative_max(), 1e-4) << "too good to be a bound";
  }
}

}  // namespace
}  // namespace photocoag
