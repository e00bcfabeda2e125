// Role: the Python package; the controller and the estimator that Python code may own and pass to
// `simulate`. Units: SI. Threads: one owner each.
#pragma once

#include <variant>

#include "photocoag/config/config.hpp"
#include "photocoag/loop/controller.hpp"
#include "photocoag/loop/user_parts.hpp"
#if PHOTOCOAG_HAS_OSQP
#include "photocoag/osqp/sparse.hpp"
#endif

namespace photocoag::python {

/// The controller of `control.solver`, as configured.
class OwnedController {
 public:
  /// `config`: the controller's. Throws Error on bad settings or a model for another period.
  OwnedController(const ReducedModel& model, const Config& config);

  template <typename F>
  decltype(auto) visit(F f) {
    return std::visit(f, *controller_);
  }
  ControllerRef part() {
    return visit([](auto& controller) { return ControllerRef(controller); });
  }
  double period() const noexcept { return period_; }

 private:
  using Choice =
      std::variant<Controller
#if PHOTOCOAG_HAS_OSQP
                   ,
                   BasicController<SparseOsqpController>, BasicController<CondensedOsqpController>
#endif
                   >;
  std::unique_ptr<Choice> controller_;
  double period_;
};

/// The estimator of `estimator.kind`, as configured.
struct OwnedEstimator {
  OwnedEstimator(const ReducedModel& model, const EstimatorSettings& settings)
      : filter(model, settings), order(model.order()) {}
  AnyEstimator filter;
  int order;
};

}  // namespace photocoag::python
