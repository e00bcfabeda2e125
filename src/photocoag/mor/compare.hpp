// Role: offline; the error of every reduction method over the order, on the same runs. Used by
// `reduce --compare`.
// Source: paper, section 2 (global basis and DEIM found superior to the Taylor series).
// Units: relative errors as in ErrorReport.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "photocoag/mor/reduce.hpp"

namespace photocoag {

struct ComparisonRow {
  ReductionSettings settings;
  double peak = 0.0;    ///< largest relative error over all alphas and both powers
  double volume = 0.0;  ///< the same
  std::string refused;  ///< why the model could not be made, or why verify() rejects it; else empty
};

struct Comparison {
  std::vector<ComparisonRow> methods;      ///< each method as projected, then the default
  std::vector<ComparisonRow> dependences;  ///< POD basis, order 14: each dependence, 2 … 8 terms

  /// Largest of both outputs' errors; NaN if there is no such row or model.
  double error(ReductionMethod method, int order) const;
  double error(ParameterDependence dependence, int terms) const;
};

/// Alphas 0.30, 0.35, … 1.70, none of which is used in training; constant and random on/off power.
Comparison compare_reductions(std::shared_ptr<const FullOrderModel> full, double period,
                              Discretization discretization, const Progress& progress = {});

}  // namespace photocoag
