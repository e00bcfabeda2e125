#include "bench_qp_problems.hpp"

#include <fmt/format.h>

#include <limits>

#include "photocoag/benchmark/qp_reference.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/run/model_cache.hpp"

namespace photocoag {
namespace {

using Exact = ModelPredictiveController<DenseSolver>;

template <typename Matrix>
Json numbers(const Matrix& matrix) {
  Json out = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) out.push_back(matrix(i, j));
  }
  return out;
}

}  // namespace

Problems record_problems(int horizon, const WeightChoice& weights,
                         std::shared_ptr<const FullOrderModel>& full) {
  Problems out{.config = load_config("", {fmt::format("control.horizon={}", horizon)}),
               .weights = weights,
               .model = {},
               .loops = {},
               .exact_power = {}};
  ControlSettings& control = out.config.control;
  control.state_weight = weights.state_weight;
  control.power_weight = weights.power_weight;
  control.power_change_weight = weights.power_change_weight;
  ModelStore models(out.config, true);
  out.model = models.reduced();
  if (!full) full = models.plant_full();
  for (const double alpha : kBenchAlphas) {
    SimulatedEye eye(FullOrderPlant(full, out.config.plant.discretization, control.period, alpha),
                     out.config.plant.noise, out.loops.size() + 1);
    out.loops.push_back(
        record_loop(out.model, control, out.config.estimator, eye, alpha, kBenchCycles));
    Exact exact(out.model, control);
    std::vector<double> powers;
    for (long long n = 0; n < kBenchCycles; ++n) {
      const RecordedCycle& c = out.loops.back().cycles[static_cast<std::size_t>(n)];
      exact.solve(c.state, c.input, n, c.previous_power);
      const auto truth = reference_minimizer(exact.problem(), exact.solution());
      powers.push_back(truth ? static_cast<double>(truth->power[0]) * control.power_max
                             : std::numeric_limits<double>::quiet_NaN());
    }
    out.exact_power.push_back(std::move(powers));
  }
  return out;
}

void export_problems(const Problems& problems, bool thinned, Json& out) {
  for (std::size_t l = 0; l < problems.loops.size(); ++l) {
    Exact exact(problems.model, problems.config.control);
    for (std::size_t n = 0; n < problems.loops[l].cycles.size(); ++n) {
      const RecordedCycle& c = problems.loops[l].cycles[n];
      exact.solve(c.state, c.input, static_cast<long long>(n), c.previous_power);
      if (thinned && n >= 25 && n % 10 != 0) continue;
      const QpProblem& qp = exact.problem();
      out.push_back({{"horizon", problems.config.control.horizon},
                     {"weights", problems.weights.name},
                     {"loop", l},
                     {"H", numbers(qp.hessian)},
                     {"g", numbers(qp.gradient)},
                     {"lower", numbers(qp.lower)},
                     {"upper", numbers(qp.upper)},
                     {"G", numbers(qp.rows)},
                     {"limit", numbers(qp.limit)},
                     {"u0", problems.exact_power[l][n] / problems.config.control.power_max}});
    }
  }
}

}  // namespace photocoag
