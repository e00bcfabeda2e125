// Role: tests; reduced models made quickly from a coarse grid, and their JSON taken apart.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "photocoag/core/sha256.hpp"
#include "photocoag/mor/reduce.hpp"
#include "photocoag/rom/file.hpp"

namespace photocoag::testing {

using Json = nlohmann::ordered_json;

inline std::shared_ptr<const FullOrderModel> coarse_full_model(const Tissue& tissue = {}) {
  return std::make_shared<const FullOrderModel>(tissue, GridSettings{.min_cells = 2000});
}

inline ReducedModel coarse_model(const Tissue& tissue = {}, double period = 1e-3,
                                 Discretization how = Discretization::kZeroOrderHold) {
  return reduce(coarse_full_model(tissue), {}, period, how);
}

/// The file's text again after a change, with a checksum that fits: what somebody who means it
/// would do.
inline std::string sealed(Json json) {
  json.erase("checksum");
  json["checksum"] = sha256_hex(json.dump());
  return json.dump(1) + "\n";
}

}  // namespace photocoag::testing
