// Role: simulation; what the C functions of FMI 2.0 and of FMI 3.0 have in common: exceptions end
// here, as an error and a message to the importer's logger. Used by fmu/entry.cpp,
// fmu/fmi2_entry.cpp. Threads: as FmuInstance.
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>

#include "photocoag/core/error.hpp"
#include "photocoag/fmu/handles.hpp"
#include "photocoag/fmu/instance.hpp"

namespace photocoag {

/// `Importer` has Status, the type of both standards' 0 (OK) and 3 (error), and
/// tell(function, message).
template <typename Importer>
struct OpenInstance {
  Importer importer;
  FmuInstance instance;
};

template <typename Importer>
Handles<OpenInstance<Importer>>& all_instances() {
  static Handles<OpenInstance<Importer>> handles;
  return handles;
}

template <typename Importer, typename F>
typename Importer::Status fmu_call(void* handle, const char* function, F f) noexcept {
  using Status = typename Importer::Status;
  OpenInstance<Importer>* open = all_instances<Importer>().find(handle);
  if (open == nullptr) return static_cast<Status>(3);
  try {
    f(*open);
    return static_cast<Status>(0);
  } catch (const std::exception& error) {
    open->importer.tell(function, error.what());
    return static_cast<Status>(3);
  }
}

inline void require_given(bool given) {
  if (!given) throw Error("a null pointer, or another number of values than of references");
}

/// All of the references or none.
template <typename T>
void get_values(FmuInstance& instance, FmuType type, const std::uint32_t* references, std::size_t n,
                T* values) {
  require_given(n == 0 || (references != nullptr && values != nullptr));
  for (std::size_t i = 0; i < n; ++i) instance.check_readable(type, references[i]);
  for (std::size_t i = 0; i < n; ++i) {
    const FmuValue& value = instance.value(references[i]);
    values[i] =
        type == FmuType::kFloat64 ? static_cast<T>(value.number) : static_cast<T>(value.whole);
  }
}

template <typename T>
void set_values(FmuInstance& instance, FmuType type, const std::uint32_t* references, std::size_t n,
                const T* values) {
  require_given(n == 0 || (references != nullptr && values != nullptr));
  const auto value_of = [type](T value) {
    return type == FmuType::kFloat64 ? FmuValue{.number = static_cast<double>(value)}
                                     : FmuValue{.whole = static_cast<std::int64_t>(value)};
  };
  for (std::size_t i = 0; i < n; ++i) {
    instance.check_writable(type, references[i], value_of(values[i]));
  }
  for (std::size_t i = 0; i < n; ++i) instance.set_value(references[i], value_of(values[i]));
}

}  // namespace photocoag
