// Role: offline; e_k(alpha) = full-order minus reduced impulse response, with what bounds it
// between the nodes of alpha. Used by the certificate. Source: docs/models.md (certificate). Units:
// K/W; the volume temperature before any normalisation.
#pragma once

#include <Eigen/Core>

#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/mor/pulse_response.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

/// One output of both models as a function of alpha at the nodes.
///   full     sum_j weight_j(alpha) p_k,j            over axial modes
///   reduced  Re sum_i coefficient_i(alpha) lambda_i^(k-1)
/// Second derivatives are exact; fourth derivatives and values are bounded over the whole range,
/// term by term.
struct OutputExpansion {
  Eigen::MatrixXd weight;         ///< nodes x axial modes
  Eigen::MatrixXd weight_second;  ///< d2 / dalpha2
  Eigen::VectorXd weight_bound;   ///< per axial mode, of |weight|
  Eigen::VectorXd weight_fourth;  ///< per axial mode, of |d4 / dalpha4|
  Eigen::MatrixXcd coefficient;   ///< nodes x states
  Eigen::MatrixXcd coefficient_second;
  Eigen::VectorXd coefficient_bound;   ///< per state, of |coefficient|
  Eigen::VectorXd coefficient_fourth;  ///< per state
};

/// Both outputs.
struct ErrorExpansion {
  OutputExpansion peak;
  OutputExpansion volume;
  Eigen::VectorXcd decay;  ///< lambda_i: eigenvalues of A_d
};

/// `nodes`: ascending, equidistant. Throws Error if A_d has no well-conditioned
/// eigenvectors. Allocates.
ErrorExpansion expand_error(const ReducedModel& reduced, const FullOrderModel& full,
                            const Eigen::VectorXd& nodes);

}  // namespace photocoag
