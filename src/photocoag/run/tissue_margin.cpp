#include "photocoag/run/tissue_margin.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <set>
#include <utility>

#include "photocoag/core/error.hpp"
#include "photocoag/core/parallel.hpp"
#include "photocoag/loop/controller.hpp"
#include "photocoag/run/declared_corners.hpp"
#include "photocoag/run/declared_eye.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kCells = 8000;
constexpr std::size_t kMaxPeriods = 1000;
constexpr int kAlphas = 28;
constexpr int kCoarse = 3;  // the whole set is searched at every third alpha
constexpr double kLowDeviations = 1.6;
constexpr double kHighDeviations = 3.1;
constexpr double kSmallestShare = 0.5;
constexpr int kMaxRounds = 24;
constexpr double kNear = 0.98;   // of the highest peak: an eye that may become the worst
constexpr double kSlack = 0.02;  // of the limit: most that one treatment predicts of the next

using Signs = std::vector<int>;

// Treatments of an eye: noise in K, a row per period and a column per treatment. Each matrix
// continues where the previous, shorter one ends.
using Noise = std::vector<Eigen::MatrixXd>;

struct Eye {
  std::size_t corner;
  int alpha;  // of the grid
  bool operator<(const Eye& other) const {
    return std::pair(corner, alpha) < std::pair(other.corner, other.alpha);
  }
};

// Prediction for an eye in a time interval, from a treatment with another share or less noise.
struct Known {
  double peak = std::numeric_limits<double>::infinity();  // K, over the share then
  double slack = 0.0;                                     // K, possible excess over it
};

// Mean plus `sigmas` deviations of the peak over the noise (the columns), period by period.
Eigen::VectorXd highest(const Eigen::MatrixXd& peaks, double sigmas) {
  const Eigen::VectorXd mean = peaks.rowwise().mean();
  return mean.array() + sigmas * (peaks.colwise() - mean).rowwise().squaredNorm().array().sqrt() /
                            std::sqrt(static_cast<double>(peaks.cols()));
}

// Time intervals since the start: [first[b], first[b + 1]) in periods from 0 on, each about a
// quarter longer than the one before.
std::vector<std::size_t> intervals(std::size_t periods) {
  std::vector<std::size_t> first;
  for (std::size_t k = 0; k < periods; k += 1 + k / 4) first.push_back(k);
  first.push_back(periods);
  return first;
}

/// The search: corners, alphas, intervals and the highest peaks in them.
class Search {
 public:
  Search(const Config& config, const ReducedModel& model)
      : config_(config),
        model_(model),
        limit_(config.control.peak_max),
        quantities_(declared_quantities(config)),
        periods_(std::min(config.cycles(), kMaxPeriods)),
        first_(intervals(periods_)),
        shares_(first_.size() - 1, 1.0) {
    // Settings that a controller refuses are refused here, not in a thread.
    static_cast<void>(Controller(model, config.control, config.estimator));
    const auto periods = static_cast<Eigen::Index>(periods_);
    const double kelvin = std::max(config.plant.noise, config.estimator.measurement_noise);
    noise_slack_ = config.control.robust_sigma * kelvin;
    const auto noise = [&](Eigen::Index longest, Eigen::Index count) -> Eigen::MatrixXd {
      return kelvin * balanced_noise(std::min(longest, periods), count);
    };
    none_ = Eigen::MatrixXd::Zero(periods, 1);
    early_ = {noise(15, 16), none_};
    survey_ = {noise(15, 16), noise(periods, 6)};
    closely_ = {noise(31, 32), noise(periods, 12)};
    std::vector<double> alphas;
    for (const int a : {0, kAlphas / 3, 2 * kAlphas / 3, kAlphas - 1}) {
      alphas.push_back(alpha_of(a));
    }
    corners_ = declared_corners(config, model, quantities_, alphas, kCells, periods_);
    eyes_.resize(corners_.size());
    for_each_in_parallel(corners_.size(), [&](std::size_t i) {
      eyes_[i] = std::make_unique<const DeclaredEye>(
          config, declared_tissue(config, quantities_, corners_[i]), kCells, periods_);
    });
    for (std::size_t corner = 0; corner < corners_.size(); ++corner) {
      for (int a = 0; a < kAlphas; a += kCoarse) all_.push_back({corner, a});
    }
    known_.assign(corners_.size() * kAlphas, std::vector<Known>(shares_.size()));
  }

  TissueMargin run() {
    TissueMargin margin;
    margin.eyes = all_.size();
    treat(all_, {none_}, 0.0);
    treat(all_, survey_, kNear * top());
    margin.peak_unprotected = top();
    margin.worst = describe_worst();
    treat(all_, early_, limit_);
    settle(early_);
    survey();
    // Noise and backing off change which eye is worst: repeat until no new eye comes near.
    std::vector<Eye> near;
    for (auto fresh = add_near(near); !fresh.empty(); fresh = add_near(near)) {
      treat(fresh, closely_, std::min(limit_, predicted(fresh)));
      if (top() > limit_) {
        if (fresh.size() < near.size()) treat(near, closely_, limit_);
        settle(closely_);
      }
      margin.peak_protected = std::max(margin.peak_protected, top());
      survey();
    }
    if (near.empty()) margin.peak_protected = top();
    margin.factor = *std::max_element(shares_.begin(), shares_.end());
    const bool level = *std::min_element(shares_.begin(), shares_.end()) == margin.factor;
    for (std::size_t b = 0; !level && b < shares_.size(); ++b) {
      margin.shares.resize(first_[b + 1], shares_[b] / margin.factor);
    }
    return margin;
  }

 private:
  double alpha_of(int a) const {
    const EstimatorSettings& e = config_.estimator;
    const double low = std::max(e.absorption_min,
                                e.absorption_initial - kLowDeviations * e.absorption_sigma_initial);
    const double high = std::min(
        e.absorption_max, e.absorption_initial + kHighDeviations * e.absorption_sigma_initial);
    return low + (high - low) * a / (kAlphas - 1.0);
  }

  Config with_shares() const {
    Config config = config_;
    for (std::size_t b = 0; b < shares_.size(); ++b) {
      config.control.shares.resize(first_[b + 1], shares_[b]);
    }
    return config;
  }

  std::vector<Known>& known(Eye eye) {
    return known_[eye.corner * kAlphas + static_cast<std::size_t>(eye.alpha)];
  }

  const std::vector<Known>& known(Eye eye) const {
    return known_[eye.corner * kAlphas + static_cast<std::size_t>(eye.alpha)];
  }

  // How many periods of this eye have to be treated: to the end of the last stretch in which it may
  // reach `floor`, K.
  std::size_t needed(Eye eye, double floor) const {
    const std::vector<Known>& of = known(eye);
    for (std::size_t b = shares_.size(); b-- > 0;) {
      if (of[b].peak * shares_[b] + of[b].slack >= floor) return first_[b + 1];
    }
    return 0;
  }

  // Highest predicted peak of these eyes, K.
  double predicted(const std::vector<Eye>& eyes) const {
    double most = 0.0;
    for (const Eye& eye : eyes) {
      for (std::size_t b = 0; b < shares_.size(); ++b) {
        most = std::max(most,
                        known_[eye.corner * kAlphas + static_cast<std::size_t>(eye.alpha)][b].peak *
                            shares_[b]);
      }
    }
    return most;
  }

  // Period by period, 0 beyond `periods`.
  Eigen::VectorXd highest_of(const Config& config, Eye eye, const Noise& noise,
                             std::size_t periods) const {
    Eigen::VectorXd peak = Eigen::VectorXd::Zero(none_.rows());
    Eigen::Index done = 0;
    for (const Eigen::MatrixXd& one : noise) {
      const Eigen::Index rows = std::min(one.rows(), static_cast<Eigen::Index>(periods));
      if (rows <= done) break;
      const Eigen::VectorXd part =
          highest(eyes_[eye.corner]->treat(config, model_, alpha_of(eye.alpha), one.topRows(rows)),
                  config_.control.robust_sigma);
      peak.segment(done, rows - done) = part.tail(rows - done);
      done = rows;
    }
    return peak;
  }

  // Fills highest_, of each eye and of all, and which is the worst; 0 in intervals after the last
  // one in which an eye may reach `floor`, K.
  void treat(const std::vector<Eye>& eyes, const Noise& noise, double floor) {
    const Config config = with_shares();
    treated_ = eyes;
    of_eye_.assign(eyes.size(), std::vector<double>(shares_.size(), 0.0));
    std::vector<std::size_t> when(eyes.size());
    for_each_in_parallel(eyes.size(), [&](std::size_t i) {
      const std::size_t periods = needed(eyes[i], floor);
      const Eigen::VectorXd peak = highest_of(config, eyes[i], noise, periods);
      for (std::size_t b = 0; first_[b] < periods; ++b) {
        of_eye_[i][b] = peak.segment(static_cast<Eigen::Index>(first_[b]),
                                     static_cast<Eigen::Index>(first_[b + 1] - first_[b]))
                            .maxCoeff();
        const bool noisy = noise.back().cols() > 1 ||
                           first_[b + 1] <= static_cast<std::size_t>(noise.front().rows());
        known(eyes[i])[b] = {of_eye_[i][b] / shares_[b],
                             noisy && noise.front().cols() > 1 ? kSlack * limit_ : noise_slack_};
      }
      Eigen::Index at = 0;
      peak.maxCoeff(&at);
      when[i] = static_cast<std::size_t>(at);
    });
    highest_.assign(shares_.size(), 0.0);
    double worst = 0.0;
    for (std::size_t i = 0; i < eyes.size(); ++i) {
      for (std::size_t b = 0; b < shares_.size(); ++b) {
        highest_[b] = std::max(highest_[b], of_eye_[i][b]);
      }
      const double peak = *std::max_element(of_eye_[i].begin(), of_eye_[i].end());
      if (peak <= worst) continue;
      worst = peak;
      worst_ = eyes[i];
      worst_period_ = when[i];
    }
  }

  void survey() { treat(all_, survey_, kNear * std::min(limit_, predicted(all_))); }

  // Lowers the shares until none of the eyes treated last is above the limit.
  void settle(const Noise& noise) {
    for (int round = 0; top() > limit_; ++round) {
      if (round == kMaxRounds) refuse();
      lower(round);
      treat(std::vector<Eye>(treated_), noise, limit_);
    }
  }

  // Adds to `near` those that came near the limit in the last treat(), with their neighbours in
  // alpha, and returns what is new.
  std::vector<Eye> add_near(std::vector<Eye>& near) {
    std::set<Eye> fresh;
    for (std::size_t i = 0; i < treated_.size(); ++i) {
      bool comes_near = false;
      for (std::size_t b = 0; b < shares_.size(); ++b) {
        comes_near = comes_near || of_eye_[i][b] > kNear * std::max(limit_, highest_[b]);
      }
      for (int a = treated_[i].alpha - 1; comes_near && a <= treated_[i].alpha + 1; ++a) {
        if (a >= 0 && a < kAlphas) fresh.insert({treated_[i].corner, a});
      }
    }
    for (const Eye& old : near) fresh.erase(old);
    for (const Eye& eye : fresh) predict(eye);
    near.insert(near.end(), fresh.begin(), fresh.end());
    return {fresh.begin(), fresh.end()};
  }

  // Between two alphas of the coarse grid: the prediction from either.
  void predict(Eye eye) {
    const int below = eye.alpha - eye.alpha % kCoarse;
    if (below == eye.alpha) return;
    const std::vector<Known>& low = known({eye.corner, below});
    const std::vector<Known>& high = known({eye.corner, below + kCoarse});
    for (std::size_t b = 0; b < shares_.size(); ++b) {
      known(eye)[b] = {std::max(low[b].peak, high[b].peak), std::max(low[b].slack, high[b].slack)};
    }
  }

  double top() const { return *std::max_element(highest_.begin(), highest_.end()); }

  // The peak falls nearly in proportion. Where it does not (a penalty keeps the power up), the
  // intervals before have to give way too.
  void lower(int round) {
    constexpr int kPatience = 4;
    for (std::size_t b = 0; b < shares_.size(); ++b) {
      if (highest_[b] <= limit_) continue;
      const double ratio = 0.998 * limit_ / highest_[b];
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
                          100.0 * quantities_[i].change(corners_[worst_.corner][i]));
    }
    return text + fmt::format("alpha {:.3g}, after {:g} ms", alpha_of(worst_.alpha),
                              1e3 * config_.control.period * double(worst_period_ + 1));
  }

  [[noreturn]] void refuse() const {
    throw Error(ErrorParts{
        .key = "uncertainty",
        .problem = "no reference from half of control.peak_reference_K on keeps the limit",
        .found = fmt::format("a highest peak of {:.2f} K for {}", top(), describe_worst()),
        .accepted = "smaller uncertainties, control.robust = \"certified\", or a shorter period"});
  }

  const Config& config_;
  const ReducedModel& model_;
  double limit_;  // K
  std::vector<DeclaredQuantity> quantities_;
  std::size_t periods_;
  std::vector<std::size_t> first_;
  std::vector<double> shares_;  // per stretch
  double noise_slack_ = 0.0;    // K, possible effect of noise on a noise-free treatment
  Eigen::MatrixXd none_;
  Noise early_;    // of the whole set: first without late noise
  Noise survey_;   // and then with some, to find eyes near the limit
  Noise closely_;  // of eyes that come near
  std::vector<Signs> corners_;
  std::vector<std::unique_ptr<const DeclaredEye>> eyes_;
  std::vector<Eye> all_;
  std::vector<std::vector<Known>> known_;  // per corner and alpha, per stretch
  std::vector<Eye> treated_;
  std::vector<std::vector<double>> of_eye_;  // K, highest peaks, per eye treated and stretch
  std::vector<double> highest_;              // K, per stretch
  Eye worst_{0, 0};
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

Config controller_config(const Config& config, const ReducedModel& model) {
  return wants_margin(config) ? backed_off(config, tissue_margin(config, model)) : config;
}

}  // namespace photocoag
