// Role: simulation; one instance of an FMU: its mode, its variables, its part, its saved states.
// Used by fmu/calls.hpp, the C boundary. Source: FMI 3.0, co-simulation; docs/fmu.md. Differences:
// unsupported functions return an error. Units: as fmu_variables(). Errors: calls that the standard
// forbids throw Error and change nothing. Real time: a valid step does not allocate. Threads: one
// owner per instance; instances share nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "photocoag/fmu/parts.hpp"

namespace photocoag {

enum class FmuMode : std::uint8_t { kInstantiated, kInitialization, kStep, kTerminated };

/// Complete state of an instance.
struct FmuState {
  FmuMode mode = FmuMode::kInstantiated;
  double start = 0.0;            ///< s
  std::uint64_t steps = 0;       ///< done
  std::vector<FmuValue> values;  ///< one per variable
  /// The inputs of every step, for serialize(); at most one minute, the longest treatment.
  std::vector<double> history;
  std::optional<FmuPart> part;  ///< nullopt: not made yet, or a parameter has changed
};

class FmuInstance {
 public:
  /// Throws Error if `folder` is not an FMU's resources folder or `token` does not match it.
  FmuInstance(const std::string& folder, const std::string& token);

  void enter_initialization(double start, bool stop_defined, double stop);
  void exit_initialization();
  void terminate();
  void reset();

  /// Throws Error on an unknown reference, another type, or a variable that has no value yet.
  void check_readable(FmuType type, std::uint32_t reference);
  /// Throws Error as check_readable(), and if the variable cannot be set in the current mode.
  void check_writable(FmuType type, std::uint32_t reference, const FmuValue& value) const;
  /// Precondition: the reference has been checked.
  const FmuValue& value(std::uint32_t reference) const noexcept { return state_.values[reference]; }
  void set_value(std::uint32_t reference, const FmuValue& value) noexcept;

  /// One control period. Throws Error unless time and step are the expected ones.
  void step(double time, double length);
  double time() const noexcept;

  /// A saved state; freed by free_state() or with the instance.
  const FmuState* save_state();
  /// Overwrites a saved state of this instance.
  void save_state(const FmuState* state);
  void restore(const FmuState* state);
  void free_state(const FmuState* state);
  /// A state as bytes for any instance of the same FMU: parameters and the inputs of every step.
  /// Throws Error if more than a minute has been simulated.
  std::vector<std::uint8_t> serialize(const FmuState* state) const;
  std::size_t serialized_size(const FmuState* state) const;
  /// Steps a new part through the inputs. Throws Error on bytes that are not of this FMU.
  const FmuState* deserialize(std::span<const std::uint8_t> bytes);

 private:
  const FmuVariable& variable(FmuType type, std::uint32_t reference) const;
  void make_part(FmuState& state) const;
  void show(FmuState& state) const noexcept;
  std::span<const FmuValue> inputs(const FmuState& state) const noexcept;
  FmuState fresh() const;
  FmuState* own(const FmuState* state) const;
  std::size_t most_history() const noexcept;

  FmuSetup setup_;
  FmuLayout layout_;
  double period_;
  FmuState state_;
  std::vector<std::unique_ptr<FmuState>> saved_;
};

}  // namespace photocoag
