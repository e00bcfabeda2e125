#include "photocoag/core/vtk.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <span>

#include "photocoag/core/base64.hpp"
#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

static_assert(std::endian::native == std::endian::little, "files are written as little endian");

// VTK's inline binary: the number of bytes as UInt64, then the values, in one base64 text.
template <typename T>
std::string encoded(const std::vector<T>& values) {
  const std::uint64_t size = values.size() * sizeof(T);
  std::vector<unsigned char> bytes(sizeof size + size);
  std::memcpy(bytes.data(), &size, sizeof size);
  if (size > 0) std::memcpy(bytes.data() + sizeof size, values.data(), size);
  return base64(bytes);
}

template <typename T>
std::vector<T> decoded(std::string_view text, const std::string& where) {
  const std::vector<unsigned char> bytes = from_base64(text, where);
  std::uint64_t size = 0;
  if (bytes.size() >= sizeof size) std::memcpy(&size, bytes.data(), sizeof size);
  if (bytes.size() < sizeof size || size != bytes.size() - sizeof size || size % sizeof(T) != 0) {
    throw Error(
        ErrorParts{.where = where, .problem = "an array whose length differs from the stated one"});
  }
  std::vector<T> values(size / sizeof(T));
  if (size > 0) std::memcpy(values.data(), bytes.data() + sizeof size, size);
  return values;
}

std::string array(std::string_view type, std::string_view name, std::string_view attributes,
                  const std::string& content) {
  return fmt::format("<DataArray type=\"{}\" Name=\"{}\"{} format=\"binary\">{}</DataArray>\n",
                     type, name, attributes, content);
}

std::string numbers(std::string_view name, const std::vector<double>& values, bool tuples) {
  return array("Float64", name,
               tuples ? fmt::format(" NumberOfTuples=\"{}\"", values.size()) : std::string(),
               encoded(values));
}

// A string array in VTK's ascii form: character codes, each string ended by 0.
std::string strings(std::string_view name, const std::vector<std::string>& values) {
  std::string codes;
  for (const std::string& value : values) {
    for (const char c : value) {
      fmt::format_to(std::back_inserter(codes), "{} ", static_cast<unsigned char>(c));
    }
    codes += "0 ";
  }
  return fmt::format(
      "<Array type=\"String\" Name=\"{}\" NumberOfTuples=\"{}\" format=\"ascii\">{}</Array>\n",
      name, values.size(), codes);
}

// Text between the tags of the array `name`.
std::string_view content_of(std::string_view text, std::string_view name,
                            const std::string& where) {
  const std::size_t tag = text.find(fmt::format("Name=\"{}\"", name));
  const std::size_t begin = tag == std::string_view::npos ? tag : text.find('>', tag);
  const std::size_t end = begin == std::string_view::npos ? begin : text.find('<', begin);
  if (end == std::string_view::npos) {
    throw Error(ErrorParts{.where = where,
                           .problem = "not a temperature field",
                           .found = "no array \"" + std::string(name) + "\"",
                           .accepted = "a .vtr file as photocoag writes it"});
  }
  return text.substr(begin + 1, end - begin - 1);
}

std::vector<std::string> from_codes(std::string_view text) {
  std::vector<std::string> values;
  std::string value;
  int code = -1;
  for (const char c : text) {
    if (c >= '0' && c <= '9') {
      code = (code < 0 ? 0 : code * 10) % 1000 + (c - '0');
    } else if (code >= 0) {
      if (code == 0) {
        values.push_back(std::move(value));
        value.clear();
      } else {
        value += static_cast<char>(code);
      }
      code = -1;
    }
  }
  return values;
}

bool ascending(const std::vector<double>& faces) {
  if (faces.size() < 2) return false;
  for (std::size_t k = 0; k < faces.size(); ++k) {
    if (!std::isfinite(faces[k]) || (k > 0 && !(faces[k] > faces[k - 1]))) return false;
  }
  return true;
}

}  // namespace

std::string to_vtr(const TemperatureField& field) {
  const std::string extent =
      fmt::format("0 {} 0 {} 0 0", field.radial_cells(), field.axial_cells());
  std::string text = fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"RectilinearGrid\" version=\"1.0\" "
      "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<RectilinearGrid "
      "WholeExtent=\"{}\">\n<FieldData>\n",
      extent);
  text += numbers("TimeValue", {field.time_s}, true);
  text += numbers("spot_radius_m", {field.spot_radius_m}, true);
  text += numbers("layer_back_m", field.layer_back_m, true);
  text += strings("layer_names", field.layer_names);
  text += fmt::format(
      "</FieldData>\n<Piece Extent=\"{}\">\n<CellData Scalars=\"temperature_rise_K\">\n", extent);
  text += array("Float32", "temperature_rise_K", "", encoded(field.temperature_rise_K));
  text += "</CellData>\n<Coordinates>\n";
  text += numbers("radius_m", field.radius_m, false);
  text += numbers("depth_m", field.depth_m, false);
  text += numbers("none", {0.0}, false);
  text += "</Coordinates>\n</Piece>\n</RectilinearGrid>\n</VTKFile>\n";
  return text;
}

TemperatureField from_vtr(std::string_view text, const std::string& where) {
  const auto doubles = [&](std::string_view name) {
    return decoded<double>(content_of(text, name, where), where);
  };
  const auto one = [&](std::string_view name) {
    const std::vector<double> values = doubles(name);
    return values.empty() ? 0.0 : values.front();
  };
  TemperatureField field;
  field.time_s = one("TimeValue");
  field.spot_radius_m = one("spot_radius_m");
  field.layer_back_m = doubles("layer_back_m");
  field.layer_names = from_codes(content_of(text, "layer_names", where));
  field.temperature_rise_K = decoded<float>(content_of(text, "temperature_rise_K", where), where);
  field.radius_m = doubles("radius_m");
  field.depth_m = doubles("depth_m");
  if (!ascending(field.radius_m) || !ascending(field.depth_m) ||
      field.temperature_rise_K.size() != field.radial_cells() * field.axial_cells() ||
      field.layer_names.size() != field.layer_back_m.size()) {
    throw Error(ErrorParts{.where = where, .problem = "the arrays do not match one grid"});
  }
  return field;
}

std::string to_pvd(const std::vector<std::string>& files, const std::vector<double>& times_s) {
  std::string text =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" "
      "byte_order=\"LittleEndian\">\n<Collection>\n";
  for (std::size_t k = 0; k < files.size(); ++k) {
    fmt::format_to(std::back_inserter(text), "<DataSet timestep=\"{}\" part=\"0\" file=\"{}\"/>\n",
                   times_s[k], files[k]);
  }
  return text + "</Collection>\n</VTKFile>\n";
}

}  // namespace photocoag
