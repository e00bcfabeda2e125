// Role: the Python package; configurations with their sources, models of a configuration, and work
// that Ctrl-C can stop. Units: SI inside. Threads: the GIL is held on entry and
// on return; work() runs without it.
#pragma once

#include <nanobind/nanobind.h>

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/config/reader.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/treatment.hpp"

namespace photocoag::python {

namespace nb = nanobind;

/// "key=value" and the folder to which a relative path in it refers.
struct Override {
  std::string option;
  std::string folder;
};

/// A configuration with its source, so that a later override has the same meaning as `--set`.
class OwnedConfig {
 public:
  /// `text`: TOML; `name`: file name in messages. Throws Error.
  OwnedConfig(std::string text, std::string name, std::string folder,
              std::vector<Override> overrides);

  OwnedConfig with(const std::vector<Override>& more) const;
  /// Throws Error if the configuration cannot be simulated in virtual time.
  void require_simulation() const;

  const Config& config() const noexcept { return config_; }
  const std::string& text() const noexcept { return text_; }
  const std::string& name() const noexcept { return name_; }
  const std::string& folder() const noexcept { return folder_; }
  const std::vector<Override>& overrides() const noexcept { return overrides_; }

 private:
  std::string text_, name_, folder_;
  std::vector<Override> overrides_;
  Places places_;  // filled while config_ is constructed
  Config config_;
};

/// Models shared by the simulations of one configuration. Immutable except the store.
struct Models {
  std::unique_ptr<ModelStore> store;  ///< under `mutex` after construction
  std::mutex mutex;
  const ReducedModel* reduced = nullptr;
  std::optional<ReducedModel> reduced_eye;

  EyeModel eye() const;
};

/// The models of a configuration, kept in memory between calls; `eye` false: without that of the
/// simulated eye. Called without the GIL. Throws Error.
std::shared_ptr<Models> models_without_gil(const Config& config, bool use_cache, bool eye);

/// controller_config(), kept in memory: its search takes up to minutes. Called without the GIL.
Config cached_controller_config(const Config& config, const ReducedModel& model);

/// Runs `work(stop)` on its own thread without the GIL; meanwhile checks for signals (Ctrl-C sets
/// `stop`, waits for the end and raises KeyboardInterrupt) and calls `watch` several times a
/// second. Rethrows exceptions of the work.
void interruptible(const std::function<void(std::atomic<bool>& stop)>& work,
                   const std::function<void()>& watch = {});

void bind_config(nb::module_& module);
void bind_models(nb::module_& module);
void bind_controller(nb::module_& module);
void bind_run(nb::module_& module);
void bind_many(nb::module_& module);
void bind_eye(nb::module_& module);
void bind_certify(nb::module_& module);

}  // namespace photocoag::python
