// Role: tests of estimation, mpc, loop and rt; small reduced models, made once per program, and
// random numbers that depend on a seed alone.
#pragma once

#include <Eigen/Core>
#include <Eigen/QR>
#include <cmath>
#include <cstdint>
#include <memory>

#include "photocoag/core/random.hpp"
#include "photocoag/estimation/settings.hpp"
#include "photocoag/mor/reduce.hpp"

namespace photocoag::testing {

/// Deterministic random numbers.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : seed_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * photocoag::uniform(seed_, count_++, RandomStream::kTest);
  }
  double normal() { return standard_normal(seed_, count_++, RandomStream::kTest); }
  bool chance(double probability) { return between(0.0, 1.0) < probability; }
  int integer(int low, int high) { return static_cast<int>(std::floor(between(low, high + 1))); }

 private:
  std::uint64_t seed_;
  std::uint64_t count_ = 0;
};

/// A coarse grid: the model's accuracy plays no part in these tests, its structure does.
inline std::shared_ptr<const FullOrderModel> small_full_model() {
  static const auto full =
      std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{.min_cells = 4000});
  return full;
}

/// The matrices are reduce()'s; without its error report and certificate, which take half the time
/// and are not looked at here. Every test is a process of its own and makes its model anew.
inline ReducedModel small_model(double period) {
  static const ImpulseSpace space = reduction_space(*small_full_model());
  ReducedModel model =
      project_model(*small_full_model(), space, {}, period, Discretization::kZeroOrderHold);
  verify(model);
  return model;
}

inline const ReducedModel& model_1khz() {
  static const ReducedModel model = small_model(1e-3);
  return model;
}

inline const ReducedModel& model_250hz() {
  static const ReducedModel model = small_model(4e-3);
  return model;
}

/// An estimator E that has followed a reduced eye with noise for so many periods.
template <typename E>
E followed(const EstimatorSettings& settings, double alpha, int periods) {
  E estimator(model_1khz(), settings);
  ReducedPlant plant(model_1khz(), alpha);
  Draw draw(4);
  for (int k = 0; k < periods; ++k) {
    const double power = draw.between(0.0, 0.05);
    plant.step(power);
    estimator.predict(power);
    estimator.update(plant.outputs().volume + 0.288 * draw.normal());
  }
  return estimator;
}

inline Eigen::MatrixXd random_orthogonal(int n, Draw& draw) {
  const Eigen::MatrixXd random = Eigen::MatrixXd::NullaryExpr(n, n, [&] { return draw.normal(); });
  return random.householderQr().householderQ();
}

/// The same model in the coordinates T x with T = D M: M random with condition number 3, D diagonal
/// with scales from 1e-6 to 1e6. (A full T with a condition of 1e12 would lose the digits in the
/// product itself.)
inline ReducedModel rescaled(const ReducedModel& model, std::uint64_t seed) {
  Draw draw(seed);
  const int n = model.order();
  const Eigen::MatrixXd left = random_orthogonal(n, draw);
  const Eigen::MatrixXd right = random_orthogonal(n, draw);
  Eigen::VectorXd stretch(n);
  Eigen::VectorXd scale(n);
  for (int i = 0; i < n; ++i) {
    stretch[i] = draw.between(1.0, 3.0);
    scale[i] = std::pow(10.0, draw.between(-6.0, 6.0));
  }
  const Eigen::MatrixXd t = scale.asDiagonal() * left * stretch.asDiagonal() * right;
  const Eigen::MatrixXd inverse = right.transpose() * stretch.cwiseInverse().asDiagonal() *
                                  left.transpose() * scale.cwiseInverse().asDiagonal();
  ReducedModel result = model;
  result.A = t * model.A * inverse;
  result.B = t * model.B;
  result.C_volume = model.C_volume * inverse;
  result.C_peak = inverse.transpose() * model.C_peak;
  result.A_d = t * model.A_d * inverse;
  result.B_d = t * model.B_d;
  return result;
}

}  // namespace photocoag::testing
