// A stand-in for libnidaqmx: the twelve functions that the driver looks up, with the vendor's names
// and parameters, over one device without hardware.
#include "nidaqmx/fake_nidaqmx.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstring>

namespace {

FakeDaq daq;
int handles[4];
constexpr std::int32_t kNoDevice = -200220;    // DAQmxErrorInvalidDeviceID
constexpr std::int32_t kOutOfRange = -200077;  // DAQmxErrorInvalidAttributeValue
constexpr std::int32_t kWarning = 200015;

std::int32_t told(int kind, const char* channels) {
  std::snprintf(daq.channels[kind], sizeof(daq.channels[kind]), "%s", channels);
  return std::strncmp(channels, "Dev1/", 5) == 0 ? 0 : kNoDevice;
}
std::int32_t waits(double timeout) {
  daq.patience = std::max(daq.patience, timeout);
  return daq.gone ? kNoDevice : 0;
}

}  // namespace

extern "C" {

FakeDaq* fake_daq() { return &daq; }

std::int32_t DAQmxCreateTask(const char*, void** task) {
  *task = &handles[daq.tasks++ % 4];
  return 0;
}
std::int32_t DAQmxStartTask(void*) { return kWarning; }
std::int32_t DAQmxClearTask(void*) {
  --daq.tasks;
  return 0;
}
std::int32_t DAQmxCreateAIVoltageChan(void*, const char* channels, const char*, std::int32_t,
                                      double, double, std::int32_t, const char*) {
  return told(0, channels);
}
std::int32_t DAQmxCreateAOVoltageChan(void*, const char* channel, const char*, double, double,
                                      std::int32_t, const char*) {
  return told(1, channel);
}
std::int32_t DAQmxCreateDIChan(void*, const char* lines, const char*, std::int32_t) {
  return told(2, lines);
}
std::int32_t DAQmxCreateDOChan(void*, const char* lines, const char*, std::int32_t) {
  return told(3, lines);
}
std::int32_t DAQmxReadAnalogF64(void*, std::int32_t, double timeout, std::uint32_t, double* values,
                                std::uint32_t room, std::int32_t* count, std::uint32_t*) {
  if (room < 2) return kOutOfRange;
  values[0] = daq.temperature_V;
  values[1] = daq.relay == 1 ? daq.power_V : 0.0;
  *count = 1;
  return waits(timeout);
}
std::int32_t DAQmxWriteAnalogScalarF64(void*, std::uint32_t, double timeout, double value,
                                       std::uint32_t*) {
  if (!(value >= 0.0 && value <= 10.0)) return kOutOfRange;
  if (!daq.gone) daq.power_V = value;
  return waits(timeout);
}
std::int32_t DAQmxReadDigitalLines(void*, std::int32_t, double timeout, std::uint32_t,
                                   std::uint8_t* values, std::uint32_t room, std::int32_t* count,
                                   std::int32_t* bytes, std::uint32_t*) {
  if (room < 3) return kOutOfRange;
  values[0] = daq.relay;
  values[1] = daq.shutter;
  values[2] = daq.foot;
  *count = 1;
  *bytes = 3;
  return waits(timeout);
}
std::int32_t DAQmxWriteDigitalLines(void*, std::int32_t, std::uint32_t, double timeout,
                                    std::uint32_t, const std::uint8_t* values, std::int32_t* count,
                                    std::uint32_t*) {
  if (!daq.gone) {
    daq.relay = values[0];
    daq.alive = values[1];
  }
  *count = 1;
  return waits(timeout);
}
std::int32_t DAQmxGetExtendedErrorInfo(char* text, std::uint32_t room) {
  std::snprintf(text, room, "Device identifier is invalid.");
  return 0;
}
}
