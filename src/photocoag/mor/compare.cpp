#include "photocoag/mor/compare.hpp"

#include <algorithm>
#include <limits>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

constexpr int kFirstOrder = 2;
constexpr int kLastOrder = 14;
constexpr int kFirstTerms = 2;
constexpr int kLastTerms = 8;

ComparisonRow compare_one(const FullOrderModel& full, const ImpulseSpace& space,
                          const ValidationRun& run, const ReductionSettings& settings,
                          double period, Discretization discretization) {
  ComparisonRow row{.settings = settings, .refused = {}};
  try {
    const ReducedModel model = project_model(full, space, settings, period, discretization);
    const ErrorReport error = measure_error(model, run);
    row.peak = error.peak_max();
    row.volume = error.volume_max();
    verify(model);  // a model that a controller would refuse still shows its error
  } catch (const Error& error) {
    row.refused = error.what();
  }
  return row;
}

template <typename Matches>
double largest_error(const std::vector<ComparisonRow>& rows, Matches matches) {
  const auto row = std::find_if(rows.begin(), rows.end(), matches);
  if (row == rows.end() || row->peak == 0.0) return std::numeric_limits<double>::quiet_NaN();
  return std::max(row->peak, row->volume);
}

}  // namespace

double Comparison::error(ReductionMethod method, int order) const {
  return largest_error(methods, [&](const ComparisonRow& row) {
    return row.settings.method == method && row.settings.order == order &&
           row.settings.refinement == Refinement::kNone;
  });
}

double Comparison::error(ParameterDependence dependence, int terms) const {
  return largest_error(dependences, [&](const ComparisonRow& row) {
    return row.settings.parameter_dependence == dependence && row.settings.parameter_terms == terms;
  });
}

Comparison compare_reductions(std::shared_ptr<const FullOrderModel> full, double period,
                              Discretization discretization, const Progress& progress) {
  const auto report = [&progress](std::string_view stage, double fraction) {
    if (progress) progress(stage, fraction);
  };
  report("collecting impulse responses", 0.0);
  const ImpulseSpace space = reduction_space(*full);
  const ValidationRun run = validation_run(full, discretization, period);
  std::vector<ReductionSettings> wanted;
  for (std::size_t m = 0; m < kReductionMethodWords.size(); ++m) {
    for (int order = kFirstOrder; order <= kLastOrder; ++order) {
      wanted.push_back({.method = static_cast<ReductionMethod>(m),
                        .order = order,
                        .refinement = Refinement::kNone});
    }
  }
  for (int order = kFirstOrder; order <= kLastOrder; ++order) wanted.push_back({.order = order});
  const std::size_t methods = wanted.size();
  for (std::size_t d = 0; d < kParameterDependenceWords.size(); ++d) {
    for (int terms = kFirstTerms; terms <= kLastTerms; ++terms) {
      wanted.push_back({.order = kLastOrder,
                        .parameter_dependence = static_cast<ParameterDependence>(d),
                        .parameter_terms = terms,
                        .refinement = Refinement::kNone});
    }
  }
  Comparison comparison;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    report("measuring errors",
           0.2 + 0.8 * static_cast<double>(i) / static_cast<double>(wanted.size()));
    auto& rows = i < methods ? comparison.methods : comparison.dependences;
    rows.push_back(compare_one(*full, space, run, wanted[i], period, discretization));
  }
  report("done", 1.0);
  return comparison;
}

}  // namespace photocoag
