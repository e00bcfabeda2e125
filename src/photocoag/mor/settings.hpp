// Role: setup; how a reduced model is made. Used by mor and the configuration. Equations and
// references of each choice: docs/models.md.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace photocoag {

struct Field;  // core/setting.hpp

/// What spans the reduced state space. In the order of kReductionMethodWords.
enum class ReductionMethod {
  kPodDeim,           ///< the paper's: one global POD basis of impulse responses over alpha
  kBalanced,          ///< dominant controllability modes over alpha, Galerkin
  kBalancedTwoSided,  ///< global balanced truncation, Petrov-Galerkin
  kIrka,              ///< rational Krylov spaces of IRKA at sampled alphas, concatenated
  kTaylor,            ///< the paper's group's earlier method: Taylor series about one alpha
};

inline constexpr std::array<std::string_view, 5> kReductionMethodWords{
    "pod-deim", "balanced", "balanced-two-sided", "irka", "taylor"};

constexpr std::string_view to_string(ReductionMethod method) noexcept {
  return kReductionMethodWords[static_cast<std::size_t>(method)];
}

/// How B and C_vol depend on alpha. In the order of kParameterDependenceWords.
enum class ParameterDependence {
  kDeim,       ///< discrete empirical interpolation, cells chosen greedily
  kQDeim,      ///< the same, cells chosen by a pivoted QR factorisation
  kChebyshev,  ///< interpolation at Chebyshev points of [0.2, 2]
  kTaylor,     ///< Taylor polynomial about alpha = 0.7363
};

inline constexpr std::array<std::string_view, 4> kParameterDependenceWords{"deim", "q-deim",
                                                                           "chebyshev", "taylor"};

constexpr std::string_view to_string(ParameterDependence dependence) noexcept {
  return kParameterDependenceWords[static_cast<std::size_t>(dependence)];
}

/// What follows the projection. In the order of kRefinementWords.
enum class Refinement {
  kOutputError,  ///< rates and weights fitted to the full-order model's responses (refine.hpp)
  kNone,         ///< nothing: the paper's model
};

inline constexpr std::array<std::string_view, 2> kRefinementWords{"output-error", "none"};

constexpr std::string_view to_string(Refinement refinement) noexcept {
  return kRefinementWords[static_cast<std::size_t>(refinement)];
}

struct ReductionSettings {
  ReductionMethod method = ReductionMethod::kPodDeim;
  int order = 6;  ///< states of the reduced model, 1 to 14
  /// Method kTaylor always uses its own series.
  ParameterDependence parameter_dependence = ParameterDependence::kDeim;
  int parameter_terms = 0;  ///< 1 to 12; 0: 8 for kChebyshev, else 5; two parameters: 12 and 8

  /// Method kBalancedTwoSided is no Galerkin projection and is never refined.
  Refinement refinement = Refinement::kOutputError;

  /// The range of beta in which the error is measured, for a tissue with layers that beta scales.
  double choroid_min = 0.5;  ///< 1, from 0.05
  double choroid_max = 2.0;  ///< 1, above choroid_min, up to 20

  /// The dependence and number of terms that are used.
  ParameterDependence dependence() const noexcept;
  int terms(bool two_parameters = false) const noexcept;
  bool refined() const noexcept;
  /// For people and files: "pod-deim, refined".
  std::string name() const;

  /// Throws Error naming the key ("model.…"), the value and the range.
  void validate() const;
  bool operator==(const ReductionSettings&) const = default;
};

/// The keys "model.…" of a reduction, bound to `settings`.
std::vector<Field> fields_of(ReductionSettings& settings);

}  // namespace photocoag
