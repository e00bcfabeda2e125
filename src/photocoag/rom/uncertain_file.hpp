// Role: setup; the part of the model file that holds the responses over several uncertain
// quantities. Used by rom/file. Format: docs/model-file.md. read_uncertain throws Error naming the
// field.
#pragma once

#include "photocoag/rom/json_reader.hpp"
#include "photocoag/rom/uncertain_model.hpp"

namespace photocoag {

Json uncertain_to_json(const UncertainModel& model);
/// Validated (UncertainModel::validate); `tissue` and `period` come from elsewhere in the file.
UncertainModel read_uncertain(const JsonReader& json, const Tissue& tissue, double period);

}  // namespace photocoag
