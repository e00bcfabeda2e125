#include "export/replay.hpp"

#include <cmath>
#include <random>

#include "photocoag/rom/intersample.hpp"
#include "support/uncertain_eyes.hpp"

namespace photocoag::testing {
namespace {

constexpr int kTreatment = 250;

ControlSettings paper(int horizon, StateWeight weight, double r1, double r2) {
  ControlSettings control;
  control.period = 4e-3;
  control.horizon = horizon;
  control.state_weight = weight;
  control.power_weight = r1;
  control.power_change_weight = r2;
  return control;
}

// A reference that jumps up to the limit and down again, every tenth period, and a laser that is
// hardly enough: bounds and limits hold, and let go.
void disturb(ControlSettings& control) {
  control.power_max = 0.06;
  control.peak_max = 30.0;
  control.peak_reference = 29.0;
  for (int k = 0; 10 * k < kTreatment; ++k) {
    for (const double at : {0.0, 9.9}) {
      control.reference_times.push_back((10.0 * k + at) * control.period);
      control.reference_values.push_back(k % 2 == 0 ? 29.99 : 18.0);
    }
  }
}

// An eye of an uncertain model.
class UncertainEye {
 public:
  UncertainEye(const UncertainModel& model, const QuantityVector& logs) {
    model.step_of(model.period, decay_, gain_);
    x_.setZero(model.order());
    StateVector peak;
    ResidueSlopes slopes;
    model.evaluate(logs, peak, slopes, volume_, slopes);
    for (int q = 0; q < model.count(); ++q) {
      const UncertainQuantity& quantity = model.quantities[static_cast<std::size_t>(q)];
      if (quantity.kind == QuantityKind::kCalibration) volume_ *= std::exp(logs[q]);
    }
  }
  double step(double power) {
    x_ = decay_.cwiseProduct(x_) + gain_ * power;
    return volume_.dot(x_);
  }

 private:
  StateVector decay_, gain_, x_, volume_;
};

// One period: the sample that the eye gives without noise.
using Eye = std::function<double(double power)>;

Eye random_eye(const ReducedModel& model, const std::function<double()>& unit) {
  if (model.uncertain == nullptr) {
    ReducedPlant plant(model, 0.35 + 1.25 * unit());
    return [plant](double power) mutable {
      plant.step(power);
      return plant.outputs().volume;
    };
  }
  QuantityVector logs(model.uncertain->count());
  for (int q = 0; q < model.uncertain->count(); ++q) {
    const UncertainQuantity& quantity = model.uncertain->quantities[static_cast<std::size_t>(q)];
    const double low = std::log(quantity.low);
    logs[q] = low + unit() * (std::log(quantity.high) - low);
  }
  UncertainEye eye(*model.uncertain, logs);
  return [eye](double power) mutable { return eye.step(power); };
}

}  // namespace

std::vector<ReplayCase> chance_cases(int horizon) {
  ControlSettings plain;
  plain.horizon = horizon;
  plain.robust = Robustness::kChance;
  plain.limit_probability = 0.2;
  EstimatorSettings learning = believing();
  learning.prior.noise_spread = 0.3;
  std::vector<ReplayCase> all = {{"chance", plain, learning}};
  ControlSettings late = plain;
  late.delay = 1;
  late.power_change_weight = 2e3;
  EstimatorSettings considering = believing();
  for (const std::size_t q : {4U, 5U}) considering.prior.quantities[q].estimated = false;
  all.push_back({"chance, delayed power, considered quantities", late, considering});
  ControlSettings gentle = plain;
  gentle.power_weight = 1e3;
  gentle.power_min = 2e-3;
  gentle.identification_duration = 8e-3;
  gentle.identification_power = 0.02;
  gentle.identification_sigma = 2.5;
  all.push_back({"chance, a gentle start", gentle, learning});
  ControlSettings posterior = plain;
  posterior.robust = Robustness::kNone;
  posterior.state_weight = StateWeight::kDelayed;
  posterior.power_weight = 5e1;
  all.push_back({"posterior alone, delayed weight", posterior, learning});
  for (ReplayCase& one : all) disturb(one.control);
  return all;
}

ReducedModel chance_model(const ReplayCase& what) {
  ReducedModel model = model_of_seven();
  auto uncertain = std::make_shared<UncertainModel>(*model.uncertain);
  uncertain->quantities = what.estimator.prior.quantities;
  model.uncertain = uncertain;
  return model;
}

std::vector<ReplayCase> replay_cases(int horizon) {
  std::vector<ReplayCase> all = {
      {"a, delayed power", paper(horizon, StateWeight::kConstant, 5e4, 0.0)},
      {"b, first power given", paper(horizon, StateWeight::kDelayed, 5e1, 0.0)},
      {"c", paper(horizon, StateWeight::kConstant, 0.0, 5e4)},
      {"d, plans kept", paper(horizon, StateWeight::kDelayed, 0.0, 5e1)},
  };
  all[0].control.delay = 1;
  all[1].control.first_power = 0.02;
  all[3].control.solve_every = horizon > 2 ? 2 : 1;
  ControlSettings plain;  // 1 kHz
  plain.horizon = horizon;
  plain.shares = {0.5, 0.7, 0.8, 0.9, 0.95};
  all.push_back({"plain, shares", plain});
  ControlSettings both;
  both.horizon = horizon;
  both.power_weight = 1e3;
  both.power_change_weight = 2e3;
  both.power_min = 2e-3;
  EstimatorSettings told;
  told.timing = {.averaging = 0.3, .sample_lag = 0.2, .power_lag = 0.1};
  all.push_back({"both weights, told of the bench", both, told});
  ControlSettings certified = both;
  certified.robust = Robustness::kCertified;
  certified.robust_sigma = 2.0;
  certified.delay = 1;
  EstimatorSettings open;
  open.outlier_sigma = 0.0;
  all.push_back({"certified, delayed power", certified, open});
  for (ReplayCase& one : all) disturb(one.control);
  return all;
}

std::vector<ReplayCycle> record(const ReducedModel& plain, const ReplayCase& what, int cycles,
                                std::uint64_t seed) {
  const ReducedModel model = controller_model(plain, what.estimator.timing);
  const Controller cold(model, what.control, what.estimator);
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit;
  std::vector<ReplayCycle> recorded;
  Controller controller = cold;
  Eye eye;
  double noise = 0.0;
  for (int n = 0; n < cycles; ++n) {
    ReplayCycle cycle;
    cycle.first = n % kTreatment == 0;
    Decision decision;
    if (cycle.first) {
      controller = cold;
      eye = random_eye(model, [&] { return unit(generator); });
      noise = 0.05 + 0.6 * unit(generator);
      decision = controller.decide();
    } else {
      cycle.applied = recorded.back().power * (1.0 + 0.05 * normal(generator));
      cycle.sample = eye(cycle.applied) + noise * normal(generator);
      const double kind = unit(generator);
      if (kind < 0.01) cycle.sample = std::nan("");
      if (kind > 0.99) cycle.sample += 60.0;
      cycle.use = controller.observe({cycle.sample, cycle.applied}).status;
      decision = controller.decide();
    }
    const double u = decision.power;
    cycle.power = u;
    cycle.peak = controller.estimate().outputs.peak;
    cycle.status = decision.status;
    cycle.changes = decision.iterations;
    cycle.limited =
        decision.limit_active || u == what.control.power_min || u == what.control.power_max;
    recorded.push_back(cycle);
  }
  return recorded;
}

ReplayDifference replay(const Exported& exported, const std::vector<ReplayCycle>& recorded) {
  std::vector<std::max_align_t> memory = exported.controller();
  void* const c = memory.data();
  ReplayDifference difference;
  for (const ReplayCycle& cycle : recorded) {
    double power = 0.0;
    if (cycle.first) {
      exported.init(c);
      power = exported.start(c);
    } else if (std::isnan(cycle.sample)) {
      power = exported.step_without_sample(c, cycle.applied);
    } else {
      power = exported.step(c, cycle.sample, cycle.applied);
    }
    const double off = std::abs(power - cycle.power);
    if (!(off <= difference.power)) {
      difference.power = off;
      difference.worst = difference.cycles;
    }
    const double peak = std::abs(exported.peak(c) - cycle.peak);
    if (!(peak <= difference.peak)) difference.peak = peak;
    if (!(off <= kSingleBar.power && peak <= kSingleBar.peak)) ++difference.beyond;
    ++difference.cycles;
  }
  return difference;
}

}  // namespace photocoag::testing
