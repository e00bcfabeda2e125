#include "photocoag/run/pulse_model.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

#include "photocoag/core/error.hpp"

namespace photocoag {

SeenMode seen_by_pulses(double decay, int pulses) {
  const auto m = static_cast<double>(pulses);
  SeenMode seen{.before = 0.0, .power = 0.0};
  if (decay <= 0.0) return {.before = 1.0 / m, .power = 0.0};  // only the first pulse sees it
  const double exponent = -std::log(decay);                    // l T
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
  return seen;
}

PulseSampling pulse_sampling(const ReducedModel& model, int pulses) {
  const Eigen::EigenSolver<Eigen::MatrixXd> eigen{Eigen::MatrixXd(model.A_d)};
  if (model.discretization != Discretization::kZeroOrderHold || eigen.info() != Eigen::Success ||
      eigen.eigenvalues().imag().cwiseAbs().maxCoeff() > 1e-9) {
    throw Error(ErrorParts{.key = "model.discretization",
                           .problem = "samples by pulses need a model that is exact in time",
                           .accepted = "zero-order-hold, and modes that decay"});
  }
  const Eigen::MatrixXd right = eigen.eigenvectors().real();
  const Eigen::MatrixXd left = right.inverse();
  const Eigen::Index n = model.order();
  Eigen::VectorXd before(n);
  Eigen::VectorXd power(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const SeenMode seen = seen_by_pulses(eigen.eigenvalues()[i].real(), pulses);
    before[i] = seen.before;
    power[i] = seen.power;
  }
  PulseSampling sampling;
  sampling.of_state = Eigen::MatrixXd(model.A_d) - right * before.asDiagonal() * left;
  sampling.of_input = Eigen::MatrixXd::Identity(n, n) - right * power.asDiagonal() * left;
  return sampling;
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
