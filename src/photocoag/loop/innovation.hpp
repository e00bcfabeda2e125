// Role: online; the estimator's innovation, for the supervisor. Used by loop, faults, python.
#pragma once

#include "photocoag/loop/controller.hpp"

namespace photocoag {

/// The estimator's last innovation, K, and its standard deviation.
struct Innovation {
  double value = 0.0;
  double sigma = 0.0;
};

template <PredictiveController M, Estimator F>
Innovation innovation_of(const BasicController<M, F>& controller) noexcept {
  return {controller.filter().innovation(), controller.filter().innovation_sigma()};
}

}  // namespace photocoag
