// Role: the Python package; work without the GIL that Ctrl-C can stop, and the models of a
// configuration kept between calls.
#include <fmt/format.h>

#include <chrono>
#include <condition_variable>
#include <exception>
#include <filesystem>
#include <list>
#include <thread>
#include <utility>

#include "common.hpp"
#include "photocoag/core/sha256.hpp"
#include "photocoag/rom/file.hpp"
#include "photocoag/run/tissue_margin.hpp"

namespace photocoag::python {
namespace {

constexpr std::size_t kKept = 8;  // full-order models of some MB each
constexpr auto kPoll = std::chrono::milliseconds(50);

// Cache of the most recent values by key.
template <typename T>
class Recent {
 public:
  template <typename Make>
  T get(const std::string& key, Make make) {
    const std::lock_guard lock(mutex_);
    for (auto entry = entries_.begin(); entry != entries_.end(); ++entry) {
      if (entry->first != key) continue;
      entries_.splice(entries_.begin(), entries_, entry);
      return entry->second;
    }
    entries_.emplace_front(key, make());
    if (entries_.size() > kKept) entries_.pop_back();
    return entries_.front().second;
  }

 private:
  std::mutex mutex_;
  std::list<std::pair<std::string, T>> entries_;
};

std::string file_stamp(const std::string& file) {
  if (file.empty()) return "";
  std::error_code error;
  const auto time = std::filesystem::last_write_time(file, error).time_since_epoch().count();
  return fmt::format("{} {} {}", file, time, std::filesystem::file_size(file, error));
}

// Key of the models: configurations with the same key share them.
std::string models_key(Config config, bool use_cache, bool eye) {
  const double period = config.control.period;
  const std::string file = file_stamp(config.model.file);
  config.control = ControlSettings{};
  config.control.period = period;
  config.safety = SafetySettings{};
  config.uncertainty = UncertaintySettings{};
  config.run = RunSettings{};
  config.plant.absorption_factor = 1.0;
  config.plant.choroid_factor = 1.0;
  config.plant.noise = 0.0;
  return fmt::format("{} {} {} {}", config_sha256(config), use_cache, eye, file);
}

}  // namespace

EyeModel Models::eye() const {
  if (reduced_eye) return {.full = nullptr, .reduced = &*reduced_eye};
  return {.full = store->plant_full(), .reduced = nullptr};
}

std::shared_ptr<Models> models_without_gil(const Config& config, bool use_cache, bool eye) {
  static Recent<std::shared_ptr<Models>> recent;
  return recent.get(models_key(config, use_cache, eye), [&] {
    auto models = std::make_shared<Models>();
    models->store = std::make_unique<ModelStore>(config, use_cache);
    models->reduced = &models->store->reduced();
    if (eye && config.plant.model == PlantModel::kFull) models->store->plant_full();
    if (eye && config.plant.model == PlantModel::kReduced) {
      models->reduced_eye = models->store->plant_reduced();
    }
    return models;
  });
}

Config cached_controller_config(const Config& config, const ReducedModel& model) {
  if (!wants_margin(config)) return config;
  static Recent<ControlSettings> recent;
  Config key = config;
  key.run.seed = 0;
  key.plant.model = PlantModel::kFull;
  key.plant.tissue = config.tissue;
  key.plant.tissue_differs = false;
  key.plant.absorption_factor = 1.0;
  key.plant.choroid_factor = 1.0;
  const std::string text = fmt::format("{} {}", config_sha256(key), sha256_hex(to_json(model)));
  Config result = config;
  result.control = recent.get(text, [&] { return controller_config(config, model).control; });
  return result;
}

void interruptible(const std::function<void(std::atomic<bool>& stop)>& work,
                   const std::function<void()>& watch) {
  std::atomic<bool> stop{false};
  std::exception_ptr failure;
  std::mutex mutex;
  std::condition_variable ended;
  bool done = false;
  const auto whole = [&] {
    try {
      work(stop);
    } catch (...) {
      failure = std::current_exception();
    }
    const std::lock_guard lock(mutex);
    done = true;
    ended.notify_one();
  };
  std::thread thread(whole);
  bool raised = false;
  for (bool over = false; !over;) {
    {
      const nb::gil_scoped_release release;
      std::unique_lock lock(mutex);
      over = ended.wait_for(lock, kPoll, [&] { return done; });
    }
    if (over || raised) continue;
    raised = PyErr_CheckSignals() != 0;
    try {
      if (!raised && watch) watch();
    } catch (nb::python_error& error) {
      error.restore();
      raised = true;
    }
    if (raised) stop = true;
  }
  thread.join();
  if (raised) nb::raise_python_error();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace photocoag::python
