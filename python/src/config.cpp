// Role: the Python package; configurations.
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <filesystem>
#include <utility>

#include "common.hpp"
#include "photocoag/config/source.hpp"
#include "photocoag/config/usage.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"

namespace photocoag::python {
namespace {

constexpr std::size_t kMostBytes = 1'000'000;

std::vector<Source> sources_of(const std::string& text, const std::string& name,
                               const std::string& folder, const std::vector<Override>& overrides) {
  std::vector<Source> sources;
  if (!text.empty()) sources.push_back({read_toml_text(text, name), folder});
  for (const Override& one : overrides) sources.push_back({read_override(one.option), one.folder});
  return sources;
}

nb::object to_python(const Value& value) {
  switch (value.kind) {
    case Value::Kind::kInteger:
      return nb::int_(value.integer);
    case Value::Kind::kFloat:
      return nb::float_(value.number);
    case Value::Kind::kBoolean:
      return nb::bool_(value.text == "true");
    case Value::Kind::kArray: {
      nb::list list;
      for (const Entry& entry : value.entries) list.append(to_python(entry.value));
      return list;
    }
    case Value::Kind::kTable: {
      nb::dict dict;
      for (const Entry& entry : value.entries) {
        dict[nb::str(entry.key.data(), entry.key.size())] = to_python(entry.value);
      }
      return dict;
    }
    case Value::Kind::kString:
    case Value::Kind::kDate:
      break;
  }
  const std::string& text = value.kind == Value::Kind::kString ? value.string : value.text;
  return nb::str(text.data(), text.size());
}

using Pairs = std::vector<std::pair<std::string, std::string>>;

std::vector<Override> overrides_of(const Pairs& pairs) {
  std::vector<Override> overrides;
  for (const auto& [option, folder] : pairs) overrides.push_back({option, folder});
  return overrides;
}

}  // namespace

OwnedConfig::OwnedConfig(std::string text, std::string name, std::string folder,
                         std::vector<Override> overrides)
    : text_(std::move(text)),
      name_(std::move(name)),
      folder_(std::move(folder)),
      overrides_(std::move(overrides)),
      config_(config_of(sources_of(text_, name_, folder_, overrides_), places_)) {}

OwnedConfig OwnedConfig::with(const std::vector<Override>& more) const {
  std::vector<Override> all = overrides_;
  all.insert(all.end(), more.begin(), more.end());
  return {text_, name_, folder_, std::move(all)};
}

void OwnedConfig::require_simulation() const {
  refuse_contradictions(config_, places_, Use::kSimulate);
  if (config_.photoacoustics.sampling == Sampling::kPulses) {
    throw Error(ErrorParts{.key = "photoacoustics.sampling",
                           .problem = "the eye in this process has no pulses",
                           .found = "pulses",
                           .accepted = "instant"});
  }
}

void bind_config(nb::module_& module) {
  module.def(
      "read_config_text",
      [](const std::string& path) {
        return plain_text(read_file(path, kMostBytes, "TOML file"), path);
      },
      "Text of a TOML file: regular, at most 1 MB, UTF-8.");
  nb::class_<OwnedConfig>(module, "Config")
      .def(
          "__init__",
          [](OwnedConfig* self, std::string text, std::string name, std::string folder,
             const Pairs& overrides) {
            new (self) OwnedConfig(std::move(text), std::move(name), std::move(folder),
                                   overrides_of(overrides));
          },
          nb::arg("text") = "", nb::arg("name") = "", nb::arg("folder") = "",
          nb::arg("overrides") = Pairs())
      .def("with_overrides", [](const OwnedConfig& self,
                                const Pairs& pairs) { return self.with(overrides_of(pairs)); })
      .def("state",
           [](const OwnedConfig& self) {
             Pairs pairs;
             for (const Override& one : self.overrides())
               pairs.emplace_back(one.option, one.folder);
             return nb::make_tuple(self.text(), self.name(), self.folder(), pairs);
           })
      .def("to_toml", [](const OwnedConfig& self) { return to_toml(self.config()); })
      .def("sha256", [](const OwnedConfig& self) { return config_sha256(self.config()); })
      .def("to_dict",
           [](const OwnedConfig& self) {
             return to_python(read_toml_text(to_toml(self.config()), "configuration"));
           })
      .def_prop_ro("cycles", [](const OwnedConfig& self) { return self.config().cycles(); })
      .def("__eq__", [](const OwnedConfig& self, nb::handle other) {
        return nb::isinstance<OwnedConfig>(other) &&
               self.config() == nb::cast<const OwnedConfig&>(other).config();
      });
}

}  // namespace photocoag::python
