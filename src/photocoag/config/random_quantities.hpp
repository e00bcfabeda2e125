// Role: setup; random quantities read from tables and checked; their correlation and moments. Used
// by config, campaign, run. Source: N. L. Johnson, S. Kotz, N. Balakrishnan, Continuous Univariate
// Distributions 1 (truncated normal). Units: those of the keys. Real time: no.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>

#include "photocoag/config/config.hpp"
#include "photocoag/config/prior.hpp"
#include "photocoag/config/source.hpp"

namespace photocoag {

/// Two arrays of tables that declare random quantities.
struct PriorTables {
  std::string_view quantities;    ///< "prior" or "input"
  std::string_view correlations;  ///< "prior_correlation" or "correlation"
  bool of_controller = false;     ///< a prior: has `use`, and every quantity a spread
};
inline constexpr PriorTables kPriorTables{"prior", "prior_correlation", true};
inline constexpr PriorTables kInputTables{"input", "correlation", false};

/// Reads both arrays below `root`; absent: none. Checks words, ranges, and that every key is given
/// once; not what the keys mean. Throws Error naming file:line, key, what was found and what is
/// accepted.
Prior read_prior(const Value& root, const PriorTables& tables);

/// Correlation of the normal scores, in the order of the quantities. Throws Error if it is not
/// positive definite or names another quantity.
Eigen::MatrixXd correlation_matrix(const Prior& prior, const PriorTables& tables);

struct Moments {
  double mean = 0.0;
  double deviation = 0.0;
};

/// Of the quantity, or of its natural logarithm (low above 0), truncation included.
Moments moments(const RandomQuantity& quantity);
Moments log_moments(const RandomQuantity& quantity);

/// The variable behind a key that is a number of the eye.
struct EyeNumber {
  double* value = nullptr;
  double scale = 1.0;  ///< SI = written * scale
};
/// Of a key "plant.…", layers by name. `config` must stay in place. Nothing: no number of the eye.
std::optional<EyeNumber> eye_number(Config& config, std::string_view key);

/// Throws Error naming "prior.KEY" unless the several-parameter model carries every quantity and
/// the configuration is valid at all lows and at all highs.
void validate_prior(const Config& config);

}  // namespace photocoag
