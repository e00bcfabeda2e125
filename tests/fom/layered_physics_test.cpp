// Layers, perfusion and beams against balances and closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "fom/dense_operator.hpp"
#include "photocoag/core/random.hpp"
#include "photocoag/fom/layered_stepper.hpp"
#include "photocoag/fom/rational_exponential.hpp"
#include "support/tissues.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::gaussian;
using testing::layered;
using testing::ring_beam;

std::shared_ptr<const FullOrderModel> model_of(const Tissue& tissue, std::size_t cells) {
  return std::make_shared<const FullOrderModel>(tissue, GridSettings{.min_cells = cells});
}

// Heat content, what the blood carries away and what leaves through the boundary, from cell
// temperatures.
TEST(Layered, ImplicitEulerBalancesHeatWithPerfusion) {
  Tissue tissue = ring_beam(layered());
  tissue.domain_radius = 300e-6;
  tissue.layers[3].perfusion = 2e7;
  const auto model = model_of(tissue, 3000);
  const Grid& grid = model->grid();
  const double alpha = 1.1;
  double optical_depth = 0.0;
  for (const Layer& layer : tissue.layers) {
    optical_depth +=
        layer.absorption * layer.thickness * (layer.scaled_by == ScaledBy::kAlpha ? alpha : 1.0);
  }
  LayeredStepper stepper(model, Discretization::kImplicitEuler, 5e-3, alpha);
  double content = 0.0;
  for (int k = 0; k < 40; ++k) {
    const double power = 0.1 * uniform(5, k, RandomStream::kTest);
    stepper.step(power);
    const MatrixXd T = stepper.temperatures();
    const Index nr = T.rows();
    const Index nz = T.cols();
    double now = 0.0;
    double outflow = 0.0;
    double blood = 0.0;
    for (Index j = 0; j < nz; ++j) {
      const Layer& layer = testing::layer_at(tissue, grid.axial.center(j));
      const double conductivity = layer.conductivity.value_or(tissue.conductivity);
      const double capacity = layer.density.value_or(tissue.density) *
                              layer.heat_capacity.value_or(tissue.heat_capacity);
      for (Index i = 0; i < nr; ++i) {
        const double area = std::numbers::pi * (std::pow(grid.radial.faces[i + 1], 2) -
                                                std::pow(grid.radial.faces[i], 2));
        const double volume = area * grid.axial.width(j);
        now += capacity * volume * T(i, j);
        blood += layer.perfusion * volume * T(i, j);
        if (j == 0 || j == nz - 1)
          outflow += conductivity * area * T(i, j) / (0.5 * grid.axial.width(j));
      }
      outflow += conductivity * 2.0 * std::numbers::pi * tissue.domain_radius *
                 grid.axial.width(j) * T(nr - 1, j) / (0.5 * grid.radial.width(nr - 1));
    }
    const double absorbed = -std::expm1(-optical_depth) * power;
    EXPECT_NEAR((now - content) / 5e-3, absorbed - outflow - blood, 1e-11) << k;
    content = now;
    if (k == 39) {
      // Each of the three matters, else the test would not see it.
      EXPECT_GT(outflow, 1e-3);
      EXPECT_GT(blood, 1e-3);
    }
  }
}

// Far from the spot's depth, in a steady state, radial mode 0 falls off as exp(-z sqrt(l +
// perfusion / k)).
TEST(Layered, SteadyPerfusedStateDecaysOnTheRightLength) {
  Tissue tissue;
  tissue.layers = {{"RPE", 10e-6, 1e6, ScaledBy::kAlpha}, {"choroid", 1500e-6, 0.0}};
  tissue.layers[1].conductivity = 0.5;
  tissue.layers[1].perfusion = 2e7;
  tissue.domain_radius = 5e-3;
  const auto model = model_of(tissue, 40000);
  LayeredStepper stepper(model, Discretization::kImplicitEuler, 1e4, 1.0);
  for (int k = 0; k < 4; ++k) stepper.step(1.0);
  const MatrixXd T = stepper.temperatures();
  const double length = 1.0 / std::sqrt(model->radial().rates[0] + 2e7 / 0.5);  // about 158 um
  const VectorXd first =
      (model->radial().root_measure.asDiagonal() * T).transpose() * model->radial().vectors.col(0);
  const Axis& depth = model->grid().axial;
  // From 100 to 700 um; the back boundary is seven lengths away and more.
  Index near = 0;
  Index far = 0;
  for (Index j = 0; j < first.size(); ++j) {
    if (depth.center(j) < 100e-6) near = j;
    if (depth.center(j) < 700e-6) far = j;
  }
  const double slope =
      std::log(first[near] / first[far]) / (depth.center(far) - depth.center(near));
  EXPECT_NEAR(slope * length, 1.0, 2e-3);
}

// Blood that takes the same share everywhere: every impulse response times exp(-perfusion t / C).
TEST(Layered, EvenPerfusionIsAFactor) {
  Tissue tissue;
  tissue.layers[0].conductivity = 0.5;
  tissue.layers[4].conductivity = 0.3;
  Tissue perfused = tissue;
  for (Layer& layer : perfused.layers) layer.perfusion = 1e8;
  constexpr double kFlash = 1e-9;
  constexpr double kTime = 20e-3;
  const auto after_flash = [&](const Tissue& of) {
    LayeredStepper stepper(model_of(of, 3000), Discretization::kZeroOrderHold, kFlash, 1.1, 0.0);
    stepper.step(1e6);
    stepper.set_period(kTime);
    stepper.step(0.0);
    return stepper.outputs();
  };
  const double factor = std::exp(-1e8 / tissue.volumetric_heat_capacity() * kTime);  // 0.617
  // The rational exponential errs by 2.6e-12 of the flash's rise, which is 1e5 times the rise now.
  EXPECT_NEAR(after_flash(perfused).peak / after_flash(tissue).peak / factor, 1.0, 1e-6);
  EXPECT_NEAR(after_flash(perfused).volume / after_flash(tissue).volume / factor, 1.0, 1e-6);
}

// Two slabs behind and before a thin absorber, one perfused: radial mode 0 of the steady state is a
// sinh in each, and what the absorber gets leaves through both.
TEST(Layered, SteadyTwoSlabsAreTheClosedForm) {
  Tissue tissue;
  tissue.layers = {
      {"front", 500e-6, 0.0}, {"RPE", 1e-6, 1e7, ScaledBy::kAlpha}, {"back", 500e-6, 0.0}};
  tissue.layers[0].conductivity = 0.6;
  tissue.layers[2].conductivity = 0.2;
  tissue.layers[2].heat_capacity = 2000.0;
  tissue.layers[2].perfusion = 5e6;
  const auto model = model_of(tissue, 40000);
  LayeredStepper stepper(model, Discretization::kImplicitEuler, 1e4, 2.0);
  for (int k = 0; k < 4; ++k) stepper.step(1.0);
  const VectorXd mode =
      (model->radial().root_measure.asDiagonal() * stepper.temperatures()).transpose() *
      model->radial().vectors.col(0);
  const double radial = model->radial().rates[0];
  const double front = std::sqrt(radial);
  const double back = std::sqrt(radial + 5e6 / 0.2);
  const double conductance =
      0.6 * front / std::tanh(front * 500e-6) + 0.2 * back / std::tanh(back * 500e-6);
  const double rise = model->beam()[0] / conductance;
  const Axis& depth = model->grid().axial;
  for (std::size_t j = 0; j < depth.cells(); ++j) {
    const double z = depth.center(j);
    if (z > 500e-6 && z < 501e-6) continue;
    const double exact = z < 500e-6
                             ? rise * std::sinh(front * z) / std::sinh(front * 500e-6)
                             : rise * std::sinh(back * (1001e-6 - z)) / std::sinh(back * 500e-6);
    // The absorber is 1/500 of a slab, and no point.
    EXPECT_NEAR(mode[static_cast<Index>(j)] / exact, 1.0, 4e-3) << z;
  }
}

// The on-axis rise of an impulse of light in a thin sheet without axial losses: a Gaussian stays
// one, of 1/e2 radius sqrt(w^2 + 8 a t), so the factor is 1 / (1 + 8 a t / w^2) in place of the
// flat top's 1 - exp(-R^2 / (4 a t)).
TEST(Beams, OnAxisImpulseResponsesAreTheClosedForms) {
  for (const bool is_gaussian : {false, true}) {
    const Tissue tissue = is_gaussian ? gaussian(Tissue{}) : Tissue{};
    const FullOrderModel model(tissue, GridSettings{});
    const double w = tissue.spot_radius;
    const double area = std::numbers::pi * w * w * (is_gaussian ? 0.5 : 1.0);
    for (const double time : {0.3e-3, 1e-3, 4e-3, 20e-3, 100e-3}) {
      const double rise = model.peak_radial()
                              .cwiseProduct(model.beam())
                              .dot((-model.radial().rates * time).array().exp().matrix());
      const double at = tissue.diffusivity() * time;
      const double factor =
          is_gaussian ? 1.0 / (1.0 + 8.0 * at / (w * w)) : -std::expm1(-w * w / (4.0 * at));
      EXPECT_NEAR(rise * area / factor, 1.0, 5e-4) << time;
    }
  }
}

TEST(Beams, AreNormalizedOnEveryGrid) {
  for (const Tissue& tissue : {Tissue{}, gaussian(Tissue{}), ring_beam(Tissue{})}) {
    const FullOrderModel model(tissue, GridSettings{.min_cells = 5000});
    const VectorXd share =
        (model.radial().vectors * model.beam()).cwiseProduct(model.radial().root_measure);
    EXPECT_NEAR(share.sum(), 1.0, 1e-12);
    EXPECT_GT(share.minCoeff(), -1e-12);
    for (Index i = 0; tissue.beam != BeamProfile::kFlatTop && i < share.size(); ++i) {
      const std::vector<double>& faces = model.grid().radial.faces;
      EXPECT_NEAR(share[i], testing::beam_share(tissue, faces[i], faces[i + 1]), 1e-11) << i;
    }
  }
}

TEST(RationalExponential, IsTheExponentialOnTheNegativeAxis) {
  const auto r = [](double x) {
    double sum = RationalExponential::kAtInfinity;
    for (int k = 0; k < RationalExponential::kPairs; ++k) {
      sum +=
          2.0 * (RationalExponential::kResidues[k] / (x - RationalExponential::kPoles[k])).real();
    }
    return sum;
  };
  EXPECT_NEAR(r(0.0), 1.0, 1e-13);
  double worst = 0.0;
  for (double x = -1e-6; x > -1e8; x *= 1.003)
    worst = std::max(worst, std::abs(r(x) - std::exp(x)));
  EXPECT_LT(worst, 2.7e-12);
  EXPECT_GT(worst, 1e-12);  // the best possible is 2.4e-12
}

}  // namespace
}  // namespace photocoag
