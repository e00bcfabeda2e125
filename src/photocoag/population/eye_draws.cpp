#include "photocoag/population/eye_draws.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "photocoag/core/error.hpp"
#include "photocoag/core/random.hpp"

namespace photocoag {
namespace {

// Streams of the random numbers of campaigns; core/random.hpp has those below 1000.
constexpr std::uint32_t kFirstInputStream = 1000;
constexpr std::uint32_t kSeedStream = 999;
constexpr std::uint32_t kMostAttempts = 10'000;

double value_of(const RandomQuantity& input, double normal) {
  switch (input.distribution) {
    case Distribution::kNormal:
      return input.center + input.spread * normal;
    case Distribution::kLogNormal:
      return input.center * std::exp(input.spread * normal);
    case Distribution::kUniform:
      break;
  }
  const double probability = 0.5 * std::erfc(-normal / std::numbers::sqrt2);
  return input.low + (input.high - input.low) * probability;
}

}  // namespace

std::vector<double> draw_inputs(const EyeDraws& draws, std::uint64_t eye) {
  const std::size_t size = draws.inputs.size();
  Eigen::VectorXd normal(static_cast<Eigen::Index>(size));
  std::vector<double> values(size);
  // Rejection sampling: redraw all inputs, which gives the joint distribution truncated to the
  // bounds.
  for (std::uint32_t attempt = 0; attempt < kMostAttempts; ++attempt) {
    for (std::size_t i = 0; i < size; ++i) {
      const auto stream =
          static_cast<RandomStream>(kFirstInputStream + attempt * static_cast<std::uint32_t>(size) +
                                    static_cast<std::uint32_t>(i));
      normal[static_cast<Eigen::Index>(i)] = standard_normal(draws.seed, eye, stream);
    }
    const Eigen::VectorXd correlated = draws.correlation_root * normal;
    bool inside = true;
    for (std::size_t i = 0; i < size; ++i) {
      values[i] = value_of(draws.inputs[i], correlated[static_cast<Eigen::Index>(i)]);
      inside = inside && values[i] >= draws.inputs[i].low && values[i] <= draws.inputs[i].high;
    }
    if (inside) return values;
  }
  throw Error(ErrorParts{.problem = "the bounds of the inputs are hardly ever met",
                         .accepted = "bounds with some probability between them"});
}

std::uint64_t noise_seed(const EyeDraws& draws, std::uint64_t eye) noexcept {
  return static_cast<std::uint64_t>(
      uniform(draws.seed, eye, static_cast<RandomStream>(kSeedStream)) * 0x1.0p53);
}

InputSetter::InputSetter(const EyeDraws& draws, Config& config) {
  for (const RandomQuantity& input : draws.inputs) {
    if (input.key == kCalibrationFactor) {
      targets_.push_back({&factor_, 1.0});
      continue;
    }
    if (input.key == kCalibrationOffset) {
      targets_.push_back({&offset_, 1.0});
      continue;
    }
    if (input.key == kDelay) {
      targets_.push_back({&delay_, 1.0});
      continue;
    }
    const std::optional<EyeNumber> number = eye_number(config, input.key);
    if (!number) {
      throw Error(ErrorParts{.key = "input.key",
                             .found = input.key,
                             .accepted = "a number of the eye, e.g. plant.absorption_factor, "
                                         "plant.noise_K, plant.tissue.spot_radius_um, "
                                         "plant.tissue.layers.RPE.thickness_um, or "
                                         "calibration_factor, calibration_offset_K, delay_cycles"});
    }
    targets_.push_back(*number);
  }
}

std::optional<int> InputSetter::delay() const noexcept {
  if (!std::isfinite(delay_)) return std::nullopt;
  return std::clamp(static_cast<int>(std::lround(delay_)), 0, 1);
}

void InputSetter::set(const std::vector<double>& values) noexcept {
  for (std::size_t i = 0; i < targets_.size(); ++i) {
    *targets_[i].value = values[i] * targets_[i].scale;
  }
}

}  // namespace photocoag
