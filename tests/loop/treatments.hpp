// Role: tests of loop and rt; closed-loop treatments from the shipped configurations and what came
// of them.
#pragma once

#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "photocoag/run/treatment.hpp"

namespace photocoag::testing {

inline Config shipped(const std::string& name, const std::vector<std::string>& overrides = {}) {
  return load_config(std::string(PHOTOCOAG_SOURCE_DIR) + "/configs/" + name, overrides);
}

/// Models of the default tissue at full order (more than 80,000 cells), made once per program and
/// period; for configurations that differ in nothing a model depends on. Every test is a process of
/// its own: they share a cache in the build tree (tests/CMakeLists.txt), whose models have the bits
/// of those made anew.
inline ModelStore& default_models(double period) {
  const auto make = [](double period_ms) {
    return ModelStore(load_config("", {"control.period_ms=" + std::to_string(period_ms)}), false);
  };
  static ModelStore at_1khz = make(1.0);
  static ModelStore at_250hz = make(4.0);
  return period < 2e-3 ? at_1khz : at_250hz;
}

inline Treatment treat(const Config& config, ModelStore& models,
                       const DeviceAddress& place = virtual_eye()) {
  const std::atomic<bool> stop{false};
  std::atomic<std::size_t> progress{0};
  return run_treatment(config, models, place, stop, progress);
}

inline Treatment treat(const Config& config) {
  return treat(config, default_models(config.control.period));
}

/// What the paper's figures show, as numbers.
struct Outcome {
  double peak_max = 0.0;         ///< K, true
  double time_to_95 = INFINITY;  ///< s, true peak at 95 % of the reference
  double rms = 0.0;              ///< K, true peak against the reference after 50 ms
  double alpha_error = 0.0;      ///< estimate / truth - 1 at the end
  int violations = 0;            ///< cycles with a true peak above the limit
  int limit_active = 0;          ///< cycles whose plan ran along the limit
  int limit_active_run = 0;      ///< the most of them in a row
  int unsolved = 0;              ///< cycles without an answer, or stopped by the gate
};

inline Outcome outcome(const Config& config, const std::vector<CycleRecord>& records) {
  Outcome o;
  double squares = 0.0;
  int late = 0;
  int run = 0;
  for (const CycleRecord& r : records) {
    o.peak_max = std::max(o.peak_max, r.truth.peak);
    if (r.truth.peak >= 0.95 * config.control.peak_reference) {
      o.time_to_95 = std::min(o.time_to_95, r.time);
    }
    if (r.time > 0.05) {
      squares += std::pow(r.truth.peak - config.control.peak_reference, 2);
      ++late;
    }
    o.violations += r.truth.peak > config.control.peak_max ? 1 : 0;
    run = r.decision.limit_active ? run + 1 : 0;
    o.limit_active += r.decision.limit_active ? 1 : 0;
    o.limit_active_run = std::max(o.limit_active_run, run);
    const bool solved =
        r.decision.status == MpcStatus::kSolved || r.decision.status == MpcStatus::kRelaxed;
    o.unsolved += solved && r.decision.gate == GateVerdict::kPassed ? 0 : 1;
  }
  o.rms = std::sqrt(squares / late);
  o.alpha_error = records.back().estimate.absorption_factor / config.plant.absorption_factor - 1.0;
  return o;
}

/// Equal bit for bit (NaN equals the same NaN).
inline bool same(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

inline bool same(const CycleRecord& a, const CycleRecord& b) {
  const Estimate& e = a.estimate;
  const Estimate& f = b.estimate;
  const Decision& d = a.decision;
  const Decision& g = b.decision;
  return a.cycle == b.cycle && same(a.time, b.time) && same(a.power, b.power) &&
         same(a.truth.peak, b.truth.peak) && same(a.truth.volume, b.truth.volume) &&
         same(a.measured, b.measured) && a.overrun == b.overrun &&
         same(e.outputs.peak, f.outputs.peak) && same(e.outputs.volume, f.outputs.volume) &&
         same(e.peak_sigma, f.peak_sigma) && same(e.absorption_factor, f.absorption_factor) &&
         same(e.absorption_sigma, f.absorption_sigma) && e.status == f.status &&
         same(d.power, g.power) && same(d.power_reference, g.power_reference) &&
         d.status == g.status && d.gate == g.gate && d.iterations == g.iterations &&
         d.limit_active == g.limit_active;
}

inline bool same(const std::vector<CycleRecord>& a, const std::vector<CycleRecord>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t k = 0; k < a.size(); ++k) {
    if (!same(a[k], b[k])) return false;
  }
  return true;
}

}  // namespace photocoag::testing
