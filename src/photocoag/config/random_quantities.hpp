// Role: setup; reads and checks random quantities; their correlation and moments. Used by config,
// population. Source: N. L. Johnson, S. Kotz, N. Balakrishnan, Continuous Univariate Distributions
// 1 (truncated normal). Units: those of the keys. Real time: no.
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
  bool of_controller = false;     ///< a prior: has `use`, and every quantity needs a spread
};
inline constexpr PriorTables kPriorTables{"prior", "prior_correlation", true};
inline constexpr PriorTables kInputTables{"input", "correlation", false};

/// Reads both arrays below `root`; absent: none. Checks words, ranges and that every key occurs
/// once, but not the keys' meaning. Throws Error naming file:line, key, what was found and what is
/// accepted.
Prior read_prior(const Value& root, const PriorTables& tables);

/// Correlation of the normal scores, in the order of the quantities. Throws Error if it is not
/// positive definite or names another quantity.
Eigen::MatrixXd correlation_matrix(const Prior& prior, const PriorTables& tables);

struct Moments {
  double mean = 0.0;
  double deviation = 0.0;
};

/// Moments of the quantity, or of its natural logarithm (needs low > 0), truncation included.
Moments moments(const RandomQuantity& quantity);
Moments log_moments(const RandomQuantity& quantity);

/// The variable behind a key of the eye.
struct EyeNumber {
  double* value = nullptr;
  double scale = 1.0;  ///< SI = written * scale
};
/// For a key "plant.…", layers by name. Points into `config`. nullopt: not a number of the eye.
std::optional<EyeNumber> eye_number(Config& config, std::string_view key);

/// Throws Error naming "prior.KEY" unless the multi-parameter model carries every quantity and the
/// configuration is valid with all quantities at `low` and with all at `high`.
void validate_prior(const Config& config);

}  // namespace photocoag
