#include "photocoag/rom/reduced_model.hpp"

#include <algorithm>

#include "photocoag/rom/discretize.hpp"

namespace photocoag {

double ErrorReport::peak_max() const noexcept {
  return peak.empty() ? 0.0 : *std::max_element(peak.begin(), peak.end());
}

double ErrorReport::volume_max() const noexcept {
  return volume.empty() ? 0.0 : *std::max_element(volume.begin(), volume.end());
}

void ReducedModel::evaluate(double absorption_factor, ParametricMatrices& out) const noexcept {
  if (parameters != 1) return evaluate(absorption_factor, 1.0, out);
  const int n = order();
  const int terms = theta.terms;
  out.input.setZero(n);
  out.input_slope.setZero(n);
  out.volume.resize(n);
  out.volume_slope.resize(n);
  TermVector value;
  TermVector slope;
  theta.evaluate(absorption_factor, value, slope);
  double input[even(kMaxOrder)] = {};
  double input_slope[even(kMaxOrder)] = {};
  for (int j = 0; j < terms; ++j) {
    const double* column = B_d.data() + j * n;
    for (int i = 0; i < n; ++i) input[i] += value[j] * column[i];
    for (int i = 0; i < n; ++i) input_slope[i] += slope[j] * column[i];
  }
  for (int i = 0; i < n; ++i) {
    const double* column = C_volume.data() + i * terms;
    double volume = 0.0;
    double volume_slope = 0.0;
    for (int j = 0; j < terms; ++j) {
      volume += value[j] * column[j];
      volume_slope += slope[j] * column[j];
    }
    out.input[i] = input[i];
    out.input_slope[i] = input_slope[i];
    out.volume[i] = volume;
    out.volume_slope[i] = volume_slope;
  }
  if (volume_normalized) {
    // (C / s)' = (C' - C s' / s) / s
    const ValueAndSlope s = whole.evaluate(absorption_factor);
    for (int i = 0; i < n; ++i) {
      out.volume[i] /= s.value;
      out.volume_slope[i] = (out.volume_slope[i] - out.volume[i] * s.slope) / s.value;
    }
  }
}

void ReducedModel::evaluate(double absorption_factor, double choroid_factor,
                            ParametricMatrices& out) const noexcept {
  const int n = order();
  out.input_slope_choroid.setZero(n);
  out.volume_slope_choroid.setZero(n);
  if (parameters == 1) {
    evaluate(absorption_factor, out);
    return;
  }
  out.input.setZero(n);
  out.input_slope.setZero(n);
  out.volume.setZero(n);
  out.volume_slope.setZero(n);
  TermVector value;
  TermVector slope;
  TermVector slope_choroid;
  theta.evaluate(absorption_factor, choroid_factor, value, slope, slope_choroid);
  for (int j = 0; j < theta.terms; ++j) {
    for (int i = 0; i < n; ++i) {
      out.input[i] += value[j] * B_d(i, j);
      out.input_slope[i] += slope[j] * B_d(i, j);
      out.input_slope_choroid[i] += slope_choroid[j] * B_d(i, j);
      out.volume[i] += value[j] * C_volume(j, i);
      out.volume_slope[i] += slope[j] * C_volume(j, i);
      out.volume_slope_choroid[i] += slope_choroid[j] * C_volume(j, i);
    }
  }
  if (volume_normalized) {
    const ValueAndSlope s = whole.evaluate(absorption_factor, choroid_factor);
    for (int i = 0; i < n; ++i) {
      out.volume[i] /= s.value;
      out.volume_slope[i] = (out.volume_slope[i] - out.volume[i] * s.slope) / s.value;
      out.volume_slope_choroid[i] =
          (out.volume_slope_choroid[i] - out.volume[i] * s.slope_choroid) / s.value;
    }
  }
}

void ReducedModel::discretize(double period_s, Discretization how) {
  period = period_s;
  discretization = how;
  certificate.reset();
  const DiscretePair pair = photocoag::discretize(A, period_s, how);
  A_d = pair.transition;
  B_d = pair.input * B;
}

ReducedPlant::ReducedPlant(const ReducedModel& model, AbsorptionFactors absorption)
    : model_(model), absorption_(absorption), state_(StateVector::Zero(model.order())) {
  model_.evaluate(absorption_.alpha, absorption_.beta, matrices_);
}

void ReducedPlant::set_period(double period) {
  if (period == model_.period) return;
  model_.discretize(period, model_.discretization);
  model_.evaluate(absorption_.alpha, absorption_.beta, matrices_);
}

void ReducedPlant::step(double power) noexcept {
  state_ = (model_.A_d.lazyProduct(state_) + matrices_.input * power).eval();
}

Outputs ReducedPlant::outputs() const noexcept {
  return {.volume = matrices_.volume.dot(state_), .peak = model_.C_peak.dot(state_)};
}

}  // namespace photocoag
