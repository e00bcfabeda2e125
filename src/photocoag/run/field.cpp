#include "photocoag/run/field.hpp"

#include <algorithm>

#include "photocoag/core/files.hpp"
#include "photocoag/fom/layered_stepper.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/mor/reconstruct.hpp"

namespace photocoag {
namespace {

using Eigen::MatrixXd;

TemperatureField field_of(const FullOrderModel& full, const MatrixXd& cells, double time) {
  TemperatureField field;
  field.radius_m = full.grid().radial.faces;
  field.depth_m = full.grid().axial.faces;
  field.temperature_rise_K.resize(static_cast<std::size_t>(cells.size()));
  std::transform(cells.data(), cells.data() + cells.size(), field.temperature_rise_K.begin(),
                 [](double value) { return static_cast<float>(value); });
  field.time_s = time;
  field.spot_radius_m = full.tissue().spot_radius;
  double depth = 0.0;
  for (const Layer& layer : full.tissue().layers) {
    depth += layer.thickness;
    field.layer_back_m.push_back(depth);
    field.layer_names.push_back(layer.name);
  }
  return field;
}

// Steps through the powers and asks for the cells at the wanted instants.
template <typename Step, typename Cells>
std::vector<TemperatureField> collect(const FullOrderModel& full, double period,
                                      const std::vector<double>& powers,
                                      const std::vector<std::size_t>& after, const Step& step,
                                      const Cells& cells) {
  std::vector<TemperatureField> fields;
  std::size_t done = 0;
  for (const std::size_t wanted : after) {
    for (; done < wanted; ++done) step(powers[done]);
    fields.push_back(field_of(full, cells(), static_cast<double>(done) * period));
  }
  return fields;
}

}  // namespace

std::vector<TemperatureField> temperature_fields(const std::shared_ptr<const FullOrderModel>& full,
                                                 FieldModel model, const Config& config,
                                                 const std::vector<double>& powers,
                                                 const std::vector<std::size_t>& after) {
  const double period = config.control.period;
  const AbsorptionFactors absorption = config.plant.absorption();
  const Discretization how = config.plant.discretization;
  if (model == FieldModel::kFull && !full->separable()) {
    LayeredStepper stepper(full, how, period, absorption);
    return collect(
        *full, period, powers, after, [&](double power) { stepper.step(power); },
        [&] { return stepper.temperatures(); });
  }
  if (model == FieldModel::kFull) {
    ModalStepper stepper(full, how, period);
    return collect(
        *full, period, powers, after, [&](double power) { stepper.step(power); },
        [&] { return stepper.temperatures(absorption); });
  }
  const ReconstructingModel reduced =
      reconstructing_model(*full, config.model.reduction, period, how);
  ParametricMatrices matrices;
  reduced.model.evaluate(absorption, matrices);
  Eigen::VectorXd state = Eigen::VectorXd::Zero(reduced.model.order());
  return collect(
      *full, period, powers, after,
      [&](double power) { state = (reduced.model.A_d * state + matrices.input * power).eval(); },
      [&] { return reconstruct(*full, reduced, state); });
}

void write_field(const std::filesystem::path& folder, const Config& config,
                 const Treatment& treatment, ModelStore& models) {
  const auto& records = treatment.records;
  if (records.empty() || config.plant.model != PlantModel::kFull) return;
  std::vector<double> powers;
  for (const CycleRecord& record : records) powers.push_back(record.power);
  const auto hottest = std::max_element(
      records.begin(), records.end(),
      [](const CycleRecord& a, const CycleRecord& b) { return a.truth.peak < b.truth.peak; });
  const auto cycles = static_cast<std::size_t>(hottest - records.begin()) + 1;
  write_file(folder / "field.vtr", to_vtr(temperature_fields(models.plant_full(), FieldModel::kFull,
                                                             config, powers, {cycles})
                                              .front()));
}

}  // namespace photocoag
