#include "photocoag/run/discretizations.hpp"

#include "photocoag/fom/stepper.hpp"

namespace photocoag {

std::vector<DiscretizationErrors> discretization_errors(
    const std::shared_ptr<const FullOrderModel>& full, AbsorptionFactors absorption,
    const std::vector<double>& periods, std::size_t steps) {
  const auto response = [&](Discretization how, double period) {
    FullOrderPlant plant(full, how, period, absorption);
    std::vector<Outputs> outputs;
    for (std::size_t k = 0; k < steps; ++k) {
      plant.step(1.0);
      outputs.push_back(plant.outputs());
    }
    return outputs;
  };
  std::vector<DiscretizationErrors> all;
  for (const double period : periods) {
    const std::vector<Outputs> exact = response(Discretization::kZeroOrderHold, period);
    for (const auto how : {Discretization::kImplicitEuler, Discretization::kTrBdf2}) {
      all.push_back({how, period, exact, response(how, period)});
    }
  }
  return all;
}

}  // namespace photocoag
