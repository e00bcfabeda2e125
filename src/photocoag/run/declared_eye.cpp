#include "photocoag/run/declared_eye.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "photocoag/core/random.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/loop/controller.hpp"
#include "photocoag/loop/simulated_eye.hpp"

namespace photocoag {
namespace {

// Peak and volume at the end of a period, K per W in one period before; the latest period last.
struct Response {
  Eigen::VectorXd peak;
  Eigen::VectorXd volume;
};

// The eye with this response and its own noise. A Plant (loop/plant.hpp).
class RespondingEye {
 public:
  RespondingEye(const Response& response, Eigen::Ref<const Eigen::VectorXd> noise)
      : response_(response), noise_(noise), powers_(noise.size()) {}
  void step(double power) noexcept {
    powers_[done_++] = power;
    const auto powers = powers_.head(done_);
    outputs_ = {.volume = response_.volume.tail(done_).dot(powers),
                .peak = response_.peak.tail(done_).dot(powers)};
  }
  Outputs outputs() const noexcept { return outputs_; }
  double sample() const noexcept { return outputs_.volume + noise_[done_ - 1]; }

 private:
  const Response& response_;
  Eigen::Ref<const Eigen::VectorXd> noise_;
  Eigen::VectorXd powers_;
  Eigen::Index done_ = 0;
  Outputs outputs_;
};

}  // namespace

void DeclaredQuantity::scale(Tissue& tissue, double factor) const {
  switch (part) {
    case Part::kSpotRadius:
      tissue.spot_radius *= factor;
      for (double& beam : tissue.beam_radii) beam *= factor;
      break;
    case Part::kThickness:
      tissue.layers[layer].thickness *= factor;
      break;
    case Part::kAbsorption:
      tissue.layers[layer].absorption *= factor;
      break;
    case Part::kChoroid:
      for (Layer& one : tissue.layers) {
        if (one.scaled_by == ScaledBy::kBeta) one.absorption *= factor;
      }
      break;
  }
}

std::vector<DeclaredQuantity> tissue_quantities(const UncertaintySettings& u,
                                                const Tissue& tissue) {
  using Part = DeclaredQuantity::Part;
  std::vector<DeclaredQuantity> all;
  const auto add = [&all](std::string name, double most, Part part, std::size_t layer, bool moves) {
    all.push_back({std::move(name), most, most, part, layer, moves && most > 0.0});
  };
  add("spot radius", u.spot_radius, Part::kSpotRadius, 0, true);
  for (std::size_t i = 0; i < tissue.layers.size(); ++i) {
    const Layer& layer = tissue.layers[i];
    add(layer.name + " thickness", u.thickness, Part::kThickness, i, true);
    if (layer.scaled_by == ScaledBy::kAlpha) continue;
    add(layer.name + " absorption", u.absorption, Part::kAbsorption, i, layer.absorption > 0.0);
  }
  return all;
}

std::vector<DeclaredQuantity> declared_quantities(const Config& config) {
  using Part = DeclaredQuantity::Part;
  std::vector<DeclaredQuantity> all = tissue_quantities(config.uncertainty, config.tissue);
  std::erase_if(all, [](const DeclaredQuantity& q) { return !q.declared; });
  const EstimatorSettings& e = config.estimator;
  if (e.unknowns == Unknowns::kRpeAndChoroid) {
    const auto relative = [&e](double deviations) {
      const double at = e.choroid_initial + deviations * e.choroid_sigma_initial;
      return std::clamp(at, e.choroid_min, e.choroid_max) / e.choroid_initial - 1.0;
    };
    all.push_back({"choroid factor", -relative(-1.6), relative(3.1), Part::kChoroid});
  }
  return all;
}

Tissue declared_tissue(const Config& config, const std::vector<DeclaredQuantity>& quantities,
                       const std::vector<int>& signs) {
  Tissue tissue = config.tissue;
  for (std::size_t i = 0; i < quantities.size(); ++i) {
    quantities[i].scale(tissue, 1.0 + quantities[i].change(signs[i]));
  }
  return tissue;
}

Eigen::MatrixXd balanced_noise(Eigen::Index periods, Eigen::Index count) {
  constexpr std::uint64_t kSeed = 1u << 30;  // used by no treatment
  const Eigen::Index block = count - 1;
  // Columns are periods here. Gram-Schmidt within the block, against the constant first.
  Eigen::MatrixXd noise(count, periods);
  for (Eigen::Index n = 0; n < periods; ++n) {
    auto values = noise.col(n);
    for (Eigen::Index i = 0; i < count; ++i) {
      values[i] = standard_normal(kSeed + static_cast<std::uint64_t>(i),
                                  static_cast<std::uint64_t>(n), RandomStream::kStudy);
    }
    values.array() -= values.mean();
    for (Eigen::Index before = n - n % block; before < n; ++before) {
      values -= noise.col(before).dot(values) / static_cast<double>(count) * noise.col(before);
    }
    values *= std::sqrt(static_cast<double>(count)) / values.norm();
  }
  return noise.transpose();
}

DeclaredEye::DeclaredEye(const Config& config, const Tissue& tissue, std::size_t cells,
                         std::size_t periods)
    : config_(config),
      full_(std::make_shared<const FullOrderModel>(tissue, GridSettings{.min_cells = cells})),
      periods_(static_cast<Eigen::Index>(periods)) {
  if (!full_->separable()) return;
  ModalStepper stepper(full_, config.plant.discretization, config.control.period);
  axis_.resize(periods_, stepper.axis_profile().size());
  spot_.resize(periods_, stepper.spot_profile().size());
  for (Eigen::Index k = 0; k < periods_; ++k) {
    stepper.step(k == 0 ? 1.0 : 0.0);
    axis_.row(periods_ - 1 - k) = stepper.axis_profile();
    spot_.row(periods_ - 1 - k) = stepper.spot_profile();
  }
}

Eigen::MatrixXd DeclaredEye::treat(const Config& config, const ReducedModel& model, double alpha,
                                   const Eigen::MatrixXd& noise) const {
  const AbsorptionFactors at(alpha, config_.estimator.choroid_initial);
  const Eigen::Index periods = noise.rows();
  Response response;
  if (full_->separable()) {
    const OutputWeights weights = full_->output_weights(at);
    response = {axis_.bottomRows(periods) * weights.peak,
                spot_.bottomRows(periods) * weights.volume};
  } else {
    FullOrderPlant plant(full_, config_.plant.discretization, config_.control.period, at);
    response = {Eigen::VectorXd(periods), Eigen::VectorXd(periods)};
    for (Eigen::Index k = periods; k-- > 0;) {
      plant.step(k == periods - 1 ? 1.0 : 0.0);
      const Outputs outputs = plant.outputs();
      response.peak[k] = outputs.peak;
      response.volume[k] = outputs.volume;
    }
  }
  const Controller cold(model, config.control, config.estimator);
  const bool silent = config_.plant.zero_power_sample == ZeroPowerSample::kMissing;
  Eigen::MatrixXd peaks(periods, noise.cols());
  for (Eigen::Index i = 0; i < noise.cols(); ++i) {
    Controller controller = cold;
    SimulatedEye eye(RespondingEye(response, noise.col(i)), 0.0, 0,
                     {.delay = config.control.delay, .dark_is_silent = silent});
    for (Eigen::Index n = 0; n < periods; ++n) {
      eye.write(controller.decide().power);
      const Reading reading = eye.advance(static_cast<std::uint64_t>(n));
      peaks(n, i) = reading.truth.peak;
      controller.observe(reading.sample);
    }
  }
  return peaks;
}

}  // namespace photocoag
