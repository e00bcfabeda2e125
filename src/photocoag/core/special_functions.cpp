#include "photocoag/core/special_functions.hpp"

#include <unsupported/Eigen/SpecialFunctions>

namespace photocoag {

double upper_gamma(double a, double x) { return Eigen::numext::igammac(a, x); }

}  // namespace photocoag
