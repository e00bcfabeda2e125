// Role: online; the functions of NI-DAQmx that the driver calls, with prototypes of our own, looked
// up in the vendor's library when the device is opened: nothing of the vendor is needed to build.
// Source: NI-DAQmx C Reference (names, parameters, constants). Negative: error; positive: warning.
// Units: V, s.
#pragma once

#include <dlfcn.h>

#include <cstdint>
#include <type_traits>

namespace photocoag {

using DaqTask = void*;

inline constexpr std::int32_t kDaqVolts = 10348;          // DAQmx_Val_Volts
inline constexpr std::int32_t kDaqDefaultTerminals = -1;  // DAQmx_Val_Cfg_Default
inline constexpr std::int32_t kDaqOneChannelForAll = 1;   // DAQmx_Val_ChanForAllLines
inline constexpr std::uint32_t kDaqByChannel = 0;         // DAQmx_Val_GroupByChannel

struct DaqFunctions {
  std::int32_t (*create_task)(const char* name, DaqTask*);
  std::int32_t (*start_task)(DaqTask);
  std::int32_t (*clear_task)(DaqTask);
  std::int32_t (*ai_voltage)(DaqTask, const char* channels, const char* name,
                             std::int32_t terminals, double low, double high, std::int32_t units,
                             const char* scale);
  std::int32_t (*ao_voltage)(DaqTask, const char* channel, const char* name, double low,
                             double high, std::int32_t units, const char* scale);
  std::int32_t (*di_lines)(DaqTask, const char* lines, const char* name, std::int32_t grouping);
  std::int32_t (*do_lines)(DaqTask, const char* lines, const char* name, std::int32_t grouping);
  std::int32_t (*read_analog)(DaqTask, std::int32_t samples, double timeout, std::uint32_t fill,
                              double* values, std::uint32_t room, std::int32_t* count,
                              std::uint32_t* reserved);
  std::int32_t (*write_analog)(DaqTask, std::uint32_t start, double timeout, double value,
                               std::uint32_t* reserved);
  std::int32_t (*read_lines)(DaqTask, std::int32_t samples, double timeout, std::uint32_t fill,
                             std::uint8_t* values, std::uint32_t room, std::int32_t* count,
                             std::int32_t* bytes, std::uint32_t* reserved);
  std::int32_t (*write_lines)(DaqTask, std::int32_t samples, std::uint32_t start, double timeout,
                              std::uint32_t layout, const std::uint8_t* values, std::int32_t* count,
                              std::uint32_t* reserved);
  std::int32_t (*error_text)(char* text, std::uint32_t room);
};

/// The name of the first function that the library does not have; null: all are there.
inline const char* look_up(void* library, DaqFunctions& f) {
  const char* missing = nullptr;
  const auto find = [&](auto& function, const char* name) {
    void* const found = dlsym(library, name);
    if (found == nullptr && missing == nullptr) missing = name;
    function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(found);
  };
  find(f.create_task, "DAQmxCreateTask");
  find(f.start_task, "DAQmxStartTask");
  find(f.clear_task, "DAQmxClearTask");
  find(f.ai_voltage, "DAQmxCreateAIVoltageChan");
  find(f.ao_voltage, "DAQmxCreateAOVoltageChan");
  find(f.di_lines, "DAQmxCreateDIChan");
  find(f.do_lines, "DAQmxCreateDOChan");
  find(f.read_analog, "DAQmxReadAnalogF64");
  find(f.write_analog, "DAQmxWriteAnalogScalarF64");
  find(f.read_lines, "DAQmxReadDigitalLines");
  find(f.write_lines, "DAQmxWriteDigitalLines");
  find(f.error_text, "DAQmxGetExtendedErrorInfo");
  return missing;
}

}  // namespace photocoag
