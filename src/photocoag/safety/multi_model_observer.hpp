// Role: online; estimates temperature and absorption by a bank of models, sharing neither code nor
// state with the estimator. Used by the supervisor, run. Source: docs/safety.md, "The multi-model
// observer".
// Units: SI. Real time: noexcept, bounded (modes x absorptions), allocation-free. Threads: one
// owner.
#pragma once

#include <array>
#include <cstddef>

namespace photocoag {

inline constexpr std::size_t kObserverModes = 14;
inline constexpr std::size_t kObserverAbsorptions = 48;  ///< alphas if beta is known
inline constexpr std::size_t kObserverChoroids =
    9;  ///< betas if it is not, each with half as many alphas
inline constexpr std::size_t kObserverCurves = kObserverChoroids * kObserverAbsorptions / 2;

/// Tissue at a grid of absorption factors, as sums of first-order lags that the emitted power alone
/// drives: s_i <- decay_i s_i + u, temperature = sum_i weight_i(alpha, beta) s_i. Curve j belongs
/// to beta number j / absorptions and alpha number j % absorptions.
struct ObserverModel {
  using Weights = std::array<double, kObserverModes>;
  std::size_t absorptions = kObserverAbsorptions;  ///< alphas, at most kObserverAbsorptions
  std::size_t choroids = 1;                        ///< betas, at most kObserverChoroids
  double memory = 0.95;                        ///< 1, forgetting factor of the misfit, per sample
  std::array<double, kObserverModes> decay{};  ///< per period; 0 where not used
  std::array<double, kObserverAbsorptions> absorption{};  ///< ascending
  std::array<double, kObserverChoroids> choroid{};        ///< beta
  std::array<Weights, kObserverCurves> volume{};          ///< K/W per lag
  std::array<Weights, kObserverCurves> peak{};            ///< K/W per lag
  std::array<double, kObserverCurves> steady_peak{};      ///< K/W
  double peak_error = 0.0;    ///< relative error of every predicted peak
  double peak_error_K = 0.0;  ///< K, added to it
  /// True if a sample is not the temperature at the end of its period (a mean over pulses): lag i
  /// then enters it as seen_before_i s_i + seen_power_i u, with s_i at the period's start.
  bool averaged = false;
  std::array<double, kObserverModes> seen_before{};
  std::array<double, kObserverModes> seen_power{};
  std::array<double, kObserverCurves>
      seen_feed{};  ///< K/W, direct feedthrough of the period's own power
};

/// Distance of a sample from the temperatures that the emitted power can explain.
struct ObserverResidual {
  double outside = 0.0;  ///< standard deviations outside the span of plausible curves, extended to
                         ///< the next curve above, and below if only one is plausible
  bool above = false;    ///< hotter than the span
};

/// The emitted power since the cold start fixes the temperature for every curve. Each curve is
/// judged by its misfit J <- memory J + (y - v)^2 / r^2 with r^2 = noise^2 + (model_error v)^2,
/// kept separately for odd and even samples. A curve is plausible if either misfit is within its
/// J_min + 12, so that no single sample, however wrong, can exclude the truth, and nothing is
/// excluded before two samples agree.
class MultiModelObserver {
 public:
  MultiModelObserver(const ObserverModel& model, double noise, double model_error) noexcept;

  /// One period with `power`, W.
  void emit(double power) noexcept;
  /// Command delay: `power`, W, was written before and will be emitted for one period before any
  /// new one. Call after emit and before the queries below.
  void queue(double power) noexcept;
  /// Compares a sample, K, with the plausible curves; does not change the state.
  ObserverResidual compare(double volume_temperature) const noexcept;
  /// Updates every curve's misfit with a usable sample, K.
  void update(double volume_temperature) noexcept;

  /// Set after a sample far hotter than anything plausible, until one fits again: the tissue may
  /// have changed, so the powers below consider every absorption.
  void set_suspicious(bool suspicious) noexcept { suspicious_ = suspicious; }

  /// Largest plausible absorption factor; before the second sample the largest of the model.
  double absorption_high() const noexcept { return high_alpha_; }
  /// Peak now at the hottest plausible absorption, K.
  double peak_high() const noexcept;
  /// Volume temperature now at the hottest plausible absorption, K.
  double volume_high() const noexcept;
  /// Forgets the samples (not the emitted power): every absorption is plausible again.
  void reset() noexcept;

  /// Largest power, W, such that after one period of it (and of the queued one) no plausible peak
  /// plus model error exceeds `peak`, K; at least 0.
  double power_for_peak(double peak) const noexcept;
  /// The same after two periods of that power, the longest that a device holds it before its
  /// watchdog acts.
  double held_power_for_peak(double peak) const noexcept;
  /// The same if the power comes one period late and `before`, W, acts until then.
  double late_power_for_peak(double peak, double before) const noexcept;
  /// Power, W, that holds `peak`, K, in steady state at the hottest plausible absorption.
  double steady_power(double peak) const noexcept;

 private:
  using PerCurve = std::array<double, kObserverCurves>;
  using Lags = std::array<double, kObserverModes>;

  /// The curves of one beta: alphas from `low` on are plausible, up to between high - 1 and high.
  struct Family {
    bool plausible = true;
    std::size_t low = 0;    // curves
    std::size_t high = 1;   // first one at or above the largest plausible alpha
    double fraction = 1.0;  // between high - 1 and high
    double at_high(double below, double above) const noexcept {
      return below + fraction * (above - below);
    }
    void widen_to(const Family& other) noexcept;
  };

  std::size_t curves() const noexcept { return model_.absorptions * model_.choroids; }
  double peak_at_high(const Family& family, const Lags& lags) const noexcept;
  double power_for(double peak, const Lags& coasting, const PerCurve& rise) const noexcept;
  double variance(std::size_t j) const noexcept;
  void find_plausible() noexcept;
  Family plausible_by(const PerCurve& misfit, std::size_t first, double least, double bar,
                      std::size_t& best) const noexcept;
  Family counted(std::size_t b) const noexcept;

  ObserverModel model_;
  double noise_variance_;
  double model_error_;
  std::size_t modes_ = 1;                          // in use: the rest decays to 0 and has no weight
  std::array<PerCurve, kObserverModes> volume_{};  // the model's weights, by lag
  PerCurve rise_1_{};                              // K/W, peak after one period of 1 W
  PerCurve rise_2_{};                              // after two
  Lags lag_{};                                     // now
  Lags coasting_{};                                // after the queued power and one period at 0 W
  Lags coasting_2_{};                              // after two
  PerCurve volume_now_{};
  std::array<PerCurve, 2> misfit_{};  // by samples of even and of odd number
  std::array<std::array<double, kObserverChoroids>, 2> least_{};      // misfit of each beta
  std::array<std::array<std::size_t, kObserverChoroids>, 2> best_{};  // the curve that has it
  std::size_t next_ = 0;  // which of them the next sample enters
  bool suspicious_ = false;
  std::array<Family, kObserverChoroids> families_{};  // one per beta
  double high_alpha_ = 0.0;
};

}  // namespace photocoag
