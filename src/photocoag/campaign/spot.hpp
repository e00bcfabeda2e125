// Role: offline; one virtual spot: its eye, its closed loop, its outcome. Used by campaign.
// Source: paper, Algorithm 1, on simulated eyes that differ. Units: SI inside, in the names at the
// boundary. Real-time promise: none. Threads: one SpotRunner per thread, one SpotModels for all.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "photocoag/campaign/campaign_file.hpp"
#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/rom/reduced_model.hpp"
#include "photocoag/run/tissue_margin.hpp"
#include "photocoag/run/treatment.hpp"

namespace photocoag {

/// A column of outcomes: name with unit, unit, meaning.
struct OutcomeColumn {
  std::string_view name;
  std::string_view unit;
  std::string_view meaning;
};

/// In the order of SpotRecord::outcomes.
const std::vector<OutcomeColumn>& outcome_columns();
/// Index of a column; precondition: it exists.
std::size_t outcome_index(std::string_view name);

/// One row of the table.
struct SpotRecord {
  std::uint64_t spot = 0;
  std::uint64_t noise_seed = 0;
  std::vector<double> inputs;
  std::vector<double> outcomes;  ///< NaN: no value
};

/// A spot as numbers, for the journal, the table and messages between ranks: spot and seed by their
/// bits, inputs, outcomes.
std::vector<double> to_block(const SpotRecord& record);
SpotRecord from_block(const double* block, std::size_t inputs);
std::size_t block_size(std::size_t inputs);

/// Models shared by all spots: the controller's model; the shared grid or the reduced eye.
struct SpotModels {
  ReducedModel controller;
  std::shared_ptr<const FullOrderModel> standing;  ///< null: the eye is reduced
  std::unique_ptr<ReducedModel> reduced_eye;
  double depth = 0.0;                  ///< m, of the shared grid
  std::optional<TissueMargin> margin;  ///< if the configuration declares [uncertainty]
};

/// Throws Error if the campaign's inputs do not fit its eye (tissue keys with a reduced one,
/// perfusion, layers that conduct differently).
SpotModels make_spot_models(const Campaign& campaign, bool use_cache);

class SpotRunner {
 public:
  SpotRunner(const Campaign& campaign, const SpotModels& models);

  SpotRecord run(std::uint64_t spot);
  /// The last run: its treatment and its configuration.
  const Treatment& treatment() const noexcept { return treatment_; }
  const Config& config() const noexcept { return config_; }

 private:
  const Campaign& campaign_;
  const SpotModels& models_;
  Config config_;  // in place: the setter points into it
  InputSetter setter_;
  Treatment treatment_;
};

}  // namespace photocoag
