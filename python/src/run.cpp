// Role: the Python package; one treatment, simulated or paced by the clock, with a user's parts.
#include <fmt/format.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>

#include <memory>
#include <optional>
#include <utility>

#include "arrays.hpp"
#include "common.hpp"
#include "controllers.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/log/fields.hpp"
#include "photocoag/report/report.hpp"
#include "photocoag/rom/intersample.hpp"
#include "photocoag/run/field.hpp"
#include "photocoag/run/run_csv.hpp"
#include "photocoag/run/run_folder.hpp"
#include "run.hpp"
#include "user_parts.hpp"

namespace photocoag::python {
namespace {

bool with_choroid(const Config& config) {
  return config.estimator.unknowns == Unknowns::kRpeAndChoroid;
}

bool is_column(const CycleField& field, const OwnedRun& run) {
  return field.in_csv == InCsv::kYes || field.in_csv == InCsv::kMayBeEmpty ||
         (field.in_csv == InCsv::kWithChoroid && with_choroid(run.config)) ||
         (field.in_csv == InCsv::kWithDevice && run.treatment.device);
}

// All words of an enumeration; codes beyond its last map to the first.
nb::list words_of(const CycleField& field) {
  nb::list words;
  for (std::uint64_t code = 0; code < 64 && (code == 0 || field.word(code) != field.word(0));
       ++code) {
    const std::string_view word = field.word(code);
    words.append(nb::str(word.data(), word.size()));
  }
  return words;
}

// (name, unit, values, words) of the wanted fields: float64, int64, or codes with their words.
template <typename Wanted, typename RecordAt>
nb::list columns_of(Wanted wanted, std::size_t cycles, RecordAt record_at) {
  nb::list list;
  for (const CycleField& field : cycle_fields()) {
    if (!wanted(field)) continue;
    const nb::str name(field.name.data(), field.name.size());
    const nb::str unit(field.unit.data(), field.unit.size());
    std::vector<std::uint64_t> bits(cycles);
    for (std::size_t i = 0; i < cycles; ++i) bits[i] = field.get(record_at(i));
    const bool real = field.type == FieldType::kReal;
    const nb::object values =
        real ? array_of(reinterpret_cast<const double*>(bits.data()), {cycles})
             : array_of(reinterpret_cast<const std::int64_t*>(bits.data()), {cycles});
    list.append(nb::make_tuple(
        name, unit, values,
        field.type == FieldType::kWord ? nb::object(words_of(field)) : nb::object(nb::none())));
  }
  return list;
}

nb::list columns(const OwnedRun& run) {
  const std::vector<CycleRecord>& records = run.treatment.records;
  return columns_of([&](const CycleField& field) { return is_column(field, run); }, records.size(),
                    [&](std::size_t i) { return LogRecord(records[i], CycleEnd{}); });
}

// The columns of a run.csv of this or an earlier version.
nb::list read_columns(const std::string& file) {
  const RunCsv run = read_run_csv(file);
  for (const char* column : {"cycle", "time_s", "power_W"}) run.require(column);
  return columns_of([&](const CycleField& field) { return run.has(field.name); }, run.cycles.size(),
                    [&](std::size_t i) -> const LogRecord& { return run.cycles[i]; });
}

void save(OwnedRun& run, const std::string& folder) {
  const nb::gil_scoped_release release;
  const ClaimedFolder claimed = open_run_folder(folder, run.config);
  write_run(claimed.path(), run.config, run.treatment);
  if (run.models) {
    const std::lock_guard lock(run.models->mutex);
    write_field(claimed.path(), run.config, run.treatment, *run.models->store);
  }
  write_report(claimed.path());
}

// Python parts are called on this thread with the GIL; Ctrl-C interrupts them.
template <typename M>
void with_python_parts(OwnedRun& run, const Config& controlled, nb::handle controller,
                       nb::handle estimator, nb::handle plant, const Models& models) {
  std::atomic<bool> stop{false};
  std::atomic<std::size_t> progress{0};
  Failure failure(stop);
  UserParts own;
  std::optional<PythonPlant> python_plant;
  if (nb::isinstance<FullOrderPlant>(plant)) {
    own.plant.emplace(nb::cast<FullOrderPlant&>(plant));
  } else if (nb::isinstance<ReducedPlant>(plant)) {
    own.plant.emplace(nb::cast<ReducedPlant&>(plant));
  } else if (!plant.is_none()) {
    own.plant.emplace(python_plant.emplace(plant, failure));
  }
  const EyeModel eye = own.plant ? EyeModel{} : models.eye();
  const ReducedModel model = controller_model(*models.reduced, controlled.estimator.timing);
  const auto simulate = [&](auto& part) {
    own.controller.emplace(part);
    run.treatment = simulate_with(controlled, *models.reduced, eye, own, stop, progress);
    failure.rethrow();
  };
  // With the controller's own estimator or the built-in one.
  const auto with_filter = [&](auto filter) {
    using F = decltype(filter);
    if (!controller.is_none()) {
      PythonController<F> part(controller, std::move(filter), controlled.control.power_max,
                               failure);
      return simulate(part);
    }
    BasicController<M, F> part(model, controlled.control, controlled.estimator, std::move(filter));
    simulate(part);
  };
  if (nb::isinstance<OwnedController>(controller)) {
    own.controller.emplace(nb::cast<OwnedController&>(controller).part());
    run.treatment = simulate_with(controlled, *models.reduced, eye, own, stop, progress);
    failure.rethrow();
  } else if (nb::isinstance<OwnedEstimator>(estimator)) {
    with_filter(nb::cast<OwnedEstimator&>(estimator).filter);
  } else if (!estimator.is_none()) {
    if (controlled.control.robust == Robustness::kChance && controller.is_none()) {
      throw Error(ErrorParts{.key = "control.robust",
                             .problem = "a user's estimator has no quantiles",
                             .found = "\"chance\"",
                             .accepted = "\"none\", \"certified\", or photocoag.Estimator"});
    }
    with_filter(PythonEstimator(estimator, model, controlled.estimator, failure));
  } else {
    with_filter(AnyEstimator(model, controlled.estimator));
  }
}

void with_parts(OwnedRun& run, const Config& controlled, nb::handle controller,
                nb::handle estimator, nb::handle plant, const Models& models) {
#if PHOTOCOAG_HAS_OSQP
  if (controlled.control.solver == SolverKind::kOsqp) {
    return with_python_parts<SparseOsqpController>(run, controlled, controller, estimator, plant,
                                                   models);
  }
  if (controlled.control.solver == SolverKind::kOsqpCondensed) {
    return with_python_parts<CondensedOsqpController>(run, controlled, controller, estimator, plant,
                                                      models);
  }
#endif
  with_python_parts<ModelPredictiveController<DenseSolver>>(run, controlled, controller, estimator,
                                                            plant, models);
}

std::shared_ptr<OwnedRun> simulate(const OwnedConfig& owned, nb::handle controller,
                                   nb::handle estimator, nb::handle plant, bool use_cache) {
  owned.require_simulation();
  auto run = std::make_shared<OwnedRun>();
  run->config = owned.config();
  const bool own = !controller.is_none() || !estimator.is_none() || !plant.is_none();
  interruptible([&](std::atomic<bool>& stop) {
    run->models = models_without_gil(run->config, use_cache, plant.is_none());
    if (!own) *run = simulated(run->config, run->models, stop);
    if (own) run->controlled = cached_controller_config(run->config, *run->models->reduced);
  });
  if (!own) return run;
  with_parts(*run, run->controlled, controller, estimator, plant, *run->models);
  if (!plant.is_none()) run->models = nullptr;  // no temperature field to write
  return run;
}

std::shared_ptr<OwnedRun> treat(const OwnedConfig& owned, bool use_cache) {
  owned.require_simulation();
  auto run = std::make_shared<OwnedRun>();
  run->config = owned.config();
  interruptible([&](std::atomic<bool>& stop) {
    require_real_time(run->config);
    run->models = models_without_gil(run->config, use_cache, true);
    run->controlled = cached_controller_config(run->config, *run->models->reduced);
    std::atomic<std::size_t> progress{0};
    const std::lock_guard lock(run->models->mutex);
    run->treatment =
        run_treatment(run->controlled, *run->models->store, DeviceAddress(), stop, progress);
  });
  return run;
}

}  // namespace

OwnedRun simulated(const Config& config, const std::shared_ptr<Models>& models,
                   std::atomic<bool>& stop) {
  OwnedRun run;
  run.config = config;
  run.controlled = cached_controller_config(config, *models->reduced);
  run.models = models;
  std::atomic<std::size_t> progress{0};
  run.treatment =
      simulate_with(run.controlled, *models->reduced, models->eye(), {}, stop, progress);
  return run;
}

void bind_run(nb::module_& module) {
  nb::class_<OwnedRun>(module, "Run")
      .def("columns", &columns)
      .def("to_csv",
           [](const OwnedRun& run) { return run_csv(run.treatment, with_choroid(run.config)); })
      .def("summary_json",
           [](const OwnedRun& run) { return summary_json(run.config, run.treatment); })
      .def("config_toml", [](const OwnedRun& run) { return to_toml(run.config); })
      .def_prop_ro("wall_seconds", [](const OwnedRun& run) { return run.treatment.wall_seconds; })
      .def("save", &save);
  module.def("simulate", &simulate, nb::arg("config"), nb::arg("controller").none(),
             nb::arg("estimator").none(), nb::arg("plant").none(), nb::arg("use_cache"));
  module.def("read_columns", &read_columns, nb::arg("file"));
  module.def("treat", &treat, nb::arg("config"), nb::arg("use_cache"));
}

}  // namespace photocoag::python
