#include "photocoag/run/tissue_margin.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <memory>
#include <mutex>
#include <numeric>
#include <optional>
#include <thread>

#include "photocoag/core/error.hpp"
#include "photocoag/loop/controller.hpp"
#include "photocoag/run/declared_eye.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kCells = 8000;
constexpr std::size_t kMaxPeriods = 1000;
constexpr std::size_t kEnumerated = 7;  // quantities of which all combinations are tried
constexpr int kAlphas = 10;
constexpr double kLowDeviations = 1.6;
constexpr double kHighDeviations = 3.1;
constexpr double kSmallestShare = 0.5;
constexpr int kMaxRounds = 24;
constexpr double kNear = 0.97;             // of the highest peak: an eye that may become the worst
constexpr std::size_t kNoisyEyes = 12;     // per stretch of time at most
constexpr std::uint64_t kNoiseSeeds = 40;  // per such eye
constexpr std::uint64_t kFirstSeed = 1u << 30;  // noise that no treatment draws

using Signs = std::vector<int>;

struct Eye {
  std::size_t corner;
  double alpha;
};

// Stretches of time since the start: [first[b], first[b + 1]) in periods from 0 on, each some
// quarter longer than the one before.
std::vector<std::size_t> stretches(std::size_t periods) {
  std::vector<std::size_t> first;
  for (std::size_t k = 0; k < periods; k += 1 + k / 4) first.push_back(k);
  first.push_back(periods);
  return first;
}

void for_each_in_parallel(std::size_t count, const auto& task) {
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex mutex;
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < count; i = next++) task(i);
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
      next = count;
    }
  };
  std::vector<std::thread> others;
  for (unsigned n = 1; n < std::max(1U, std::thread::hardware_concurrency()); ++n) {
    others.emplace_back(work);
  }
  work();
  for (std::thread& other : others) other.join();
  if (failure) std::rethrow_exception(failure);
}

/// The search: corners, alphas, stretches and the highest peaks in them.
class Search {
 public:
  Search(const Config& config, const ReducedModel& model)
      : config_(config),
        model_(model),
        quantities_(declared_quantities(config)),
        periods_(std::min(config.cycles(), kMaxPeriods)),
        first_(stretches(periods_)),
        shares_(first_.size() - 1, 1.0) {
    // What a controller refuses is refused here, not in a thread.
    static_cast<void>(Controller(model, config.control, config.estimator));
    set_corners();
    const EstimatorSettings& e = config.estimator;
    const double low = std::max(e.absorption_min,
                                e.absorption_initial - kLowDeviations * e.absorption_sigma_initial);
    const double high = std::min(
        e.absorption_max, e.absorption_initial + kHighDeviations * e.absorption_sigma_initial);
    for (std::size_t corner = 0; corner < corners_.size(); ++corner) {
      for (int a = 0; a < kAlphas; ++a) {
        all_.push_back({corner, low + (high - low) * a / (kAlphas - 1.0)});
      }
    }
  }

  TissueMargin run() {
    const double limit = config_.control.peak_max;
    TissueMargin margin;
    margin.eyes = all_.size();
    treat(all_);
    margin.peak_unprotected = *std::max_element(highest_.begin(), highest_.end());
    margin.worst = describe_worst();
    for (int round = 0; above(limit); ++round) {
      if (round == kMaxRounds) refuse();
      lower(limit, round);
      treat(near_);
      // The worst eye of the backed-off loop may be another one.
      if (!above(limit)) treat(all_);
    }
    margin.peak_protected = *std::max_element(highest_.begin(), highest_.end());
    for (int round = 0; round < kMaxRounds; ++round) {
      treat_with_noise();
      margin.peak_protected =
          std::max(margin.peak_protected, *std::max_element(highest_.begin(), highest_.end()));
      if (!above(limit)) break;
      lower(limit, round);
      margin.peak_protected = limit;
    }
    margin.factor = *std::max_element(shares_.begin(), shares_.end());
    const bool level = *std::min_element(shares_.begin(), shares_.end()) == margin.factor;
    for (std::size_t b = 0; !level && b < shares_.size(); ++b) {
      margin.shares.resize(first_[b + 1], shares_[b] / margin.factor);
    }
    return margin;
  }

 private:
  struct Outcome {
    std::vector<double> highest;  // K, per stretch
    std::vector<std::size_t> when;
  };

  std::unique_ptr<const DeclaredEye> eye(const Signs& signs) const {
    return std::make_unique<const DeclaredEye>(
        config_, declared_tissue(config_, quantities_, signs), kCells, periods_);
  }

  // All combinations of the quantities that matter most; of the others the signs that raise the
  // peak by themselves, once those of the first periods and once those of the last.
  void set_corners() {
    const std::size_t count = quantities_.size();
    std::vector<Signs> rest(1, Signs(count, 0));
    std::vector<std::size_t> order(count);
    std::iota(order.begin(), order.end(), std::size_t{0});
    if (count > kEnumerated) rest = rank(order);
    const std::size_t enumerated = std::min(count, kEnumerated);
    for (const Signs& base : rest) {
      for (std::size_t bits = 0; bits < (std::size_t{1} << enumerated); ++bits) {
        Signs signs = base;
        for (std::size_t i = 0; i < enumerated; ++i) signs[order[i]] = (bits >> i & 1) ? 1 : -1;
        corners_.push_back(std::move(signs));
      }
    }
    if (quantities_.empty()) corners_ = {{}};
    eyes_.resize(corners_.size());
    for_each_in_parallel(corners_.size(), [&](std::size_t i) { eyes_[i] = eye(corners_[i]); });
  }

  std::vector<Signs> rank(std::vector<std::size_t>& order) const {
    const std::size_t count = quantities_.size();
    const EstimatorSettings& e = config_.estimator;
    std::vector<double> effect(count, 0.0);
    std::vector<Signs> rest(2, Signs(count, 1));
    for_each_in_parallel(count, [&](std::size_t i) {
      for (const double alpha :
           {e.absorption_initial,
            e.absorption_initial + kHighDeviations * e.absorption_sigma_initial}) {
        std::vector<Eigen::VectorXd> peaks;
        for (const int sign : {-1, 1}) {
          Signs signs(count, 0);
          signs[i] = sign;
          peaks.push_back(eye(signs)->treat(config_, model_, alpha, {}).peak);
        }
        const Eigen::VectorXd change = peaks[1] - peaks[0];
        effect[i] = std::max(effect[i], change.cwiseAbs().maxCoeff());
        rest[0][i] = change[0] > 0.0 ? 1 : -1;
        rest[1][i] = change[change.size() - 1] > 0.0 ? 1 : -1;
      }
    });
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t i, std::size_t j) { return effect[i] > effect[j]; });
    return rest;
  }

  Outcome outcome(const LoopPeaks& loop, double sigmas) const {
    Outcome result{std::vector<double>(shares_.size(), 0.0),
                   std::vector<std::size_t>(shares_.size())};
    for (std::size_t b = 0; b < shares_.size(); ++b) {
      for (std::size_t n = first_[b]; n < first_[b + 1]; ++n) {
        const auto k = static_cast<Eigen::Index>(n);
        const double peak = loop.peak[k] + sigmas * loop.sigma[k];
        if (peak <= result.highest[b]) continue;
        result.highest[b] = peak;
        result.when[b] = n;
      }
    }
    return result;
  }

  Config told() const {
    Config told = config_;
    for (std::size_t b = 0; b < shares_.size(); ++b) {
      told.control.shares.resize(first_[b + 1], shares_[b]);
    }
    return told;
  }

  // Fills highest_ and, of these eyes, those that come near it somewhere.
  void treat(const std::vector<Eye>& which) {
    const Config config = told();
    const std::vector<Eye> eyes = which;
    std::vector<Outcome> outcomes(eyes.size());
    for_each_in_parallel(eyes.size(), [&](std::size_t i) {
      outcomes[i] = outcome(eyes_[eyes[i].corner]->treat(config, model_, eyes[i].alpha, {}),
                            config_.control.robust_sigma);
    });
    highest_.assign(shares_.size(), 0.0);
    worst_ = Eye{0, 0.0};
    double worst = 0.0;
    for (std::size_t i = 0; i < eyes.size(); ++i) {
      for (std::size_t b = 0; b < shares_.size(); ++b) {
        highest_[b] = std::max(highest_[b], outcomes[i].highest[b]);
        if (outcomes[i].highest[b] <= worst) continue;
        worst = outcomes[i].highest[b];
        worst_ = eyes[i];
        worst_period_ = outcomes[i].when[b];
      }
    }
    std::vector<Eye> near;
    std::vector<double> nearness;
    for (std::size_t i = 0; i < eyes.size(); ++i) {
      double nearest = 0.0;
      for (std::size_t b = 0; b < shares_.size(); ++b) {
        if (highest_[b] < kNear * config_.control.peak_max) continue;
        nearest = std::max(nearest, outcomes[i].highest[b] / highest_[b]);
      }
      if (nearest < kNear) continue;
      near.push_back(eyes[i]);
    }
    if (eyes.size() == all_.size()) remember_closest(eyes, outcomes);
    near_ = std::move(near);
  }

  // Per stretch the eyes with the highest peaks: they are treated with noise.
  void remember_closest(const std::vector<Eye>& eyes, const std::vector<Outcome>& outcomes) {
    std::vector<bool> chosen(eyes.size(), false);
    for (std::size_t b = 0; b < shares_.size(); ++b) {
      if (highest_[b] < kNear * config_.control.peak_max) continue;
      std::vector<std::size_t> order(eyes.size());
      std::iota(order.begin(), order.end(), std::size_t{0});
      std::stable_sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) {
        return outcomes[i].highest[b] > outcomes[j].highest[b];
      });
      const std::size_t most = std::max<std::size_t>(2, kNoisyEyes / (1 + b));
      for (std::size_t i = 0; i < std::min(order.size(), most); ++i) chosen[order[i]] = true;
    }
    noisy_.clear();
    for (std::size_t i = 0; i < eyes.size(); ++i) {
      if (chosen[i]) noisy_.push_back(eyes[i]);
    }
  }

  void treat_with_noise() {
    const Config config = told();
    std::vector<Outcome> outcomes(noisy_.size());
    for_each_in_parallel(noisy_.size(), [&](std::size_t i) {
      outcomes[i] = {std::vector<double>(shares_.size(), 0.0), {}};
      for (std::uint64_t seed = 0; seed < kNoiseSeeds; ++seed) {
        const Outcome one = outcome(
            eyes_[noisy_[i].corner]->treat(config, model_, noisy_[i].alpha, kFirstSeed + seed),
            0.0);
        for (std::size_t b = 0; b < shares_.size(); ++b) {
          outcomes[i].highest[b] = std::max(outcomes[i].highest[b], one.highest[b]);
        }
      }
    });
    highest_.assign(shares_.size(), 0.0);
    for (const Outcome& one : outcomes) {
      for (std::size_t b = 0; b < shares_.size(); ++b) {
        highest_[b] = std::max(highest_[b], one.highest[b]);
      }
    }
  }

  bool above(double limit) const {
    return std::any_of(highest_.begin(), highest_.end(), [&](double peak) { return peak > limit; });
  }

  // The peak falls nearly in proportion. Where it does not (a penalty keeps the power up), the
  // stretches before have to give way too.
  void lower(double limit, int round) {
    constexpr int kPatience = 4;
    for (std::size_t b = 0; b < shares_.size(); ++b) {
      if (highest_[b] <= limit) continue;
      const double ratio = 0.999 * limit / highest_[b];
      shares_[b] *= ratio;
      for (std::size_t before = 0; round >= kPatience && before < b; ++before) {
        shares_[before] = std::min(shares_[before], std::max(ratio * shares_[before], shares_[b]));
      }
      if (shares_[b] < kSmallestShare) refuse();
    }
  }

  std::string describe_worst() const {
    std::string text;
    for (std::size_t i = 0; i < quantities_.size(); ++i) {
      text += fmt::format("{} {:+g} %, ", quantities_[i].name,
                          100.0 * corners_[worst_.corner][i] * quantities_[i].relative);
    }
    return text + fmt::format("alpha {:.3g}, after {:g} ms", worst_.alpha,
                              1e3 * config_.control.period * double(worst_period_ + 1));
  }

  [[noreturn]] void refuse() const {
    throw Error(ErrorParts{
        .key = "uncertainty",
        .problem = "no reference from half of control.peak_reference_K on keeps the limit",
        .found = fmt::format("a highest peak of {:.2f} K for {}",
                             *std::max_element(highest_.begin(), highest_.end()), describe_worst()),
        .accepted = "smaller uncertainties, control.robust = \"certified\", or a shorter period"});
  }

  const Config& config_;
  const ReducedModel& model_;
  std::vector<DeclaredQuantity> quantities_;
  std::size_t periods_;
  std::vector<std::size_t> first_;
  std::vector<double> shares_;  // per stretch
  std::vector<Signs> corners_;
  std::vector<std::unique_ptr<const DeclaredEye>> eyes_;
  std::vector<Eye> all_;
  std::vector<Eye> near_;
  std::vector<Eye> noisy_;
  std::vector<double> highest_;  // K, per stretch
  Eye worst_{0, 0.0};
  std::size_t worst_period_ = 0;
};

}  // namespace

bool wants_margin(const Config& config) noexcept {
  return config.uncertainty.declared() || config.control.robust == Robustness::kCertified;
}

Config backed_off(const Config& config, const TissueMargin& margin) {
  Config result = config;
  result.control.peak_reference *= margin.factor;
  result.control.peak_max *= margin.factor;
  for (double& value : result.control.reference_values) value *= margin.factor;
  result.control.shares = margin.shares;
  return result;
}

TissueMargin tissue_margin(const Config& config, const ReducedModel& model) {
  return Search(config, model).run();
}

Config told_to_controller(const Config& config, const ReducedModel& model) {
  return wants_margin(config) ? backed_off(config, tissue_margin(config, model)) : config;
}

}  // namespace photocoag
