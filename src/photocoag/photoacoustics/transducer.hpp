// Role: simulation; a pressure transducer with its converter: transients of given amplitude,
// arrival time and noise. Used by eye, run. Source: docs/photoacoustics.md, "The simulated
// transducer". Real time: write is noexcept, allocation-free after construction.
#pragma once

#include <cstdint>
#include <vector>

#include "photocoag/photoacoustics/transient.hpp"

namespace photocoag {

/// A damped oscillation with a smooth onset,
///   w(t) = (t / decay) exp(1 - t / decay) sin(2 pi frequency t), t in samples after the arrival.
struct TransducerSettings {
  double frequency = 0.04;  ///< cycles per converter sample: 2 MHz at 50 MHz
  double decay = 10.0;      ///< converter samples
  double arrival = 36.0;    ///< converter samples after the trigger
};

class Transducer {
 public:
  explicit Transducer(const TransducerSettings& settings = {});

  /// `amplitude` and `noise` (standard deviation per sample) in codes, `delay` in samples, after
  /// the nominal arrival. Noise is drawn from (seed, pulse) alone. Codes are clipped at the rails.
  void write(double amplitude, double delay, double noise, std::uint64_t seed, std::uint64_t pulse,
             PressureTransient& transient) const noexcept;

  /// Square root of the sum of squares of w without its mean over the matched filter's window:
  /// noise per sample / this = noise of the amplitude.
  double gain() const noexcept { return gain_; }

 private:
  static constexpr int kFine = 32;  // points per sample
  double shape(double position) const noexcept;
  double arrival_;
  std::vector<double> fine_;
  double gain_ = 0.0;
};

}  // namespace photocoag
