// Role: simulation; common part of the C functions of FMI 2.0 and FMI 3.0: exceptions become an
// error status and a message to the importer's logger. Used by fmu/entry.cpp, fmu/fmi2_entry.cpp.
// Threads: as FmuInstance.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <string_view>
#include <vector>

#include <fmi3_refuse.h>
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

/// All references are checked before any value is read or set.
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

inline void require_known_categories(std::size_t n, const char* const* categories) {
  require_given(n == 0 || categories != nullptr);
  for (std::size_t i = 0; i < n; ++i) {
    if (categories[i] == nullptr || std::string_view(categories[i]) != FMU_LOG_CATEGORY) {
      throw Error("unknown log category");
    }
  }
}

// States, which both standards pass as pointers to nothing in particular.

inline void get_state(FmuInstance& instance, void** state) {
  require_given(state != nullptr);
  if (*state == nullptr) {
    *state = const_cast<FmuState*>(instance.save_state());
  } else {
    instance.save_state(static_cast<FmuState*>(*state));
  }
}

inline void free_state(FmuInstance& instance, void** state) {
  require_given(state != nullptr);
  instance.free_state(static_cast<FmuState*>(*state));
  *state = nullptr;
}

inline void get_serialized_size(const FmuInstance& instance, void* state, std::size_t* size) {
  require_given(size != nullptr);
  *size = instance.serialized_size(static_cast<FmuState*>(state));
}

template <typename Byte>
void serialize_state(const FmuInstance& instance, void* state, Byte* bytes, std::size_t size) {
  const std::vector<std::uint8_t> all = instance.serialize(static_cast<FmuState*>(state));
  require_given(bytes != nullptr && size == all.size());
  std::memcpy(bytes, all.data(), size);
}

template <typename Byte>
void deserialize_state(FmuInstance& instance, const Byte* bytes, std::size_t size, void** state) {
  require_given(bytes != nullptr && state != nullptr);
  *state = const_cast<FmuState*>(
      instance.deserialize({reinterpret_cast<const std::uint8_t*>(bytes), size}));
}

}  // namespace photocoag
