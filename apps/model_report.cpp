#include "model_report.hpp"

#include <fmt/format.h>

#include "console.hpp"

namespace photocoag {

void print_error_report(const ReducedModel& model) {
  say("model     {}{}, order {}, for {:g} ms; largest error {:.2f} % of the peak, {:.2f} % of the "
      "volume temperature (absorption factor {:g} to {:g}{})\n",
      model.method, model.refinement == "none" ? "" : ", refined", model.order(),
      model.period * 1e3, 100.0 * model.error.peak_max(), 100.0 * model.error.volume_max(),
      model.parameters[0].min, model.parameters[0].max,
      model.parameters.size() == 1 ? ""
                                   : fmt::format(", choroid factor {:g} to {:g}",
                                                 model.parameters[1].min, model.parameters[1].max));
}

}  // namespace photocoag
