#include "photocoag/mor/refine.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/mor/parameter_dependence.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The method's hyperparameters, tuned once by a random search on the paper's tissue and on one
// with ten times the choroid's absorption, at 1 ms and at 4 ms: smallest worst error over on/off
// powers of many dwell times with sum |e_k| held small. None of these alphas is among those on
// which the error is measured.
struct TrainingAlpha {
  double value;
  double log_peak_weight;
  double log_volume_weight;
};
struct TrainingFactors {
  AbsorptionFactors at;
  double log_peak_weight;
  double log_volume_weight;
};
constexpr std::array<TrainingAlpha, 8> kTraining{{{0.29, 0.84, 1.21},
                                                  {0.345, 0.27, 0.39},
                                                  {0.47, -0.57, -0.97},
                                                  {0.66, -0.05, 0.06},
                                                  {0.92, -1.54, -0.99},
                                                  {1.24, -0.57, -0.3},
                                                  {1.48, 0.48, 0.1},
                                                  {1.72, 0.73, 0.77}}};

std::vector<TrainingFactors> training(const std::vector<double>& betas) {
  std::vector<TrainingFactors> all;
  for (const double beta : betas) {
    for (const TrainingAlpha& alpha : kTraining) {
      all.push_back({{alpha.value, beta}, alpha.log_peak_weight, alpha.log_volume_weight});
    }
  }
  return all;
}

// Log of a sample's weight at 1 ms, 10^-2.5 s, … 10 s, on top of equal weight per decade of time;
// linear in log t.
constexpr std::array<double, 9> kHalfDecadeWeight{0.82, 0.98,  0.32,  0.17, 0.36,
                                                  0.01, -0.14, -0.52, -1.12};
constexpr double kFirstTime = 1e-3;
constexpr double kLastTime = 6.0;

double time_weight(double time) {
  const double position =
      std::clamp(2.0 * std::log10(time / kFirstTime), 0.0, double(kHalfDecadeWeight.size() - 1));
  const auto below = std::min(static_cast<std::size_t>(position), kHalfDecadeWeight.size() - 2);
  const double fraction = position - static_cast<double>(below);
  return std::exp((1.0 - fraction) * kHalfDecadeWeight[below] +
                  fraction * kHalfDecadeWeight[below + 1]);
}

// Decay of x' = -rate x over one period: a(x) with x = rate * period, 1 - a, and a' x.
struct Decay {
  double value;
  double loss;
  double slope;
};

Decay decay_of(double x, Discretization how) {
  switch (how) {
    case Discretization::kImplicitEuler: {
      const double value = 1.0 / (1.0 + x);
      return {value, x * value, -x * value * value};
    }
    case Discretization::kTrBdf2: {
      const double stage = 1.0 / (1.0 + TrBdf2::kShift * x);
      const double stage_slope = -TrBdf2::kShift * x * stage * stage;
      return {TrBdf2::decay(x), x * TrBdf2::gain(x),
              stage_slope * (2.0 * TrBdf2::kMix * stage + 1.0 - TrBdf2::kMix)};
    }
    case Discretization::kZeroOrderHold:
      break;
  }
  return {std::exp(-x), -std::expm1(-x), -x * std::exp(-x)};
}

// Response of x' = -rate x + u at the end of period k to u = 1 during period 1, (1 - a) / rate
// a^(k-1) for every scheme that keeps steady states, and its derivative with respect to log(rate).
struct Pulse {
  double value;
  double slope;
};

Pulse pulse(double rate, double period, Discretization how, double k) {
  const Decay a = decay_of(rate * period, how);
  const double before = k > 1.0 ? std::pow(a.value, k - 2.0) : 0.0;  // a^(k-2)
  const double left = k > 1.0 ? before * a.value : 1.0;              // a^(k-1)
  const double gain = a.loss / rate;
  return {gain * left, -(a.slope / rate + gain) * left + gain * (k - 1.0) * before * a.slope};
}

// What is fitted: pulse responses of both outputs at the training alphas, each divided by its
// steady gain and weighted.
struct Target {
  std::vector<double> periods;  // k
  VectorXd weight;              // per k
  MatrixXd theta;               // terms x alphas
  MatrixXd peak;                // k x alphas
  MatrixXd volume;              // k x alphas
  VectorXd peak_scale;          // per alpha: weight / steady gain, W/K
  VectorXd volume_scale;
};

// Every period at first, then 60 per factor e^7.
std::vector<double> sampled_periods(double period) {
  constexpr double kRatio = 1.13;
  const double last = std::max(4.0, kLastTime / period);
  std::vector<double> periods;
  for (double k = 1.0; k < last; k = std::max(k + 1.0, std::round(k * kRatio)))
    periods.push_back(k);
  return periods;
}

Target make_target(const FullOrderModel& full, const ImpulseSpace& space,
                   const ParametricSource& source, double period, Discretization how,
                   const std::vector<double>& betas) {
  const std::vector<TrainingFactors> trained = training(betas);
  Target target;
  target.periods = sampled_periods(period);
  const auto count = static_cast<Index>(target.periods.size());
  const auto alphas = static_cast<Index>(trained.size());
  target.weight.resize(count);
  MatrixXd decay(count, space.size());
  for (Index i = 0; i < count; ++i) {
    const Index next = std::min(i + 1, count - 1);
    const double width = target.periods[next] - target.periods[next - 1];
    // A sample represents `width` periods, and k e_k is the possible sum over a decade of time.
    target.weight[i] =
        std::sqrt(width * target.periods[i]) * time_weight(target.periods[i] * period);
    for (Index j = 0; j < space.size(); ++j) {
      decay(i, j) = target.weight[i] * pulse(space.rates[j], period, how, target.periods[i]).value;
    }
  }
  target.theta.resize(source.theta.terms, alphas);
  target.peak.resize(count, alphas);
  target.volume.resize(count, alphas);
  target.peak_scale.resize(alphas);
  target.volume_scale.resize(alphas);
  for (Index a = 0; a < alphas; ++a) {
    const TrainingFactors& one = trained[static_cast<std::size_t>(a)];
    const VectorXd input = space.axial_source * full.axial_source(one.at);
    const VectorXd to_peak = full.input_gain() * input.cwiseProduct(space.peak);
    const VectorXd to_volume = full.input_gain() * input.cwiseAbs2();
    target.peak_scale[a] = std::exp(one.log_peak_weight) / to_peak.cwiseQuotient(space.rates).sum();
    target.volume_scale[a] =
        std::exp(one.log_volume_weight) / to_volume.cwiseQuotient(space.rates).sum();
    target.peak.col(a) = target.peak_scale[a] * decay * to_peak;
    target.volume.col(a) = target.volume_scale[a] * decay * to_volume;
    target.theta.col(a) = theta_at(source.theta, one.at);
  }
  return target;
}

// The free numbers: log rates, B_j / gain (state by state), C_peak.
struct Parameters {
  VectorXd log_rate;
  MatrixXd input;  // states x terms
  VectorXd peak;

  Index states() const { return log_rate.size(); }
  Index count() const { return states() * (2 + input.cols()); }
  void add(const VectorXd& step) {
    const Index n = states();
    log_rate += step.head(n);
    input += Eigen::Map<const MatrixXd>(step.data() + n, n, input.cols());
    peak += step.tail(n);
  }
};

// Half the sum of squares; with `normal` and `gradient` the Gauss-Newton matrix J'J and J'r.
double cost_of(const Target& target, const Parameters& p, double gain, double period,
               Discretization how, MatrixXd* normal, VectorXd* gradient) {
  const Index n = p.states();
  const Index terms = p.input.cols();
  const auto count = static_cast<Index>(target.periods.size());
  MatrixXd decay(count, n);
  MatrixXd slope(count, n);
  for (Index i = 0; i < n; ++i) {
    const double rate = std::exp(p.log_rate[i]);
    for (Index k = 0; k < count; ++k) {
      const Pulse p_k = pulse(rate, period, how, target.periods[k]);
      decay(k, i) = target.weight[k] * p_k.value;
      slope(k, i) = target.weight[k] * p_k.slope;
    }
  }
  double sum = 0.0;
  MatrixXd jacobian = MatrixXd::Zero(2 * count, p.count());
  VectorXd residual(2 * count);
  if (normal != nullptr) {
    normal->setZero(p.count(), p.count());
    gradient->setZero(p.count());
  }
  for (Index a = 0; a < target.theta.cols(); ++a) {
    const VectorXd theta = target.theta.col(a);
    const VectorXd b = p.input * theta;
    const double to_peak = gain * target.peak_scale[a];
    const double to_volume = gain * target.volume_scale[a];
    residual.head(count) = to_peak * decay * b.cwiseProduct(p.peak) - target.peak.col(a);
    residual.tail(count) = to_volume * decay * b.cwiseAbs2() - target.volume.col(a);
    sum += 0.5 * residual.squaredNorm();
    if (normal == nullptr) continue;
    for (Index i = 0; i < n; ++i) {
      jacobian.col(i).head(count) = to_peak * b[i] * p.peak[i] * slope.col(i);
      jacobian.col(i).tail(count) = to_volume * b[i] * b[i] * slope.col(i);
      for (Index j = 0; j < terms; ++j) {
        auto column = jacobian.col(n + j * n + i);
        column.head(count) = to_peak * p.peak[i] * theta[j] * decay.col(i);
        column.tail(count) = to_volume * 2.0 * b[i] * theta[j] * decay.col(i);
      }
      jacobian.col(n + terms * n + i).head(count) = to_peak * b[i] * decay.col(i);
    }
    normal->noalias() += jacobian.transpose() * jacobian;
    gradient->noalias() += jacobian.transpose() * residual;
  }
  return sum;
}

}  // namespace

double refine(const FullOrderModel& full, const ImpulseSpace& space, const ParametricSource& source,
              double period, Discretization how, ReducedModel& model,
              const std::vector<double>& betas) {
  constexpr int kMaxIterations = 200;
  constexpr double kMaxDamping = 1e12;
  const double gain = full.input_gain();
  const Target target = make_target(full, space, source, period, how, betas);
  Parameters best{VectorXd((-MatrixXd(model.A).diagonal()).array().log()),
                  MatrixXd(model.C_volume).transpose(), VectorXd(model.C_peak)};
  MatrixXd normal;
  VectorXd gradient;
  double damping = 1e-3;
  double cost = cost_of(target, best, gain, period, how, &normal, &gradient);
  for (int iteration = 0; iteration < kMaxIterations && damping < kMaxDamping; ++iteration) {
    MatrixXd damped = normal;
    damped.diagonal() *= 1.0 + damping;
    Parameters trial = best;
    trial.add(-solve_symmetric(damped, gradient));
    const double trial_cost = cost_of(target, trial, gain, period, how, nullptr, nullptr);
    if (!(trial_cost < cost)) {
      damping *= 4.0;
      continue;
    }
    const bool converged = cost - trial_cost < 1e-7 * cost && damping < 1.0;
    best = trial;
    cost = cost_of(target, best, gain, period, how, &normal, &gradient);
    damping *= 0.2;
    if (converged) break;
  }
  std::vector<Index> slowest_first(best.states());
  std::iota(slowest_first.begin(), slowest_first.end(), Index{0});
  std::sort(slowest_first.begin(), slowest_first.end(),
            [&best](Index i, Index j) { return best.log_rate[i] < best.log_rate[j]; });
  for (Index i = 0; i < best.states(); ++i) {
    const Index from = slowest_first[i];
    const double sign = best.peak[from] < 0.0 ? -1.0 : 1.0;
    model.A(i, i) = -std::exp(best.log_rate[from]);
    model.C_peak[i] = sign * best.peak[from];
    model.C_volume.col(i) = sign * best.input.row(from).transpose();
    model.B.row(i) = gain * sign * best.input.row(from);
  }
  return cost;
}

namespace {

// Diagonal states driven by one power, and both outputs as their weighted sums.
struct DiagonalResponse {
  VectorXd decay;
  VectorXd gain;  // per W
  VectorXd to_peak;
  VectorXd to_volume;

  static DiagonalResponse of(const VectorXd& rates, const VectorXd& input, const VectorXd& peak,
                             const VectorXd& volume, double period, Discretization how) {
    DiagonalResponse r{VectorXd(rates.size()), VectorXd(rates.size()), peak, volume};
    for (Index j = 0; j < rates.size(); ++j) {
      const Decay a = decay_of(rates[j] * period, how);
      r.decay[j] = a.value;
      r.gain[j] = input[j] * a.loss / rates[j];
    }
    return r;
  }
};

// Largest |error| / largest value of the two outputs while the power is on for `dwell` periods and
// off for as many, in turn; 0: always on.
double error_of_run(const DiagonalResponse& full, const DiagonalResponse& reduced,
                    std::size_t periods, std::size_t dwell) {
  VectorXd x = VectorXd::Zero(full.decay.size());
  VectorXd z = VectorXd::Zero(reduced.decay.size());
  Eigen::Array2d error = Eigen::Array2d::Zero();
  Eigen::Array2d value = Eigen::Array2d::Zero();
  for (std::size_t k = 0; k < periods; ++k) {
    const double power = dwell == 0 || k / dwell % 2 == 0 ? 1.0 : 0.0;
    x = full.decay.cwiseProduct(x) + power * full.gain;
    z = reduced.decay.cwiseProduct(z) + power * reduced.gain;
    const Eigen::Array2d truth(full.to_peak.dot(x), full.to_volume.dot(x));
    const Eigen::Array2d model(reduced.to_peak.dot(z), reduced.to_volume.dot(z));
    error = error.max((model - truth).abs());
    value = value.max(truth.abs());
  }
  return (error / value).maxCoeff();
}

}  // namespace

double response_error(const FullOrderModel& full, const ImpulseSpace& space, double period,
                      Discretization how, const ReducedModel& model,
                      const std::vector<double>& betas) {
  constexpr std::array kAlphas{0.32, 0.41, 0.57, 0.79, 1.08, 1.36, 1.63};
  constexpr double kDuration = 0.4;                        // s
  constexpr std::array kDwells{0.0, 0.007, 0.023, 0.061};  // s; 0: constant power
  const auto periods = static_cast<std::size_t>(std::max(4.0, std::round(kDuration / period)));
  double worst = 0.0;
  for (const double beta : betas) {
    for (const double alpha : kAlphas) {
      const AbsorptionFactors at{alpha, beta};
      const VectorXd source = space.axial_source * full.axial_source(at);
      const VectorXd input = full.input_gain() * source;
      const auto truth = DiagonalResponse::of(space.rates, input, space.peak, source, period, how);
      const VectorXd theta = theta_at(model.theta, at);
      const auto reduced = DiagonalResponse::of(
          -MatrixXd(model.A).diagonal(), MatrixXd(model.B) * theta, VectorXd(model.C_peak),
          MatrixXd(model.C_volume).transpose() * theta, period, how);
      for (const double dwell : kDwells) {
        const auto held = static_cast<std::size_t>(std::ceil(dwell / period));
        worst = std::max(worst, error_of_run(truth, reduced, periods, held));
      }
    }
  }
  return worst;
}

MatrixXd fitted_trial(const FullOrderModel& full, const ImpulseSpace& space, double period,
                      Discretization how, const ReducedModel& model,
                      const std::vector<double>& betas) {
  const std::vector<double> periods = sampled_periods(period);
  const Index n = model.order();
  MatrixXd square = MatrixXd::Zero(n, n);              // sum z z'
  MatrixXd product = MatrixXd::Zero(space.size(), n);  // sum x z'
  VectorXd x(space.size());
  VectorXd z(n);
  for (const TrainingFactors& one : training(betas)) {
    const VectorXd input = full.input_gain() * space.axial_source * full.axial_source(one.at);
    const VectorXd reduced = MatrixXd(model.B) * theta_at(model.theta, one.at);
    for (const double k : periods) {
      for (Index j = 0; j < x.size(); ++j)
        x[j] = input[j] * pulse(space.rates[j], period, how, k).value;
      for (Index i = 0; i < n; ++i) z[i] = reduced[i] * pulse(-model.A(i, i), period, how, k).value;
      // Samples stand for periods in proportion to k, and late states are small.
      const double weight = k * k * time_weight(k * period);
      square += weight * z * z.transpose();
      product += weight * x * z.transpose();
    }
  }
  return solve_symmetric_from_right(square, product);
}

}  // namespace photocoag
