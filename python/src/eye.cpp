// Role: the Python package; the simulated eye stepped period by period, for a loop closed in Python
// (photocoag.envs). The same noise, delay and watchdog as in `simulate`.
#include <memory>
#include <optional>
#include <utility>
#include <variant>

#include "arrays.hpp"
#include "common.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/run/configured_eye.hpp"

namespace photocoag::python {
namespace {

class Eye {
 public:
  Eye(const Config& config, std::shared_ptr<Models> models)
      : config_(config), models_(std::move(models)) {
    reset(config.run.seed, config.plant.absorption_factor);
  }

  /// Tissue at ambient with this absorption factor; noise of this seed.
  void reset(std::uint64_t seed, double absorption_factor) {
    const AbsorptionFactors at(absorption_factor, config_.plant.choroid_factor);
    const EyeSettings settings = eye_settings(config_);
    const EyeModel eye = models_->eye();
    const double noise = config_.plant.noise;
    if (eye.full) {
      eye_.emplace<Full>(
          FullOrderPlant(eye.full, config_.plant.discretization, config_.control.period, at), noise,
          seed, settings);
    } else {
      eye_.emplace<Reduced>(ReducedPlant(*eye.reduced, at), noise, seed, settings);
    }
    cycle_ = 0;
  }

  /// One control period at this power, W.
  Reading step(double power) {
    const std::uint64_t cycle = cycle_++;
    const auto advance = [&](auto& eye) {
      eye.write(power);
      return eye.advance(cycle);
    };
    if (auto* full = std::get_if<Full>(&eye_)) return advance(*full);
    return advance(*std::get_if<Reduced>(&eye_));
  }

 private:
  using Full = SimulatedEye<FullOrderPlant>;
  using Reduced = SimulatedEye<ReducedPlant>;
  Config config_;
  std::shared_ptr<Models> models_;
  std::variant<std::monostate, Full, Reduced> eye_;
  std::uint64_t cycle_ = 0;
};

}  // namespace

void bind_eye(nb::module_& module) {
  nb::class_<Eye>(module, "Eye")
      .def("__init__",
           [](Eye* self, const OwnedConfig& owned, bool use_cache) {
             owned.require_simulation();
             if (owned.config().plant.bench.needs_intersample()) {
               throw Error(ErrorParts{.key = "plant",
                                      .problem = "this eye has no samples between the periods",
                                      .found = "lags, means or drift of the bench",
                                      .accepted = "none of them, or simulate()"});
             }
             const Config config = owned.config();
             std::shared_ptr<Models> models;
             interruptible(
                 [&](std::atomic<bool>&) { models = models_without_gil(config, use_cache, true); });
             new (self) Eye(config, std::move(models));
           })
      .def(
          "reset",
          [](Eye& self, std::uint64_t seed, nb::handle alpha) {
            const double factor = number_of("absorption_factor", alpha, "from 0.05 to 5");
            if (!(factor >= 0.05 && factor <= 5.0)) {
              refuse("absorption_factor", alpha, "from 0.05 to 5");
            }
            self.reset(seed, factor);
          },
          nb::arg("seed"), nb::arg("absorption_factor").none())
      .def(
          "step",
          [](Eye& self, nb::handle power) {
            const Reading reading =
                self.step(number_of("power", power, "a finite number of watts"));
            return nb::make_tuple(reading.sample.volume_temperature, reading.sample.applied_power,
                                  reading.truth.volume, reading.truth.peak);
          },
          nb::arg("power").none());
}

}  // namespace photocoag::python
