// Role: the program; summary line of a reduced model for `treat`, `simulate` and `reduce`.
#pragma once

#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

/// Method, order, period and the largest errors, in one line.
void print_error_report(const ReducedModel& model);

}  // namespace photocoag
