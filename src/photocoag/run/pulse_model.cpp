#include "photocoag/run/pulse_model.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

#include "photocoag/core/error.hpp"

namespace photocoag {

SeenMode seen_by_pulses(double decay, int pulses) {
  const auto m = static_cast<double>(pulses);
  SeenMode seen{.before = 0.0, .power = 0.0};
  if (decay <= 0.0) return seen;             // gone before any pulse could hear it
  const double exponent = -std::log(decay);  // l T
  const double per_pulse = std::exp(-exponent / m);
  // A pulse of u T / m, relative to (1 - decay) / l, what the whole period adds per watt.
  const double share = exponent / (m * -std::expm1(-exponent));
  double left = 1.0;    // of the state before the period
  double pulsed = 0.0;  // from the pulses before
  for (int p = 0; p < pulses; ++p) {
    seen.before += left / m;
    seen.power += pulsed / m;
    left *= per_pulse;
    pulsed = per_pulse * (pulsed + share);
  }
  // Pulses leave a mode with less at the end of a period than constant power, always by the same
  // factor: so it was at its start as well.
  seen.before *= pulsed;
  return seen;
}

ReducedModel seen_by_pulses(const ReducedModel& model, int pulses) {
  const Eigen::Index n = model.order();
  if (2 * n > kMaxOrder) {
    throw Error(ErrorParts{.key = "model.order",
                           .problem = "samples by pulses need two states for each",
                           .found = fmt::format("{}", n),
                           .accepted = fmt::format("at most {}", kMaxOrder / 2)});
  }
  const Eigen::EigenSolver<Eigen::MatrixXd> eigen{Eigen::MatrixXd(model.A_d)};
  if (model.discretization != Discretization::kZeroOrderHold || eigen.info() != Eigen::Success ||
      eigen.eigenvalues().imag().cwiseAbs().maxCoeff() > 1e-9) {
    throw Error(ErrorParts{.key = "model.discretization",
                           .problem = "samples by pulses need a model that is exact in time",
                           .accepted = "zero-order-hold, and modes that decay"});
  }
  const Eigen::MatrixXd right = eigen.eigenvectors().real();
  const Eigen::MatrixXd left = right.inverse();
  Eigen::VectorXd before(n);
  Eigen::VectorXd power(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const SeenMode seen = seen_by_pulses(eigen.eigenvalues()[i].real(), pulses);
    before[i] = seen.before;
    power[i] = seen.power;
  }
  ReducedModel twice = model;
  const Eigen::Index terms = model.B_d.cols();
  twice.A = StateMatrix::Zero(2 * n, 2 * n);
  twice.A.topLeftCorner(n, n) = model.A;
  twice.A.bottomRightCorner(n, n) = model.A;
  twice.B = InputTerms::Zero(2 * n, terms);
  twice.B.topRows(n) = model.B;
  twice.A_d = StateMatrix::Zero(2 * n, 2 * n);
  twice.A_d.topLeftCorner(n, n) = model.A_d;
  twice.A_d.bottomLeftCorner(n, n) = right * before.asDiagonal() * left;
  twice.B_d = InputTerms::Zero(2 * n, terms);
  twice.B_d.topRows(n) = model.B_d;
  twice.B_d.bottomRows(n) = right * power.asDiagonal() * left * Eigen::MatrixXd(model.B_d);
  twice.C_volume = OutputTerms::Zero(model.C_volume.rows(), 2 * n);
  twice.C_volume.rightCols(n) = model.C_volume;
  twice.C_peak = StateVector::Zero(2 * n);
  twice.C_peak.head(n) = model.C_peak;
  return twice;
}

void see_pulses(WitnessModel& witness, int pulses) {
  witness.averaged = true;
  for (std::size_t i = 0; i < kWitnessModes; ++i) {
    const SeenMode seen = seen_by_pulses(witness.decay[i], pulses);
    witness.seen_before[i] = seen.before;
    witness.seen_power[i] = seen.power;
  }
}

}  // namespace photocoag
