// Role: the Python package; full-order and reduced models, their plants and step responses.
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>

#include <memory>
#include <utility>

#include "arrays.hpp"
#include "common.hpp"
#include "photocoag/core/step_response.hpp"
#include "photocoag/fom/sparse_system.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/rom/file.hpp"

namespace photocoag::python {
namespace {

constexpr const char* kFactor = "a number from 0.05 to 5 (alpha) or 20 (beta)";

AbsorptionFactors factors_of(nb::handle alpha, nb::handle beta) {
  const double a = number_of("absorption_factor", alpha, kFactor);
  const double b = number_of("choroid_factor", beta, kFactor);
  if (!(a >= 0.05 && a <= 5.0)) refuse("absorption_factor", alpha, "from 0.05 to 5");
  if (!(b >= 0.05 && b <= 20.0)) refuse("choroid_factor", beta, "from 0.05 to 20");
  return {a, b};
}

/// Continuous-time B(p) and C_volume(p).
struct Evaluated {
  Eigen::VectorXd input;
  Eigen::VectorXd volume;
};

Evaluated evaluate(const ReducedModel& model, AbsorptionFactors at) {
  TermVector value(model.terms());
  TermSlopes slope;
  model.theta.evaluate(at, value, slope);
  const double norm = model.volume_normalized ? model.whole.evaluate(at).value : 1.0;
  return {model.B * value, model.C_volume.transpose() * value / norm};
}

ParametricMatrices discrete(const ReducedModel& model, AbsorptionFactors at) {
  ParametricMatrices matrices;
  model.evaluate(at, matrices);
  return matrices;
}

/// (min, max) of a parameter; (1, 1) if the model does not have it.
nb::tuple range_of(const ReducedModel& model, std::size_t parameter) {
  const ParameterRange range =
      parameter < model.parameters.size() ? model.parameters[parameter] : ParameterRange{};
  return nb::make_tuple(range.min, range.max);
}

nb::object to_table(const ErrorReport& error) {
  nb::dict table;
  table["absorption_factor"] = array_of(error.absorption_factors);
  if (!error.choroid_factors.empty()) table["choroid_factor"] = array_of(error.choroid_factors);
  table["peak_relative"] = array_of(error.peak);
  table["volume_relative"] = array_of(error.volume);
  table["peak_relative_max"] = error.peak_max();
  table["volume_relative_max"] = error.volume_max();
  return table;
}

nb::object to_table(const std::optional<ErrorCertificate>& certificate) {
  if (!certificate) return nb::none();
  nb::dict table;
  table["peak_relative_max"] = certificate->peak.relative_max();
  table["volume_relative_max"] = certificate->volume.relative_max();
  table["treatment_duration_s"] = certificate->treatment_duration;
  table["peak_treatment_relative_max"] = certificate->peak.treatment_relative_max();
  table["volume_treatment_relative_max"] = certificate->volume.treatment_relative_max();
  return table;
}

void bind_reduced_model(nb::module_& module) {
  using Model = ReducedModel;
  nb::class_<Model>(module, "ReducedModel")
      .def_prop_ro("A", [](const Model& m) { return array_of(m.A); })
      .def_prop_ro("A_d", [](const Model& m) { return array_of(m.A_d); })
      .def_prop_ro("C_peak", [](const Model& m) { return array_of(m.C_peak); })
      .def(
          "B",
          [](const Model& m, nb::handle a, nb::handle b) {
            return array_of(evaluate(m, factors_of(a, b)).input);
          },
          nb::arg("absorption_factor").none(), nb::arg("choroid_factor").none())
      .def(
          "C_volume",
          [](const Model& m, nb::handle a, nb::handle b) {
            return array_of(evaluate(m, factors_of(a, b)).volume);
          },
          nb::arg("absorption_factor").none(), nb::arg("choroid_factor").none())
      .def(
          "B_d",
          [](const Model& m, nb::handle a, nb::handle b) {
            return array_of(discrete(m, factors_of(a, b)).input);
          },
          nb::arg("absorption_factor").none(), nb::arg("choroid_factor").none())
      .def_prop_ro("order", &Model::order)
      .def_ro("period", &Model::period)
      .def_prop_ro("parameters", [](const Model& m) { return m.parameters.size(); })
      .def_ro("method", &Model::method)
      .def_prop_ro("discretization",
                   [](const Model& m) { return std::string(to_string(m.discretization)); })
      .def_ro("full_order_states", &Model::full_order_states)
      .def_prop_ro("absorption_range", [](const Model& m) { return range_of(m, 0); })
      .def_prop_ro("choroid_range", [](const Model& m) { return range_of(m, 1); })
      .def_prop_ro("error", [](const Model& m) { return to_table(m.error); })
      .def_prop_ro("certificate", [](const Model& m) { return to_table(m.certificate); })
      .def("to_json", [](const Model& m) { return to_json(m); })
      .def("save", [](const Model& m, const std::string& path) { save_reduced_model(m, path); });
  module.def("load_model", &load_reduced_model, nb::call_guard<nb::gil_scoped_release>());
  module.def("model_from_json", [](const std::string& text, const std::string& where) {
    return from_json(text, where);
  });
  module.def("reduce", [](const OwnedConfig& config, bool use_cache) {
    std::shared_ptr<Models> models;
    const Config copy = config.config();
    interruptible([&](std::atomic<bool>&) { models = models_without_gil(copy, use_cache, false); });
    return *models->reduced;
  });
}

void bind_full_order_model(nb::module_& module) {
  using Model = FullOrderModel;
  nb::class_<Model>(module, "FullOrderModel")
      .def_prop_ro("states", &Model::states)
      .def_prop_ro("separable", &Model::separable)
      .def_prop_ro("radial_edges_m", [](const Model& m) { return array_of(m.grid().radial.faces); })
      .def_prop_ro("axial_edges_m", [](const Model& m) { return array_of(m.grid().axial.faces); })
      .def("sparse",
           [](const Model& m) {
             SparseSystem system = assemble_sparse_system(m);
             system.A.makeCompressed();
             const auto entries = static_cast<std::size_t>(system.A.nonZeros());
             const auto columns = static_cast<std::size_t>(system.A.outerSize()) + 1;
             return nb::make_tuple(array_of(system.E), array_of(system.A.valuePtr(), {entries}),
                                   array_of(system.A.innerIndexPtr(), {entries}),
                                   array_of(system.A.outerIndexPtr(), {columns}));
           })
      .def(
          "b",
          [](const Model& m, nb::handle a, nb::handle b) {
            return array_of(input_of_cells(m, factors_of(a, b)));
          },
          nb::arg("absorption_factor").none(), nb::arg("choroid_factor").none())
      .def("c_peak", [](const Model& m) { return array_of(peak_of_cells(m)); })
      .def(
          "c_volume",
          [](const Model& m, nb::handle a, nb::handle b) {
            return array_of(volume_of_cells(m, factors_of(a, b)));
          },
          nb::arg("absorption_factor").none(), nb::arg("choroid_factor").none());
  module.def("full_order_model", [](const OwnedConfig& config, bool plant) {
    const Config copy = config.config();
    const nb::gil_scoped_release release;
    return std::make_shared<Model>(plant ? copy.plant.tissue : copy.tissue, copy.grid);
  });
}

template <typename P>
void bind_plant(nb::module_& module, const char* name) {
  nb::class_<P>(
      module, name,
      "A simulated eye that starts cold: step(power), W, is one control period of constant "
      "power; outputs() is (volume_K, peak_K) at its end.")
      .def(
          "step",
          [](P& plant, nb::handle power) {
            plant.step(number_of("power", power, "a finite number of watts"));
          },
          nb::arg("power").none())
      .def("outputs", [](const P& plant) {
        const Outputs outputs = plant.outputs();
        return nb::make_tuple(outputs.volume, outputs.peak);
      });
}

nb::object response(const OwnedConfig& owned, double power, const std::vector<double>& times,
                    bool full, const ReducedModel* given, bool use_cache) {
  const Config config = owned.config();
  ascending_times(times);
  std::vector<Outputs> outputs;
  interruptible([&](std::atomic<bool>&) {
    if (full) {
      Config eye = config;
      eye.plant.model = PlantModel::kFull;
      ModelStore store(eye, use_cache);
      FullOrderPlant plant(store.plant_full(), config.plant.discretization, config.control.period,
                           config.plant.absorption(), 0.0);
      outputs = sample_step_response(plant, config.plant.discretization, config.control.period,
                                     power, times);
      return;
    }
    const ReducedModel model =
        given != nullptr ? *given : *models_without_gil(config, use_cache, false)->reduced;
    ReducedPlant plant(model, config.plant.absorption());
    outputs = sample_step_response(plant, model.discretization, model.period, power, times);
  });
  std::vector<double> peak, volume;
  for (const Outputs& one : outputs) {
    peak.push_back(one.peak);
    volume.push_back(one.volume);
  }
  nb::dict table;
  table["time_s"] = array_of(times);
  table["peak_K"] = array_of(peak);
  table["volume_K"] = array_of(volume);
  return table;
}

}  // namespace

void bind_models(nb::module_& module) {
  bind_reduced_model(module);
  bind_full_order_model(module);
  bind_plant<FullOrderPlant>(module, "FullOrderPlant");
  bind_plant<ReducedPlant>(module, "ReducedPlant");
  module.def("full_order_plant", [](const OwnedConfig& owned, bool use_cache) {
    Config config = owned.config();
    config.plant.model = PlantModel::kFull;
    std::shared_ptr<Models> models;
    interruptible(
        [&](std::atomic<bool>&) { models = models_without_gil(config, use_cache, true); });
    return FullOrderPlant(models->eye().full, config.plant.discretization, config.control.period,
                          config.plant.absorption());
  });
  module.def(
      "reduced_plant",
      [](const ReducedModel& model, nb::handle a, nb::handle b) {
        return ReducedPlant(model, factors_of(a, b));
      },
      nb::arg("model"), nb::arg("absorption_factor").none(), nb::arg("choroid_factor").none());
  module.def(
      "response",
      [](const OwnedConfig& config, nb::handle power, nb::handle times, const std::string& model,
         const ReducedModel* given, bool use_cache) {
        if (model != "full" && model != "reduced") {
          refuse("model", nb::str(model.c_str()), "\"full\" or \"reduced\"");
        }
        return response(config, number_of("power", power, "a finite number of watts"),
                        numbers_of("times", times, 0, "finite numbers from 0 to 10,000 s"),
                        model == "full", given, use_cache);
      },
      nb::arg("config"), nb::arg("power").none(), nb::arg("times").none(), nb::arg("model"),
      nb::arg("given").none(), nb::arg("use_cache"));
}

}  // namespace photocoag::python
