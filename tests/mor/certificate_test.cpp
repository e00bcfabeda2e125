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
#include "photocoag/mor/impulse_error.hpp"
#include "photocoag/mor/majorant.hpp"
#include "photocoag/mor/pulse_response.hpp"
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

// e_k of both outputs for one alpha, by the time stepper that simulates the eye.
struct ImpulseError {
  std::vector<double> peak;
  std::vector<double> volume;
};

ImpulseError impulse_error(const ReducedModel& model,
                           const std::shared_ptr<const FullOrderModel>& full, double alpha,
                           int steps) {
  FullOrderPlant eye(full, model.discretization, model.period, alpha, 0.0);
  ReducedPlant plant(model, alpha);
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

struct Case {
  const char* name;
  Tissue tissue;
  ReductionSettings settings;
  double period;
  Discretization how = kHold;
};

std::vector<Case> cases() {
  return {{"order 6, 1 ms", Tissue{}, {}, 1e-3},
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
           1e-3}};
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
    for (const double alpha : {0.3, 0.3125, 0.61, 0.7363, 1.0375, 1.1, 1.6871, 1.7}) {
      const ImpulseError error = impulse_error(model, full, alpha, steps);
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
      for (std::uint64_t seed = 1; seed <= 150; ++seed) check(random_power(seed, steps, kMost));
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
    EXPECT_GT(nearest, 0.97) << "attained, but for what lies between the nodes of alpha";
  }
}

// The whole running bound, step by step, along one random treatment.
TEST(Certificate, IsRefusedWhereItIsNotProved) {
  const auto layered = model_of(testing::layered(), 1000);
  const ReducedModel model = reduce(layered, {}, 4e-3, kHold);
  EXPECT_FALSE(model.certificate.has_value());
  EXPECT_NE(why_uncertified(*layered, kHold).find("conductivity"), std::string_view::npos);
  EXPECT_THROW(certify(model, *layered), Error);
  const auto uniform = model_of(Tissue{}, 1000);
  const ReducedModel other = reduce(uniform, {}, 4e-3, Discretization::kTrBdf2);
  EXPECT_FALSE(other.certificate.has_value());
  EXPECT_THROW(certify(other, *uniform), Error);
  EXPECT_TRUE(why_uncertified(*uniform, kHold).empty());
}

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

// Value and second derivative of e_k against differences; fourth derivative against its bound.
TEST(ImpulseErrorExpansion, DerivativesAreThoseOfTheError) {
  const auto full = model_of(Tissue{}, 1000);
  const ReducedModel model = projected(*full, {}, 1e-3);
  const double step = 0.01;
  const VectorXd nodes = VectorXd::LinSpaced(141, 0.3, 1.7);
  const ErrorExpansion expansion = expand_error(model, *full, nodes);
  PulseResponse pulse(*full, kHold, 1e-3);
  Eigen::VectorXcd power = Eigen::VectorXcd::Ones(expansion.decay.size());
  for (int k = 1; k <= 30; ++k) {
    const AxialProfiles& now = pulse.profiles();
    for (const bool peak : {true, false}) {
      const OutputExpansion& x = peak ? expansion.peak : expansion.volume;
      const VectorXd& profile = peak ? now.axis : now.spot;
      const VectorXd& magnitude = peak ? now.axis_magnitude : now.spot;
      const VectorXd value = x.weight * profile - (x.coefficient * power).real();
      const VectorXd second = x.weight_second * profile - (x.coefficient_second * power).real();
      const double fourth =
          x.weight_fourth.dot(magnitude) + x.coefficient_fourth.dot(power.cwiseAbs());
      for (const Index i : {0, 43, 80, 140}) {
        const ImpulseError exact = impulse_error(model, full, nodes[i], k);
        EXPECT_NEAR(value[i], (peak ? exact.peak : exact.volume).back(), 1e-9);
      }
      for (Index i = 1; i + 1 < nodes.size(); ++i) {
        const double difference = (value[i + 1] - 2.0 * value[i] + value[i - 1]) / (step * step);
        EXPECT_NEAR(second[i], difference, step * step / 12.0 * fourth + 1e-7);
        const double next = (second[i + 1] - 2.0 * second[i] + second[i - 1]) / (step * step);
        EXPECT_LE(std::abs(next), fourth + 1e-6);
      }
    }
    power = power.cwiseProduct(expansion.decay).eval();
    pulse.advance();
  }
}

// Dropping modes for good changes nothing: against the stepper that keeps every mode.
TEST(PulseResponse, IsTheSteppersWithoutPower) {
  for (const auto how : {kHold, Discretization::kImplicitEuler}) {
    const auto full = model_of(Tissue{}, 2000);
    PulseResponse pulse(*full, how, 1e-3);
    ModalStepper stepper(full, how, 1e-3, 0.0);
    stepper.step(1.0);
    VectorXd axis_sum = VectorXd::Zero(full->axial().size());
    for (int k = 1; k <= 400; ++k) {
      const double size = stepper.axis_profile().cwiseAbs().maxCoeff();
      EXPECT_LT((pulse.profiles().axis - stepper.axis_profile()).cwiseAbs().maxCoeff(),
                1e-13 * size);
      EXPECT_LT((pulse.profiles().spot - stepper.spot_profile()).cwiseAbs().maxCoeff(),
                1e-13 * stepper.spot_profile().maxCoeff());
      EXPECT_EQ(pulse.profiles().spot.tail(full->axial().size() - pulse.active()).sum(), 0.0);
      axis_sum += pulse.profiles().axis;
      pulse.advance();
      stepper.step(0.0);
    }
    const VectorXd all = pulse.sum_after(0.0).axis;
    EXPECT_LT((axis_sum + pulse.sum_after(400.0).axis - all).norm(), 1e-10 * all.norm());
  }
}

TEST(Majorant, LiesAboveAndNotFarAbove) {
  const std::vector<double> decay = {0.999, 0.99, 0.9, 0.5, 0.0};
  std::vector<double> value;
  double sum = 0.0;
  for (int k = 1; k <= 3000; ++k) {
    value.push_back(std::pow(0.97, k) * (1.0 + 0.5 * std::sin(0.3 * k)) +
                    0.01 * std::pow(0.998, k));
    sum += value.back();
  }
  const double last = 1e-5;
  const std::vector<double> c = exponential_majorant(value, decay, last);
  ASSERT_EQ(c.size(), decay.size());
  double total = 0.0;
  for (int k = 1; k <= 3000; ++k) {
    EXPECT_GE(majorant_value(c, decay, k), value[static_cast<std::size_t>(k - 1)]);
    total += majorant_value(c, decay, k);
  }
  for (const double coefficient : c) EXPECT_GE(coefficient, 0.0);
  EXPECT_GE(c[0] * std::pow(0.999, 3000), last);
  EXPECT_LT(total, 4.0 * sum);
  // An exponential of the set is its own best majorant, up to the run of neighbours at its end.
  std::vector<double> own;
  for (int k = 1; k <= 60; ++k) own.push_back(3.0 * std::pow(0.9, k - 1));
  const std::vector<double> found = exponential_majorant(own, decay, 0.0);
  EXPECT_LT(majorant_value(found, decay, 1.0), 4.5);
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
