// The full-order model against exact step responses that know no grid.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <memory>

#include "photocoag/core/step_response.hpp"
#include "photocoag/fom/stepper.hpp"
#include "support/oracle.hpp"

namespace photocoag {
namespace {

using testing::oracle_cases;
using testing::OracleCase;
using testing::OracleRow;
using testing::read_oracle;

std::vector<Outputs> step_response(const std::shared_ptr<const FullOrderModel>& model, double alpha,
                                   const std::vector<double>& times, double power) {
  FullOrderPlant plant(model, Discretization::kZeroOrderHold, 1e-3, alpha, 0.0);
  return sample_step_response(plant, Discretization::kZeroOrderHold, 1e-3, power, times);
}

std::vector<double> times_of(const std::vector<OracleRow>& rows) {
  std::vector<double> times;
  for (const OracleRow& row : rows) times.push_back(row.time);
  return times;
}

// What is promised: 0.05 % from 0.5 ms on, 0.1 % at 0.25 ms where the front of the heat is
// thinnest, 0.2 % at 1 s where the heat has noticed that the domain ends at 2 mm and the oracle's
// does not.
double tolerance(double time) {
  if (time < 0.5e-3) return 1e-3;
  return time > 0.5 ? 2e-3 : 5e-4;
}

TEST(Oracle, EveryFileHasACase) {
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(testing::oracle_folder())) {
    files += entry.path().extension() == ".csv" ? 1 : 0;
  }
  EXPECT_EQ(files, oracle_cases().size());
}

TEST(Oracle, StepResponsesAgree) {
  double worst = 0.0;
  for (const OracleCase& oracle : oracle_cases()) {
    const std::vector<OracleRow> rows = read_oracle(oracle.file);
    ASSERT_GE(rows.size(), 10U);
    const auto raw = std::make_shared<const FullOrderModel>(oracle.tissue, GridSettings{});
    const auto normalized =
        std::make_shared<const FullOrderModel>(testing::normalized(oracle.tissue), GridSettings{});
    ASSERT_GE(raw->states(), 80000U);
    // 0.05 W and not 1 W: the response is per watt.
    const auto outputs = step_response(raw, oracle.alpha, times_of(rows), 0.05);
    const auto normalized_outputs = step_response(normalized, oracle.alpha, times_of(rows), 0.05);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      SCOPED_TRACE(oracle.file + ", t = " + std::to_string(rows[i].time));
      const double allowed = tolerance(rows[i].time);
      const double errors[3] = {
          outputs[i].peak / (0.05 * rows[i].peak) - 1.0,
          outputs[i].volume / (0.05 * rows[i].volume) - 1.0,
          normalized_outputs[i].volume / (0.05 * rows[i].volume_normalized) - 1.0};
      for (const double error : errors) {
        EXPECT_LT(std::abs(error), allowed);
        if (rows[i].time >= 0.5e-3 && rows[i].time < 0.5) worst = std::max(worst, std::abs(error));
      }
      EXPECT_DOUBLE_EQ(normalized_outputs[i].peak, outputs[i].peak);
    }
  }
  RecordProperty("worst_relative_error", std::to_string(worst));
}

// Three nested grids against the exact values. Times at which neither the finite radius nor the
// oracle's last digit shows beside the grid's error.
TEST(Oracle, SpatialOrderIsTwo) {
  for (const OracleCase& oracle : {oracle_cases()[1], oracle_cases()[3]}) {
    std::vector<OracleRow> rows;
    for (const OracleRow& row : read_oracle(oracle.file)) {
      if (row.time >= 0.9e-3 && row.time <= 0.11) rows.push_back(row);
    }
    Grid grid = make_grid(oracle.tissue, {.min_cells = 6000});
    std::vector<double> error[2];  // root mean square over the times, peak and volume, per grid
    for (int level = 0; level < 3; ++level) {
      const auto model = std::make_shared<const FullOrderModel>(oracle.tissue, grid);
      const auto outputs = step_response(model, oracle.alpha, times_of(rows), 1.0);
      double peak = 0.0;
      double volume = 0.0;
      for (std::size_t i = 0; i < rows.size(); ++i) {
        peak += std::pow(outputs[i].peak / rows[i].peak - 1.0, 2);
        volume += std::pow(outputs[i].volume / rows[i].volume - 1.0, 2);
      }
      error[0].push_back(std::sqrt(peak / static_cast<double>(rows.size())));
      error[1].push_back(std::sqrt(volume / static_cast<double>(rows.size())));
      grid = refined(grid);
    }
    for (int output = 0; output < 2; ++output) {
      for (int level = 0; level < 2; ++level) {
        const double order = std::log2(error[output][level] / error[output][level + 1]);
        EXPECT_GE(order, 1.8) << oracle.file << " output " << output << " level " << level;
        EXPECT_LE(order, 2.3) << oracle.file << " output " << output << " level " << level;
      }
    }
  }
}

}  // namespace
}  // namespace photocoag
