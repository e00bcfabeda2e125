#include "photocoag/run/treat_into.hpp"

#include "photocoag/run/device_treatment.hpp"
#include "photocoag/run/eye_process.hpp"

namespace photocoag {

Use use_of(const TreatmentPlace& place) {
  if (place.device) return place.device->eye() ? Use::kTreatEye : Use::kTreatDriver;
  return place.pacing == Pacing::kClock ? Use::kTreat : Use::kSimulate;
}

Treatment treat_into(const std::filesystem::path& folder, const Config& controlled,
                     const TreatmentPlace& place, ModelStore& models, const std::atomic<bool>& stop,
                     std::atomic<std::size_t>& progress, const Onlooker& onlooker) {
  const std::filesystem::path log =
      place.pacing == Pacing::kClock ? folder / "log" : std::filesystem::path();
  if (!place.device) {
    return run_treatment(controlled, models, place.pacing, stop, progress, log, {}, onlooker);
  }
  DeviceAddress device = *place.device;
  std::optional<EyeProcess> eye;
  if (device.own_process) {
    std::vector<std::string> arguments;
    for (const std::string& fault : place.faults) {
      arguments.insert(arguments.end(), {"--fault", fault});
    }
    eye.emplace(folder / "config.toml", arguments);
    device.path = eye->socket();
  }
  return run_device_treatment(controlled, device, models, stop, progress, log, onlooker);
}

}  // namespace photocoag
