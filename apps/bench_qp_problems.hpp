// Role: the program; the problems of `photocoag bench qp`, recorded in closed loops of the default
// controller on the full-order eye, with exact answers. Units: SI.
#pragma once

#include <memory>
#include <vector>

#include "bench.hpp"
#include "photocoag/benchmark/problem_set.hpp"
#include "photocoag/benchmark/recording.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/fom/full_order_model.hpp"

namespace photocoag {

inline constexpr double kBenchAlphas[] = {0.35, 0.7363, 1.1, 1.5};
inline constexpr int kBenchCycles = 250;

struct Problems {
  Config config;
  WeightChoice weights;
  ReducedModel model;
  std::vector<RecordedLoop> loops;
  std::vector<std::vector<double>> exact_power;  // W, by loop and cycle; NaN: no reference
};

/// A closed loop for each alpha. `full` is created by the first call.
Problems record_problems(int horizon, const WeightChoice& weights,
                         std::shared_ptr<const FullOrderModel>& full);

/// Appends min 1/2 u' H u + g' u, lower <= u <= upper, G u <= limit; matrices by rows, u in units
/// of u_max. Every cycle, or `thinned`: the first 25 of a loop and then every tenth.
void export_problems(const Problems& problems, bool thinned, Json& out);

}  // namespace photocoag
