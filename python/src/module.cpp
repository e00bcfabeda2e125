// Role: the Python package; the extension module `photocoag._core` and the translation of errors.
#include <nanobind/nanobind.h>

#include "common.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"

namespace nb = nanobind;

namespace {

// Raises photocoag.ConfigError with the parts of the error and its what() as message.
void raise(const photocoag::Error& error) {
  const photocoag::ErrorParts& parts = error.parts();
  const auto text = [](const std::string& value) {
    return nb::steal<nb::object>(
        PyUnicode_DecodeUTF8(value.data(), static_cast<Py_ssize_t>(value.size()), "replace"));
  };
  const nb::object type = nb::module_::import_("photocoag._errors").attr("ConfigError");
  const nb::object raised = type(text(error.what()), text(parts.where), text(parts.key),
                                 text(parts.problem), text(parts.found), text(parts.accepted));
  PyErr_SetObject(type.ptr(), raised.ptr());
}

}  // namespace

NB_MODULE(_core, module) {
  using namespace photocoag;
  nb::set_leak_warnings(false);  // objects alive at interpreter exit are not leaks
  module.doc() = "The compiled part of photocoag.";
  nb::register_exception_translator([](const std::exception_ptr& pointer, void*) {
    try {
      std::rethrow_exception(pointer);
    } catch (const Error& error) {
      raise(error);
    }
  });
  module.attr("version") = nb::str(version().data(), version().size());
  module.attr("source_hash") = nb::str(source_hash().data(), source_hash().size());
  module.attr("notice") =
      nb::str(std::string_view(kResearchNotice).data(), std::string_view(kResearchNotice).size());
  module.attr("has_osqp") = static_cast<bool>(PHOTOCOAG_HAS_OSQP);
  python::bind_config(module);
  python::bind_models(module);
  python::bind_controller(module);
  python::bind_run(module);
  python::bind_many(module);
  python::bind_eye(module);
  python::bind_certify(module);
}
