// The C functions of an FMU (FMI 3.0, co-simulation) around FmuInstance: exceptions end here, as
// fmi3Error and a message to the importer's logger. What is not supported:
// src/fmu/c/fmi3_unsupported.c.
#include <fmt/format.h>

#include <exception>
#include <memory>
#include <string>
#include <utility>

#include <fmi3.h>
#include <fmi3_refuse.h>
#include "photocoag/fmu/calls.hpp"

namespace photocoag {
namespace {

struct Importer {
  using Status = fmi3Status;

  fmi3InstanceEnvironment environment = nullptr;
  fmi3LogMessageCallback log = nullptr;

  void tell(const char* function, const char* message) const noexcept {
    if (log == nullptr) return;
    try {
      log(environment, fmi3Error, FMU_LOG_CATEGORY,
          fmt::format("{}: {}", function, message).c_str());
    } catch (const std::exception&) {
      log(environment, fmi3Error, FMU_LOG_CATEGORY, function);
    }
  }
};

using Open = OpenInstance<Importer>;

Handles<Open>& all() { return all_instances<Importer>(); }

template <typename F>
fmi3Status call(fmi3Instance handle, const char* function, F f) noexcept {
  return fmu_call<Importer>(handle, function, [&f](Open& open) { f(open.instance); });
}

template <typename T>
fmi3Status get(fmi3Instance handle, const char* function, FmuType type,
               const fmi3ValueReference* references, std::size_t n, T* values,
               std::size_t n_values) noexcept {
  return call(handle, function, [&](FmuInstance& instance) {
    require_given(n == n_values);
    get_values(instance, type, references, n, values);
  });
}

template <typename T>
fmi3Status set(fmi3Instance handle, const char* function, FmuType type,
               const fmi3ValueReference* references, std::size_t n, const T* values,
               std::size_t n_values) noexcept {
  return call(handle, function, [&](FmuInstance& instance) {
    require_given(n == n_values);
    set_values(instance, type, references, n, values);
  });
}

}  // namespace
}  // namespace photocoag

using namespace photocoag;

extern "C" {

fmi3Status fmu_refuse(fmi3Instance handle, const char* function) {
  return call(handle, function, [](FmuInstance&) {
    throw Error("not supported by this FMU, which is for plain co-simulation");
  });
}

fmi3Status fmu_refuse_access(fmi3Instance handle, const char* function, size_t n, size_t n_values) {
  return call(handle, function, [&](FmuInstance&) {
    if (n == 0 && n_values == 0) return;
    throw Error("no variable of this FMU has that type");
  });
}

const char* fmi3GetVersion(void) { return FMI3_VERSION; }

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                         fmi3Boolean, fmi3Boolean, fmi3Boolean event_mode,
                                         fmi3Boolean, const fmi3ValueReference*,
                                         size_t n_intermediate, fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback) {
  const Importer importer{environment, log};
  try {
    require_given(name != nullptr && token != nullptr && resources != nullptr);
    if (event_mode || n_intermediate > 0) {
      throw Error("no event mode and no intermediate variables: see modelDescription.xml");
    }
    auto open = std::make_unique<Open>(Open{importer, FmuInstance(resources, token)});
    fmi3Instance handle = all().add(std::move(open));
    if (handle == nullptr) throw Error("too many instances at a time");
    return handle;
  } catch (const std::exception& error) {
    importer.tell(__func__, error.what());
    return nullptr;
  }
}

void fmi3FreeInstance(fmi3Instance handle) { all().remove(handle); }

// Only errors are logged, and always.
fmi3Status fmi3SetDebugLogging(fmi3Instance handle, fmi3Boolean, size_t n,
                               const fmi3String categories[]) {
  return call(handle, __func__, [&](FmuInstance&) { require_known_categories(n, categories); });
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance handle, fmi3Boolean, fmi3Float64,
                                       fmi3Float64 start, fmi3Boolean stop_defined,
                                       fmi3Float64 stop) {
  return call(handle, __func__, [&](FmuInstance& instance) {
    instance.enter_initialization(start, stop_defined, stop);
  });
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance handle) {
  return call(handle, __func__, [](FmuInstance& instance) { instance.exit_initialization(); });
}

fmi3Status fmi3Terminate(fmi3Instance handle) {
  return call(handle, __func__, [](FmuInstance& instance) { instance.terminate(); });
}

fmi3Status fmi3Reset(fmi3Instance handle) {
  return call(handle, __func__, [](FmuInstance& instance) { instance.reset(); });
}

fmi3Status fmi3GetFloat64(fmi3Instance handle, const fmi3ValueReference references[], size_t n,
                          fmi3Float64 values[], size_t n_values) {
  return get(handle, __func__, FmuType::kFloat64, references, n, values, n_values);
}

fmi3Status fmi3GetInt64(fmi3Instance handle, const fmi3ValueReference references[], size_t n,
                        fmi3Int64 values[], size_t n_values) {
  return get(handle, __func__, FmuType::kInt64, references, n, values, n_values);
}

fmi3Status fmi3GetBoolean(fmi3Instance handle, const fmi3ValueReference references[], size_t n,
                          fmi3Boolean values[], size_t n_values) {
  return get(handle, __func__, FmuType::kBoolean, references, n, values, n_values);
}

fmi3Status fmi3SetFloat64(fmi3Instance handle, const fmi3ValueReference references[], size_t n,
                          const fmi3Float64 values[], size_t n_values) {
  return set(handle, __func__, FmuType::kFloat64, references, n, values, n_values);
}

fmi3Status fmi3SetInt64(fmi3Instance handle, const fmi3ValueReference references[], size_t n,
                        const fmi3Int64 values[], size_t n_values) {
  return set(handle, __func__, FmuType::kInt64, references, n, values, n_values);
}

fmi3Status fmi3SetBoolean(fmi3Instance handle, const fmi3ValueReference references[], size_t n,
                          const fmi3Boolean values[], size_t n_values) {
  return set(handle, __func__, FmuType::kBoolean, references, n, values, n_values);
}

fmi3Status fmi3DoStep(fmi3Instance handle, fmi3Float64 time, fmi3Float64 step, fmi3Boolean,
                      fmi3Boolean* event_needed, fmi3Boolean* terminate, fmi3Boolean* early_return,
                      fmi3Float64* last_time) {
  return call(handle, __func__, [&](FmuInstance& instance) {
    require_given(event_needed != nullptr && terminate != nullptr && early_return != nullptr &&
                  last_time != nullptr);
    *event_needed = false;
    *terminate = false;
    *early_return = false;
    *last_time = instance.time();
    instance.step(time, step);
    *last_time = instance.time();
  });
}

fmi3Status fmi3GetFMUState(fmi3Instance handle, fmi3FMUState* state) {
  return call(handle, __func__, [&](FmuInstance& instance) { get_state(instance, state); });
}

fmi3Status fmi3SetFMUState(fmi3Instance handle, fmi3FMUState state) {
  return call(handle, __func__,
              [&](FmuInstance& instance) { instance.restore(static_cast<FmuState*>(state)); });
}

fmi3Status fmi3FreeFMUState(fmi3Instance handle, fmi3FMUState* state) {
  return call(handle, __func__, [&](FmuInstance& instance) { free_state(instance, state); });
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance handle, fmi3FMUState state, size_t* size) {
  return call(handle, __func__,
              [&](FmuInstance& instance) { get_serialized_size(instance, state, size); });
}

fmi3Status fmi3SerializeFMUState(fmi3Instance handle, fmi3FMUState state, fmi3Byte bytes[],
                                 size_t size) {
  return call(handle, __func__,
              [&](FmuInstance& instance) { serialize_state(instance, state, bytes, size); });
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance handle, const fmi3Byte bytes[], size_t size,
                                   fmi3FMUState* state) {
  return call(handle, __func__,
              [&](FmuInstance& instance) { deserialize_state(instance, bytes, size, state); });
}

}  // extern "C"
