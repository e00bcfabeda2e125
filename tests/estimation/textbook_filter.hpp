// Role: tests; the extended Kalman filter as a textbook prints it: dense matrices in long double,
// written from the nonlinear map z+ = f(z, u), y = h(z) of the paper's extended dynamics. Shares no
// code with the filter under test but the model's B(alpha) and C_vol(alpha).
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "photocoag/estimation/settings.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag::testing {

using Real = long double;
using RealVector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
using RealMatrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;

enum class Jacobians { kAnalytic, kDifferences };

class TextbookFilter {
 public:
  TextbookFilter(const ReducedModel& model, const EstimatorSettings& settings,
                 Jacobians jacobians = Jacobians::kAnalytic)
      : model_(model), settings_(settings), jacobians_(jacobians), n_(model.order()) {
    z = RealVector::Zero(n_ + 1);
    z[n_] = settings.absorption_initial;
    P = RealMatrix::Zero(n_ + 1, n_ + 1);
    P(n_, n_) = Real(settings.absorption_sigma_initial) * settings.absorption_sigma_initial;
  }

  void predict(Real u) {
    const RealMatrix F = jacobian_f(u);
    RealVector b = RealVector::Zero(n_ + 1);
    b.head(n_) = at(z[n_]).input.cast<Real>();
    RealMatrix Q =
        Real(settings_.power_process_noise) * settings_.power_process_noise * b * b.transpose();
    Q(n_, n_) += Real(settings_.absorption_process_noise) * settings_.absorption_process_noise;
    z = f(z, u);
    P = (F * P * F.transpose() + Q).eval();
  }

  /// Without the bounds on alpha.
  void update_unbounded(Real y) {
    const RealMatrix H = jacobian_h();
    const Real R = Real(settings_.measurement_noise) * settings_.measurement_noise;
    const Real S = (H * P * H.transpose())(0, 0) + R;
    innovation_sigma = std::sqrt(S);
    const RealMatrix K = P * H.transpose() / S;
    const RealMatrix IKH = RealMatrix::Identity(n_ + 1, n_ + 1) - K * H;
    z += (K * (y - h(z))).col(0);
    P = (IKH * P * IKH.transpose() + K * R * K.transpose()).eval();
  }

  /// With them: the most likely z whose alpha is the bound, min (z - z0)' P^-1 (z - z0).
  void update(Real y) {
    update_unbounded(y);
    const Real bound =
        std::clamp(z[n_], Real(settings_.absorption_min), Real(settings_.absorption_max));
    if (bound != z[n_]) z += (P.col(n_) * ((bound - z[n_]) / P(n_, n_))).eval();
    z[n_] = bound;
  }

  Real peak() const { return model_.C_peak.cast<Real>().dot(z.head(n_)); }
  Real volume() const { return h(z); }

  RealVector z;
  RealMatrix P;
  Real innovation_sigma = 0;  // of the last update

 private:
  ParametricMatrices at(Real alpha) const {
    ParametricMatrices matrices;
    model_.evaluate(static_cast<double>(alpha), matrices);
    return matrices;
  }

  RealVector f(const RealVector& from, Real u) const {
    RealVector next = from;
    next.head(n_) = model_.A_d.cast<Real>() * from.head(n_) + at(from[n_]).input.cast<Real>() * u;
    return next;
  }

  Real h(const RealVector& from) const {
    return at(from[n_]).volume.cast<Real>().dot(from.head(n_));
  }

  RealMatrix jacobian_f(Real u) const {
    RealMatrix F = RealMatrix::Identity(n_ + 1, n_ + 1);
    if (jacobians_ == Jacobians::kAnalytic) {
      F.topLeftCorner(n_, n_) = model_.A_d.cast<Real>();
      F.col(n_).head(n_) = at(z[n_]).input_slope[0].cast<Real>() * u;
      return F;
    }
    for (int j = 0; j <= n_; ++j) {
      F.col(j) = difference([&](const RealVector& from) { return f(from, u); }, j);
    }
    return F;
  }

  RealMatrix jacobian_h() const {
    RealMatrix H(1, n_ + 1);
    if (jacobians_ == Jacobians::kAnalytic) {
      const ParametricMatrices matrices = at(z[n_]);
      H.row(0).head(n_) = matrices.volume.cast<Real>().transpose();
      H(0, n_) = matrices.volume_slope[0].cast<Real>().dot(z.head(n_));
      return H;
    }
    for (int j = 0; j <= n_; ++j) {
      H(0, j) = difference([&](const RealVector& from) { return RealVector{{h(from)}}; }, j)[0];
    }
    return H;
  }

  // Central difference of fourth order. alpha: step 1e-3, truncation about 1e-12, the model's
  // rounding 1e-16 / 1e-3. The map is linear in x: any step is exact there.
  template <typename Map>
  RealVector difference(const Map& map, int j) const {
    const Real step = 1e-3L;
    const auto value = [&](int k) {
      RealVector from = z;
      from[j] += k * step;
      return map(from);
    };
    return (8 * (value(1) - value(-1)) - (value(2) - value(-2))) / (12 * step);
  }

  const ReducedModel& model_;
  EstimatorSettings settings_;
  Jacobians jacobians_;
  int n_;
};

}  // namespace photocoag::testing
