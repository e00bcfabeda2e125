// What verify() must catch: one planted fault at a time in a model that is otherwise good.
#include <gtest/gtest.h>

#include <Eigen/LU>

#include <cmath>
#include <functional>
#include <limits>

#include "photocoag/rom/reduced_model.hpp"
#include "support/reduced_models.hpp"
#include "support/thrown.hpp"

namespace photocoag {
namespace {

using testing::coarse_model;
using testing::thrown_by;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

void refresh(ReducedModel& model) { model.discretize(model.period, model.discretization); }

struct Fault {
  const char* what;
  const char* key;
  std::function<void(ReducedModel&)> plant;
};

const std::vector<Fault>& faults() {
  static const std::vector<Fault> all = {
      {"no states", "A", [](ReducedModel& m) { m.A.resize(0, 0); }},
      {"A not square", "A", [](ReducedModel& m) { m.A.resize(6, 5); }},
      {"no terms", "theta", [](ReducedModel& m) { m.theta.terms = 0; }},
      {"fewer terms than columns", "B", [](ReducedModel& m) { m.theta.terms -= 1; }},
      {"B too narrow", "B", [](ReducedModel& m) { m.B = m.B.leftCols(2).eval(); }},
      {"B_d too short", "discrete.B", [](ReducedModel& m) { m.B_d = m.B_d.topRows(5).eval(); }},
      {"A_d too small", "discrete.A",
       [](ReducedModel& m) { m.A_d = m.A_d.topLeftCorner(5, 5).eval(); }},
      {"C_volume short", "C_volume",
       [](ReducedModel& m) { m.C_volume = m.C_volume.leftCols(5).eval(); }},
      {"C_peak short", "C_peak", [](ReducedModel& m) { m.C_peak = m.C_peak.head(5).eval(); }},
      {"nan in A", "matrices", [](ReducedModel& m) { m.A(0, 0) = kNan; }},
      {"nan in B", "matrices", [](ReducedModel& m) { m.B(5, 1) = kNan; }},
      {"nan in C_volume", "matrices", [](ReducedModel& m) { m.C_volume(2, 3) = kNan; }},
      {"inf in C_peak", "matrices", [](ReducedModel& m) { m.C_peak[5] = -std::log(0.0); }},
      {"nan in A_d", "matrices", [](ReducedModel& m) { m.A_d(1, 2) = kNan; }},
      {"nan in B_d", "matrices", [](ReducedModel& m) { m.B_d(0, 0) = kNan; }},
      {"period zero", "discrete.period_s", [](ReducedModel& m) { m.period = 0.0; }},
      {"period nan", "discrete.period_s", [](ReducedModel& m) { m.period = kNan; }},
      {"growing mode", "A",
       [](ReducedModel& m) {
         m.A(0, 0) = 1.0;
         refresh(m);
       }},
      // (1 - 5)^-1 = -1/4: the discrete matrix looks stable.
      {"growing mode hidden by implicit Euler", "A",
       [](ReducedModel& m) {
         m.discretization = Discretization::kImplicitEuler;
         m.A(0, 0) = 5.0 / m.period;
         refresh(m);
       }},
      {"A_d of spectral radius 1", "discrete.A", [](ReducedModel& m) { m.A_d(0, 0) = 1.0; }},
      {"A_d of another period", "discrete",
       [](ReducedModel& m) {
         m.discretize(2e-3, m.discretization);
         m.period = 1e-3;
       }},
      {"A_d of the other discretization", "discrete",
       [](ReducedModel& m) { m.discretization = Discretization::kImplicitEuler; }},
      {"A_d off by a millionth", "discrete", [](ReducedModel& m) { m.A_d(0, 0) *= 1.0 - 1e-6; }},
      {"B_d off by a millionth", "discrete", [](ReducedModel& m) { m.B_d *= 1.0 + 1e-6; }},
      {"B_d of another sign", "discrete", [](ReducedModel& m) { m.B_d *= -1.0; }},
      {"no peak", "C_peak", [](ReducedModel& m) { m.C_peak.setZero(); }},
      {"peak of another sign", "C_peak", [](ReducedModel& m) { m.C_peak *= -1.0; }},
      {"light cools", "C_peak",
       [](ReducedModel& m) {
         m.B *= -1.0;
         refresh(m);
       }},
      {"peak does not depend on alpha", "C_peak",
       [](ReducedModel& m) {
         for (int j = 0; j < m.theta.terms; ++j) {
           m.theta.points[j].front[0] = 0.0;
           m.theta.points[j].back[0] = 0.0;
         }
       }},
      {"response falls below zero", "C_peak",
       [](ReducedModel& m) {
         // The fastest mode turned round, which takes little from the steady gain: the first step
         // cools.
         Eigen::Index fastest = 0;
         m.A.diagonal().minCoeff(&fastest);
         m.C_peak[fastest] *= -4.0;
       }},
  };
  return all;
}

TEST(Verify, AcceptsWhatReduceMakes) {
  for (const double period : {0.1e-3, 1e-3, 4e-3}) {
    for (const auto how : {Discretization::kZeroOrderHold, Discretization::kImplicitEuler}) {
      EXPECT_NO_THROW(verify(coarse_model({}, period, how)));
    }
  }
}

TEST(Verify, CatchesEveryPlantedFault) {
  const ReducedModel good = coarse_model();
  for (const Fault& fault : faults()) {
    SCOPED_TRACE(fault.what);
    ReducedModel bad = good;
    fault.plant(bad);
    const ErrorParts parts = thrown_by([&] { verify(bad); });
    EXPECT_EQ(parts.key, fault.key);
    EXPECT_FALSE(parts.found.empty());
    EXPECT_FALSE(parts.accepted.empty());
  }
}

// The two demands on C_peak are told apart.
TEST(Verify, NamesTheDemandThatFailed) {
  ReducedModel bad = coarse_model();
  for (const Fault& fault : faults()) {
    if (fault.what == std::string("response falls below zero")) fault.plant(bad);
  }
  EXPECT_NE(thrown_by([&] { verify(bad); }).found.find("impulse response"), std::string::npos);
}

// The state's scale and coordinates are arbitrary: a verified model stays so in any others.
TEST(Verify, DoesNotDependOnTheStatesCoordinates) {
  const ReducedModel good = coarse_model();
  const int n = good.order();
  Eigen::MatrixXd transform = Eigen::MatrixXd::Identity(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) transform(i, j) += 0.3 * std::sin(3.0 * i + 7.0 * j);
  }
  transform *= 1e4;
  const Eigen::MatrixXd inverse = transform.inverse();
  ReducedModel other = good;
  other.A = transform * good.A * inverse;
  other.B = transform * good.B;
  other.C_volume = good.C_volume * inverse;
  other.C_peak = inverse.transpose() * good.C_peak;
  refresh(other);
  EXPECT_NO_THROW(verify(other));
}

}  // namespace
}  // namespace photocoag
