// The C functions of an FMU (FMI 2.0, co-simulation) around the same FmuInstance as entry.cpp.
#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <memory>
#include <string>
#include <string_view>

#include <fmi3_refuse.h>
#include "photocoag/fmu/calls.hpp"
#include "photocoag/fmu/fmi2.h"

namespace photocoag {
namespace {

/// Arguments of fmi2SetupExperiment.
struct Experiment {
  bool known = false;
  double start = 0.0;
  bool stop_defined = false;
  double stop = 0.0;
};

struct Importer2 {
  using Status = fmi2Status;

  std::string name = {};
  const fmi2CallbackFunctions* functions = nullptr;
  Experiment experiment = {};

  void tell(const char* function, const char* message) const noexcept {
    if (functions == nullptr || functions->logger == nullptr) return;
    try {
      functions->logger(functions->componentEnvironment, name.c_str(), fmi2Error, FMU_LOG_CATEGORY,
                        "%s", fmt::format("{}: {}", function, message).c_str());
    } catch (const std::exception&) {
      functions->logger(functions->componentEnvironment, name.c_str(), fmi2Error, FMU_LOG_CATEGORY,
                        "%s", function);
    }
  }
};

using Open2 = OpenInstance<Importer2>;

Handles<Open2>& all() { return all_instances<Importer2>(); }

template <typename F>
fmi2Status call(fmi2Component handle, const char* function, F f) noexcept {
  return fmu_call<Importer2>(handle, function, f);
}

fmi2Status refuse(fmi2Component handle, const char* function) noexcept {
  return call(handle, function,
              [](Open2&) { throw Error("not supported by this FMU, whose steps end at once"); });
}

fmi2Status refuse_access(fmi2Component handle, const char* function, std::size_t n) noexcept {
  return call(handle, function, [n](Open2&) {
    if (n > 0) throw Error("no variable of this FMU has that");
  });
}

int digit(char c) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  const std::size_t found = kDigits.find(static_cast<char>(c | 0x20));
  return found == std::string_view::npos ? -1 : static_cast<int>(found);
}

// The folder that a URI names: file:///a%20folder, file:/a, file://localhost/a.
std::string folder_of(std::string_view uri) {
  constexpr std::string_view kScheme = "file:";
  if (!uri.starts_with(kScheme)) {
    throw Error(ErrorParts{.where = "resources",
                           .found = std::string(uri),
                           .accepted = "the URI of a folder, file:///…"});
  }
  uri.remove_prefix(kScheme.size());
  if (uri.starts_with("//")) uri.remove_prefix(std::min(uri.find('/', 2), uri.size()));
  std::string folder;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const int high = uri[i] == '%' && i + 2 < uri.size() ? digit(uri[i + 1]) : -1;
    const int low = high >= 0 ? digit(uri[i + 2]) : -1;
    folder += low < 0 ? uri[i] : static_cast<char>(16 * high + low);
    if (low >= 0) i += 2;
  }
  return folder;
}

}  // namespace
}  // namespace photocoag

using namespace photocoag;

extern "C" {

const char* fmi2GetTypesPlatform(void) { return FMI2_TYPES_PLATFORM; }

const char* fmi2GetVersion(void) { return FMI2_VERSION; }

// Only errors are logged, and always.
fmi2Status fmi2SetDebugLogging(fmi2Component handle, fmi2Boolean, size_t n,
                               const fmi2String categories[]) {
  return call(handle, __func__, [&](Open2&) { require_known_categories(n, categories); });
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* functions, fmi2Boolean, fmi2Boolean) {
  Importer2 importer{.functions = functions};
  try {
    require_given(name != nullptr && guid != nullptr && resources != nullptr &&
                  functions != nullptr);
    importer.name = name;
    if (type != fmi2CoSimulation) throw Error("this FMU is for co-simulation");
    auto open = std::make_unique<Open2>(Open2{importer, FmuInstance(folder_of(resources), guid)});
    fmi2Component handle = all().add(std::move(open));
    if (handle == nullptr) throw Error("too many instances at a time");
    return handle;
  } catch (const std::exception& error) {
    importer.tell(__func__, error.what());
    return nullptr;
  }
}

void fmi2FreeInstance(fmi2Component handle) { all().remove(handle); }

fmi2Status fmi2SetupExperiment(fmi2Component handle, fmi2Boolean, fmi2Real, fmi2Real start,
                               fmi2Boolean stop_defined, fmi2Real stop) {
  return call(handle, __func__, [&](Open2& open) {
    if (open.importer.experiment.known) throw Error("called out of order: a second time");
    open.importer.experiment = {true, start, stop_defined != 0, stop};
  });
}

fmi2Status fmi2EnterInitializationMode(fmi2Component handle) {
  return call(handle, __func__, [](Open2& open) {
    const auto& [known, start, stop_defined, stop] = open.importer.experiment;
    if (!known) throw Error("called out of order: before fmi2SetupExperiment");
    open.instance.enter_initialization(start, stop_defined, stop);
  });
}

fmi2Status fmi2ExitInitializationMode(fmi2Component handle) {
  return call(handle, __func__, [](Open2& open) { open.instance.exit_initialization(); });
}

fmi2Status fmi2Terminate(fmi2Component handle) {
  return call(handle, __func__, [](Open2& open) { open.instance.terminate(); });
}

fmi2Status fmi2Reset(fmi2Component handle) {
  return call(handle, __func__, [](Open2& open) {
    open.instance.reset();
    open.importer.experiment = {};
  });
}

fmi2Status fmi2GetReal(fmi2Component handle, const fmi2ValueReference references[], size_t n,
                       fmi2Real values[]) {
  return call(handle, __func__, [&](Open2& open) {
    get_values(open.instance, FmuType::kFloat64, references, n, values);
  });
}

fmi2Status fmi2GetInteger(fmi2Component handle, const fmi2ValueReference references[], size_t n,
                          fmi2Integer values[]) {
  return call(handle, __func__, [&](Open2& open) {
    get_values(open.instance, FmuType::kInt64, references, n, values);
  });
}

fmi2Status fmi2GetBoolean(fmi2Component handle, const fmi2ValueReference references[], size_t n,
                          fmi2Boolean values[]) {
  return call(handle, __func__, [&](Open2& open) {
    get_values(open.instance, FmuType::kBoolean, references, n, values);
  });
}

fmi2Status fmi2GetString(fmi2Component handle, const fmi2ValueReference[], size_t n, fmi2String[]) {
  return refuse_access(handle, __func__, n);
}

fmi2Status fmi2SetReal(fmi2Component handle, const fmi2ValueReference references[], size_t n,
                       const fmi2Real values[]) {
  return call(handle, __func__, [&](Open2& open) {
    set_values(open.instance, FmuType::kFloat64, references, n, values);
  });
}

fmi2Status fmi2SetInteger(fmi2Component handle, const fmi2ValueReference references[], size_t n,
                          const fmi2Integer values[]) {
  return call(handle, __func__, [&](Open2& open) {
    set_values(open.instance, FmuType::kInt64, references, n, values);
  });
}

fmi2Status fmi2SetBoolean(fmi2Component handle, const fmi2ValueReference references[], size_t n,
                          const fmi2Boolean values[]) {
  return call(handle, __func__, [&](Open2& open) {
    set_values(open.instance, FmuType::kBoolean, references, n, values);
  });
}

fmi2Status fmi2SetString(fmi2Component handle, const fmi2ValueReference[], size_t n,
                         const fmi2String[]) {
  return refuse_access(handle, __func__, n);
}

fmi2Status fmi2GetFMUstate(fmi2Component handle, fmi2FMUstate* state) {
  return call(handle, __func__, [&](Open2& open) { get_state(open.instance, state); });
}

fmi2Status fmi2SetFMUstate(fmi2Component handle, fmi2FMUstate state) {
  return call(handle, __func__,
              [&](Open2& open) { open.instance.restore(static_cast<FmuState*>(state)); });
}

fmi2Status fmi2FreeFMUstate(fmi2Component handle, fmi2FMUstate* state) {
  return call(handle, __func__, [&](Open2& open) { free_state(open.instance, state); });
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component handle, fmi2FMUstate state, size_t* size) {
  return call(handle, __func__,
              [&](Open2& open) { get_serialized_size(open.instance, state, size); });
}

fmi2Status fmi2SerializeFMUstate(fmi2Component handle, fmi2FMUstate state, fmi2Byte bytes[],
                                 size_t size) {
  return call(handle, __func__,
              [&](Open2& open) { serialize_state(open.instance, state, bytes, size); });
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component handle, const fmi2Byte bytes[], size_t size,
                                   fmi2FMUstate* state) {
  return call(handle, __func__,
              [&](Open2& open) { deserialize_state(open.instance, bytes, size, state); });
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component handle, const fmi2ValueReference[], size_t,
                                        const fmi2ValueReference[], size_t, const fmi2Real[],
                                        fmi2Real[]) {
  return refuse(handle, __func__);
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component handle, const fmi2ValueReference[], size_t n,
                                       const fmi2Integer[], const fmi2Real[]) {
  return refuse_access(handle, __func__, n);
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component handle, const fmi2ValueReference[], size_t n,
                                        const fmi2Integer[], fmi2Real[]) {
  return refuse_access(handle, __func__, n);
}

fmi2Status fmi2DoStep(fmi2Component handle, fmi2Real time, fmi2Real step, fmi2Boolean) {
  return call(handle, __func__, [&](Open2& open) { open.instance.step(time, step); });
}

fmi2Status fmi2CancelStep(fmi2Component handle) { return refuse(handle, __func__); }

fmi2Status fmi2GetStatus(fmi2Component handle, const fmi2StatusKind, fmi2Status*) {
  return refuse(handle, __func__);
}

fmi2Status fmi2GetRealStatus(fmi2Component handle, const fmi2StatusKind kind, fmi2Real* value) {
  return call(handle, __func__, [&](Open2& open) {
    require_given(value != nullptr);
    if (kind != fmi2LastSuccessfulTime) throw Error("not a status in real numbers");
    *value = open.instance.time();
  });
}

fmi2Status fmi2GetIntegerStatus(fmi2Component handle, const fmi2StatusKind, fmi2Integer*) {
  return refuse(handle, __func__);
}

fmi2Status fmi2GetBooleanStatus(fmi2Component handle, const fmi2StatusKind kind,
                                fmi2Boolean* value) {
  return call(handle, __func__, [&](Open2&) {
    require_given(value != nullptr);
    if (kind != fmi2Terminated) throw Error("not a status of yes or no");
    *value = 0;
  });
}

fmi2Status fmi2GetStringStatus(fmi2Component handle, const fmi2StatusKind, fmi2String*) {
  return refuse(handle, __func__);
}

}  // extern "C"
