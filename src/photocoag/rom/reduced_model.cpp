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

void ReducedModel::evaluate(double alpha, ParametricMatrices& out) const noexcept {
  if (parameters.size() != 1) return evaluate(AbsorptionFactors(alpha), out);
  const int n = order();
  const int terms = theta.terms;
  out.input.setZero(n);
  out.input_slope[0].setZero(n);
  out.volume.resize(n);
  out.volume_slope[0].resize(n);
  TermVector value;
  TermVector slope;
  theta.evaluate(alpha, value, slope);
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
    out.input_slope[0][i] = input_slope[i];
    out.volume[i] = volume;
    out.volume_slope[0][i] = volume_slope;
  }
  if (volume_normalized) {
    // (C / s)' = (C' - C s' / s) / s
    const ValueAndSlope s = whole.evaluate(alpha);
    for (int i = 0; i < n; ++i) {
      out.volume[i] /= s.value;
      out.volume_slope[0][i] = (out.volume_slope[0][i] - out.volume[i] * s.slope[0]) / s.value;
    }
  }
}

void ReducedModel::evaluate(AbsorptionFactors at, ParametricMatrices& out) const noexcept {
  const int n = order();
  const std::size_t count = parameters.size();
  for (std::size_t q = count; q < kMaxParameters; ++q) {
    out.input_slope[q].setZero(n);
    out.volume_slope[q].setZero(n);
  }
  if (count == 1) return evaluate(at.alpha, out);
  out.input.setZero(n);
  out.volume.setZero(n);
  for (std::size_t q = 0; q < count; ++q) {
    out.input_slope[q].setZero(n);
    out.volume_slope[q].setZero(n);
  }
  TermVector value;
  TermSlopes slope;
  theta.evaluate(at, value, slope);
  for (int j = 0; j < theta.terms; ++j) {
    for (int i = 0; i < n; ++i) {
      out.input[i] += value[j] * B_d(i, j);
      out.volume[i] += value[j] * C_volume(j, i);
      for (std::size_t q = 0; q < count; ++q) {
        out.input_slope[q][i] += slope[q][j] * B_d(i, j);
        out.volume_slope[q][i] += slope[q][j] * C_volume(j, i);
      }
    }
  }
  if (volume_normalized) {
    const ValueAndSlope s = whole.evaluate(at);
    for (int i = 0; i < n; ++i) {
      out.volume[i] /= s.value;
      for (std::size_t q = 0; q < count; ++q) {
        out.volume_slope[q][i] = (out.volume_slope[q][i] - out.volume[i] * s.slope[q]) / s.value;
      }
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
  model_.evaluate(absorption_, matrices_);
}

void ReducedPlant::set_period(double period) {
  if (period == model_.period) return;
  model_.discretize(period, model_.discretization);
  model_.evaluate(absorption_, matrices_);
}

void ReducedPlant::step(double power) noexcept {
  state_ = (model_.A_d.lazyProduct(state_) + matrices_.input * power).eval();
}

Outputs ReducedPlant::outputs() const noexcept {
  return {.volume = matrices_.volume.dot(state_), .peak = model_.C_peak.dot(state_)};
}

}  // namespace photocoag
