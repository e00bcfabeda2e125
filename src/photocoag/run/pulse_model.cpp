#include "photocoag/run/pulse_model.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>
#include <vector>

#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/rom/discretize.hpp"
#include "photocoag/rom/uncertain_model.hpp"

namespace photocoag {

PulseAveragedMode pulse_averaged_mode(double decay, int pulses) {
  const auto m = static_cast<double>(pulses);
  PulseAveragedMode seen{.before = 0.0, .power = 0.0};
  if (decay <= 0.0) return seen;             // gone before any pulse
  const double exponent = -std::log(decay);  // l T
  const double per_pulse = std::exp(-exponent / m);
  // A pulse of u T / m, relative to (1 - decay) / l, the whole period's contribution per watt.
  const double share = exponent / (m * -std::expm1(-exponent));
  double left = 1.0;    // of the state before the period
  double pulsed = 0.0;  // from the pulses before
  for (int p = 0; p < pulses; ++p) {
    seen.before += left / m;
    seen.power += pulsed / m;
    left *= per_pulse;
    pulsed = per_pulse * (pulsed + share);
  }
  // Under pulses a mode at the end of a period is smaller than under constant power by a fixed
  // factor, and so it was at its start.
  seen.before *= pulsed;
  return seen;
}

namespace {

// Steady-state shortfall per watt of a mode of this rate, 1/s, when sampled by pulses.
double shortfall(double rate, double pulse_period) {
  const double exponent = rate * pulse_period;
  return (1.0 - exponent / std::expm1(exponent)) / rate;
}

/// A real diagonalisation of A_d, or an Error.
struct DecayingModes {
  explicit DecayingModes(const ReducedModel& model) {
    const GeneralEigen eigen = general_eigen(model.A_d);
    if (model.discretization != Discretization::kZeroOrderHold || !eigen.converged ||
        eigen.values.imag().cwiseAbs().maxCoeff() > 1e-9) {
      throw Error(ErrorParts{.key = "model.discretization",
                             .problem = "samples by pulses need a model that is exact in time",
                             .accepted = "zero-order-hold, and modes that decay"});
    }
    right = eigen.vectors.real();
    left = inverse(right);
    decay = eigen.values.real();
  }
  Eigen::MatrixXd right;
  Eigen::MatrixXd left;
  Eigen::VectorXd decay;
};

/// Evenly over the model's range of alpha and beta.
std::vector<AbsorptionFactors> samples_of(const ReducedModel& model) {
  constexpr int kAlphas = 41;
  const int betas = model.parameters.size() == 2 ? 9 : 1;
  std::vector<AbsorptionFactors> samples;
  for (int b = 0; b < betas; ++b) {
    for (int a = 0; a < kAlphas; ++a) {
      samples.emplace_back(model.parameters[0].at(a, kAlphas),
                           betas == 1 ? 1.0 : model.parameters[1].at(b, betas));
    }
  }
  return samples;
}

// Terms of an input X so that C_vol(alpha, beta) X(alpha, beta) is `feed`, by least squares.
Eigen::MatrixXd terms_of(const PromptFeedthrough& feed, const ReducedModel& model) {
  const Eigen::Index n = model.order();
  const Eigen::Index terms = model.terms();
  const std::vector<AbsorptionFactors> samples = samples_of(model);
  const auto count = static_cast<Eigen::Index>(samples.size());
  Eigen::MatrixXd rows(count, n * terms);
  Eigen::VectorXd wanted(count);
  for (Eigen::Index s = 0; s < count; ++s) {
    const AbsorptionFactors at = samples[static_cast<std::size_t>(s)];
    ParametricMatrices matrices;
    model.evaluate(at, matrices);
    TermVector value;
    TermSlopes slope;
    if (model.parameters.size() == 2) {
      model.theta.evaluate(at, value, slope);
    } else {
      model.theta.evaluate(at.alpha, value, slope[0]);
    }
    for (Eigen::Index j = 0; j < terms; ++j) {
      rows.row(s).segment(j * n, n) = value[j] * Eigen::VectorXd(matrices.volume).transpose();
    }
    wanted[s] = feed(at);
  }
  // Minimum-norm X: avoids cancellation of large terms.
  const Eigen::VectorXd x = shortest_least_squares(rows, wanted, 1e-8);
  return Eigen::Map<const Eigen::MatrixXd>(x.data(), n, terms);
}

}  // namespace

PromptFeedthrough prompt_feedthrough(std::shared_ptr<const FullOrderModel> full,
                                     const ReducedModel& model, int pulses) {
  if (pulses < 2 || !full->separable()) return {};
  const double pulse_period = model.period / pulses;
  const Eigen::VectorXd spot = full->beam().cwiseAbs2();
  const Eigen::VectorXd& radial = full->radial().rates;
  const Eigen::VectorXd& axial = full->axial().rates;
  Eigen::VectorXd profile = Eigen::VectorXd::Zero(axial.size());
  for (Eigen::Index i = 0; i < radial.size(); ++i) {
    for (Eigen::Index j = 0; j < axial.size(); ++j) {
      profile[j] += spot[i] * shortfall(radial[i] + axial[j], pulse_period);
    }
  }
  const DecayingModes modes(model);
  Eigen::VectorXd lacking(model.order());
  for (Eigen::Index i = 0; i < lacking.size(); ++i) {
    // B_d of the mode is (1 - decay) / l times b. One that is gone within a period has no rate.
    const double decay = modes.decay[i];
    const double rate = -std::log(decay) / model.period;
    const double relative = decay > 0.0 ? shortfall(rate, pulse_period) * rate : 1.0;
    lacking[i] = relative / (1.0 - decay);
  }
  const Eigen::MatrixXd map = modes.right * lacking.asDiagonal() * modes.left;
  return [full = std::move(full), model, map, profile,
          share = (pulses - 1.0) / pulses](AbsorptionFactors at) {
    ParametricMatrices matrices;
    model.evaluate(at, matrices);
    const double reduced =
        Eigen::VectorXd(matrices.volume).dot(map * Eigen::VectorXd(matrices.input));
    return share * (reduced - full->output_weights(at).volume.dot(profile));
  };
}

namespace {

std::shared_ptr<const UncertainModel> pulse_averaged_model(UncertainModel model, int pulses) {
  for (const double rate : model.rates) {
    const PulseAveragedMode seen = pulse_averaged_mode(std::exp(-rate * model.period), pulses);
    model.seen_before.push_back(seen.before);
    model.seen_power.push_back(seen.power);
  }
  return std::make_shared<const UncertainModel>(std::move(model));
}

}  // namespace

ReducedModel pulse_averaged_model(const ReducedModel& model, int pulses,
                                  const PromptFeedthrough& feed) {
  const Eigen::Index n = model.order();
  if (2 * n > kMaxOrder) {
    throw Error(ErrorParts{.key = "model.order",
                           .problem = "samples by pulses double the number of states",
                           .found = fmt::format("{}", n),
                           .accepted = fmt::format("at most {}", kMaxOrder / 2)});
  }
  const DecayingModes modes(model);
  const Eigen::MatrixXd& right = modes.right;
  const Eigen::MatrixXd& left = modes.left;
  Eigen::VectorXd before(n);
  Eigen::VectorXd power(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const PulseAveragedMode seen = pulse_averaged_mode(modes.decay[i], pulses);
    before[i] = seen.before;
    power[i] = seen.power;
  }
  Eigen::MatrixXd shown = right * power.asDiagonal() * left * Eigen::MatrixXd(model.B_d);
  if (feed) shown += terms_of(feed, model);
  ReducedModel twice = with_shown_states(model, right * before.asDiagonal() * left, shown);
  if (model.uncertain) twice.uncertain = pulse_averaged_model(*model.uncertain, pulses);
  return twice;
}

void average_over_pulses(ObserverModel& observer, int pulses, const crosscheck::LagSums& lags,
                         double period) {
  observer.averaged = true;
  for (std::size_t i = 0; i < kObserverModes; ++i) {
    const PulseAveragedMode seen = pulse_averaged_mode(observer.decay[i], pulses);
    observer.seen_before[i] = seen.before;
    observer.seen_power[i] = seen.power;
  }
  if (pulses < 2) return;
  // As in prompt_feedthrough: few lags minus many.
  const double pulse_period = period / pulses;
  const double share = (pulses - 1.0) / pulses;
  const auto relative = [pulse_period](double rate) {
    return rate * shortfall(rate, pulse_period);
  };
  for (std::size_t j = 0; j < observer.absorptions * observer.choroids; ++j) {
    double difference = 0.0;
    for (std::size_t i = 0; i < kObserverModes; ++i) {
      const double decay = observer.decay[i];
      const double rate = -std::log(decay) / period;
      difference += observer.volume[j][i] / (1.0 - decay) * relative(rate);
    }
    for (std::size_t i = 0; i < lags.rate.size(); ++i) {
      difference -= lags.at[j].volume[i] * relative(lags.rate[i]);
    }
    observer.seen_feed[j] = share * difference;
  }
}

void average_between_samples(ObserverModel& observer, const IntersampleTiming& timing,
                             const crosscheck::LagSums& lags, double period) {
  const Window window = sample_windows(timing).window[0];
  observer.averaged = true;
  for (std::size_t i = 0; i < kObserverModes; ++i) {
    // A lag that vanishes within a period has no rate: it is always at its steady state.
    const double decay = observer.decay[i];
    const double exponent = decay > 0.0 ? -std::log(decay) : 0.0;
    observer.seen_before[i] = decay > 0.0 ? mean_decay(exponent, window) : 0.0;
    const double rise = decay > 0.0 ? mean_rise(exponent, window) : 1.0;
    observer.seen_power[i] = rise / (1.0 - decay);
  }
  // The feedthrough comes from the many lags.
  for (std::size_t j = 0; j < observer.absorptions * observer.choroids; ++j) {
    double difference = 0.0;
    for (std::size_t i = 0; i < kObserverModes; ++i) {
      difference -= observer.volume[j][i] * observer.seen_power[i];
    }
    for (std::size_t i = 0; i < lags.rate.size(); ++i) {
      difference += lags.at[j].volume[i] * mean_rise(lags.rate[i] * period, window);
    }
    observer.seen_feed[j] = difference;
  }
}

}  // namespace photocoag
