#include "photocoag/fmu/instance.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>
#include <utility>
#include <variant>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

constexpr double kLongest = 60.0;  // s, of run.duration_ms

std::string_view to_string(FmuMode mode) {
  constexpr std::string_view kNames[] = {"instantiated", "initialization", "step", "terminated"};
  return kNames[static_cast<std::size_t>(mode)];
}

std::string_view to_string(FmuType type) {
  constexpr std::string_view kNames[] = {"Float64", "Int64", "Boolean"};
  return kNames[static_cast<std::size_t>(type)];
}

void require_mode(FmuMode mode, FmuMode wanted) {
  if (mode == wanted) return;
  throw Error(ErrorParts{.problem = "called out of order",
                         .found = fmt::format("mode {}", to_string(mode)),
                         .accepted = fmt::format("mode {}", to_string(wanted))});
}

FmuSetup checked_setup(const std::string& folder, const std::string& token) {
  const FmuResources resources = read_fmu_resources(folder);
  if (fmu_token(resources) != token) {
    throw Error(ErrorParts{.where = folder,
                           .problem = "the resources are not those that the token belongs to",
                           .found = token,
                           .accepted = fmu_token(resources)});
  }
  return fmu_setup(resources, folder);
}

}  // namespace

FmuInstance::FmuInstance(const std::string& folder, const std::string& token)
    : setup_(checked_setup(folder, token)),
      layout_(fmu_layout(setup_.kind)),
      period_(setup_.config.control.period),
      state_(fresh()) {
  make_part(state_);  // refuses what cannot be simulated
}

FmuState FmuInstance::fresh() const {
  FmuState state;
  for (const FmuVariable& variable : setup_.variables) state.values.push_back(variable.start);
  state.history.reserve(most_history());
  return state;
}

std::size_t FmuInstance::most_history() const noexcept {
  return layout_.inputs * static_cast<std::size_t>(std::ceil(kLongest / period_));
}

std::span<const FmuValue> FmuInstance::inputs(const FmuState& state) const noexcept {
  return {state.values.data() + kFirstFmuInput, layout_.inputs};
}

void FmuInstance::show(FmuState& state) const noexcept {
  state.values[0].number = state.start + static_cast<double>(state.steps) * period_;
  const std::span<FmuValue> outputs{state.values.data() + kFirstFmuInput + layout_.inputs,
                                    layout_.outputs};
  std::visit([&](const auto& part) { part.show(outputs); }, *state.part);
}

void FmuInstance::make_part(FmuState& state) const {
  state.part.emplace(make_fmu_part(setup_, state.values));
  show(state);
}

void FmuInstance::enter_initialization(double start, bool stop_defined, double stop) {
  require_mode(state_.mode, FmuMode::kInstantiated);
  if (!std::isfinite(start) || (stop_defined && !(stop >= start))) {
    throw Error(ErrorParts{.problem = "no span of time",
                           .found = fmt::format("{:g} s to {:g} s", start, stop)});
  }
  state_.start = start;
  state_.values[0].number = start;
  state_.mode = FmuMode::kInitialization;
}

void FmuInstance::exit_initialization() {
  require_mode(state_.mode, FmuMode::kInitialization);
  if (!state_.part) make_part(state_);
  show(state_);
  state_.mode = FmuMode::kStep;
}

void FmuInstance::terminate() {
  require_mode(state_.mode, FmuMode::kStep);
  state_.mode = FmuMode::kTerminated;
}

void FmuInstance::reset() {
  FmuState state = fresh();
  make_part(state);
  state_ = std::move(state);
}

const FmuVariable& FmuInstance::variable(FmuType type, std::uint32_t reference) const {
  if (reference >= setup_.variables.size()) {
    throw Error(ErrorParts{.problem = "unknown value reference",
                           .found = fmt::format("{}", reference),
                           .accepted = fmt::format("0 to {}", setup_.variables.size() - 1)});
  }
  const FmuVariable& found = setup_.variables[reference];
  if (found.type != type) {
    throw Error(ErrorParts{.where = found.name,
                           .problem = "another type",
                           .found = std::string(to_string(type)),
                           .accepted = std::string(to_string(found.type))});
  }
  return found;
}

void FmuInstance::check_readable(FmuType type, std::uint32_t reference) {
  const FmuVariable& one = variable(type, reference);
  if (one.role != FmuRole::kOutput) return;
  if (state_.mode == FmuMode::kInstantiated) {
    throw Error(ErrorParts{.where = one.name, .problem = "has no value before initialization"});
  }
  if (!state_.part) make_part(state_);
}

void FmuInstance::check_writable(FmuType type, std::uint32_t reference,
                                 const FmuValue& value) const {
  const FmuVariable& one = variable(type, reference);
  const bool before =
      state_.mode == FmuMode::kInstantiated || state_.mode == FmuMode::kInitialization;
  const bool may = one.role == FmuRole::kInput ? before || state_.mode == FmuMode::kStep
                                               : one.role == FmuRole::kParameter && before;
  if (!may) {
    throw Error(ErrorParts{.where = one.name,
                           .problem = "cannot be set in this mode",
                           .found = fmt::format("mode {}", to_string(state_.mode)),
                           .accepted = "inputs until the end, parameters before the first step"});
  }
  if (one.role == FmuRole::kParameter && type == FmuType::kFloat64 &&
      !std::isfinite(value.number)) {
    throw Error(ErrorParts{.where = one.name,
                           .found = fmt::format("{}", value.number),
                           .accepted = "a finite number"});
  }
}

void FmuInstance::set_value(std::uint32_t reference, const FmuValue& value) noexcept {
  state_.values[reference] = value;
  if (setup_.variables[reference].role == FmuRole::kParameter) state_.part.reset();
}

double FmuInstance::time() const noexcept { return state_.values[0].number; }

void FmuInstance::step(double time, double length) {
  require_mode(state_.mode, FmuMode::kStep);
  if (!(std::abs(length - period_) <= 1e-6 * period_)) {
    throw Error(ErrorParts{.problem = "another communication step size",
                           .found = fmt::format("{} s", length),
                           .accepted = fmt::format("{} s, the control period", period_)});
  }
  if (!(std::abs(time - state_.values[0].number) <= 1e-3 * period_)) {
    throw Error(ErrorParts{.problem = "another communication point",
                           .found = fmt::format("{} s", time),
                           .accepted = fmt::format("{} s", state_.values[0].number)});
  }
  const std::span<const FmuValue> given = inputs(state_);
  const bool accepted =
      std::visit([&](const auto& part) { return part.accepts(given); }, *state_.part);
  if (!accepted) {
    throw Error(ErrorParts{.where = setup_.variables[kFirstFmuInput].name,
                           .found = fmt::format("{}", given[0].number),
                           .accepted = fmt::format("0 to {} W", kMostFmuPower)});
  }
  if (state_.history.size() + layout_.inputs <= most_history()) {
    for (const FmuValue& one : given) state_.history.push_back(one.number);
  }
  std::visit([&](auto& part) { part.step(given); }, *state_.part);
  ++state_.steps;
  show(state_);
}

FmuState* FmuInstance::own(const FmuState* state) const {
  const auto found = std::find_if(saved_.begin(), saved_.end(),
                                  [state](const auto& one) { return one.get() == state; });
  if (state == nullptr || found == saved_.end()) {
    throw Error(ErrorParts{.problem = "not a saved state of this instance"});
  }
  return found->get();
}

const FmuState* FmuInstance::save_state() {
  return saved_.emplace_back(std::make_unique<FmuState>(state_)).get();
}

void FmuInstance::save_state(const FmuState* state) { *own(state) = state_; }

void FmuInstance::restore(const FmuState* state) {
  FmuState copy = *own(state);
  copy.history.reserve(most_history());
  state_ = std::move(copy);
}

void FmuInstance::free_state(const FmuState* state) {
  if (state == nullptr) return;
  const FmuState* mine = own(state);
  std::erase_if(saved_, [mine](const auto& one) { return one.get() == mine; });
}

namespace {

// Header before values and history.
struct Header {
  char magic[8] = {'p', 'c', 'f', 'm', 'u', '1', '\0', '\0'};
  char token[64] = {};
  std::uint64_t mode = 0;
  double start = 0.0;
  std::uint64_t steps = 0;
};

}  // namespace

std::size_t FmuInstance::serialized_size(const FmuState* state) const {
  const FmuState& mine = *own(state);
  if (mine.history.size() != mine.steps * layout_.inputs) {
    throw Error(ErrorParts{.problem = "too long for a serialized state",
                           .found = fmt::format("{} steps", mine.steps),
                           .accepted = "60 s"});
  }
  return sizeof(Header) + mine.values.size() * sizeof(FmuValue) +
         mine.history.size() * sizeof(double);
}

std::vector<std::uint8_t> FmuInstance::serialize(const FmuState* state) const {
  std::vector<std::uint8_t> bytes(serialized_size(state));
  Header header{.mode = static_cast<std::uint64_t>(state->mode),
                .start = state->start,
                .steps = state->steps};
  std::copy_n(setup_.token.begin(), sizeof header.token, header.token);
  std::uint8_t* at = bytes.data();
  const auto append = [&at](const void* from, std::size_t size) {
    if (size > 0) std::memcpy(at, from, size);
    at += size;
  };
  append(&header, sizeof header);
  append(state->values.data(), state->values.size() * sizeof(FmuValue));
  append(state->history.data(), state->history.size() * sizeof(double));
  return bytes;
}

const FmuState* FmuInstance::deserialize(std::span<const std::uint8_t> bytes) {
  const auto refuse = [] {
    throw Error(ErrorParts{.problem = "not a serialized state of this FMU"});
  };
  const std::size_t values = setup_.variables.size() * sizeof(FmuValue);
  const Header plain;
  Header header;
  if (bytes.size() < sizeof header + values) refuse();
  std::memcpy(&header, bytes.data(), sizeof header);
  if (std::memcmp(header.magic, plain.magic, sizeof header.magic) != 0 ||
      std::string_view(header.token, sizeof header.token) != setup_.token ||
      header.mode > static_cast<std::uint64_t>(FmuMode::kTerminated) ||
      !std::isfinite(header.start) || header.steps > most_history() / layout_.inputs ||
      bytes.size() != sizeof header + values + header.steps * layout_.inputs * sizeof(double)) {
    refuse();
  }
  auto state = std::make_unique<FmuState>(fresh());
  std::vector<double> history(header.steps * layout_.inputs);
  std::vector<FmuValue> last(setup_.variables.size());
  std::memcpy(last.data(), bytes.data() + sizeof header, values);
  if (!history.empty()) {
    std::memcpy(history.data(), bytes.data() + sizeof header + values,
                history.size() * sizeof(double));
  }
  state->mode = static_cast<FmuMode>(header.mode);
  state->start = header.start;
  state->steps = header.steps;
  state->values = last;
  make_part(*state);
  std::vector<FmuValue> given(layout_.inputs);
  for (std::size_t k = 0; k < history.size(); k += layout_.inputs) {
    for (std::size_t i = 0; i < layout_.inputs; ++i) given[i].number = history[k + i];
    std::visit(
        [&](auto& part) {
          if (!part.accepts(given)) refuse();
          part.step(given);
        },
        *state->part);
  }
  state->history.insert(state->history.end(), history.begin(), history.end());
  show(*state);
  return saved_.emplace_back(std::move(state)).get();
}

}  // namespace photocoag
