// Role: the Python package; the largest number of active-set changes, proved (docs/certify.md).
#include "photocoag/certify/certify.hpp"

#include <nanobind/stl/string.h>

#include "arrays.hpp"
#include "common.hpp"

namespace photocoag::python {
namespace {

// None leaves the range unchanged. Throws Error.
void take(BoxRange& range, const char* name, nb::handle given) {
  if (given.is_none()) return;
  const std::vector<double> ends =
      numbers_of(name, given, 2, "two finite numbers, the lower first");
  if (!(ends[0] <= ends[1])) refuse(name, given, "two finite numbers, the lower first");
  range = {ends[0], ends[1]};
}

// Errors name the arguments of this function instead of the program's options.
void validate(const CertifiedBox& box) {
  try {
    box.validate();
  } catch (const Error& error) {
    ErrorParts parts = error.parts();
    parts.key = parts.key == "--alpha"  ? "absorption"
                : parts.key == "--beta" ? "choroid"
                : parts.key == "--free" ? "free"
                                        : "previous";
    throw Error(std::move(parts));
  }
}

nb::dict prove(const OwnedConfig& owned, nb::handle absorption, nb::handle choroid, nb::handle free,
               nb::handle previous, long long boxes, bool use_cache) {
  const Config config = owned.config();
  if (boxes < 1) refuse("boxes", nb::int_(boxes), "an integer from 1");
  std::shared_ptr<Models> models;
  interruptible([&](std::atomic<bool>&) { models = models_without_gil(config, use_cache, false); });
  const ReducedModel& model = *models->reduced;
  require_certifiable(model, config.control);
  const EstimatorSettings& estimator = config.estimator;
  const bool two = model.parameters.size() == 2;
  if (!two && !choroid.is_none())
    refuse("choroid", choroid, "None: the model has no second factor");
  CertifiedBox box =
      usual_box(config.control, {estimator.absorption_min, estimator.absorption_max},
                two ? BoxRange{estimator.choroid_min, estimator.choroid_max} : BoxRange{1.0, 1.0});
  take(box.absorption, "absorption", absorption);
  take(box.choroid, "choroid", choroid);
  take(box.free[0], "free", free);
  box.free.fill(box.free[0]);
  take(box.previous, "previous", previous);
  validate(box);
  const CertifyOptions options{.boxes = static_cast<std::size_t>(boxes)};
  Certificate found;
  interruptible(
      [&](std::atomic<bool>& stop) { found = certify(model, config.control, box, options, stop); });
  nb::dict proof;
  proof["claim"] = claim_text(config.control, box, options);
  proof["changes_proved"] = found.proved;
  proof["changes_seen"] = found.seen;
  proof["hard_bound"] = found.hard_bound;
  proof["share_of_box"] = found.share;
  proof["covers_rounding"] = found.covers_rounding();
  proof["boxes"] = found.boxes;
  return proof;
}

}  // namespace

void bind_certify(nb::module_& module) {
  module.def("certify", &prove, nb::arg("config"), nb::arg("absorption").none(),
             nb::arg("choroid").none(), nb::arg("free").none(), nb::arg("previous").none(),
             nb::arg("boxes"), nb::arg("use_cache"));
}

}  // namespace photocoag::python
