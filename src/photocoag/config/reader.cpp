#include "photocoag/config/reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <utility>

#include "photocoag/config/assign.hpp"
#include "photocoag/config/fields.hpp"
#include "photocoag/config/random_quantities.hpp"
#include "photocoag/config/suggest.hpp"
#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

constexpr std::string_view kPlantTissue = "plant.tissue";

// A key as it must be written: quoted unless bare, so that "a.b" is not mistaken for a.b.
std::string join(const std::string& path, const std::string& key) {
  const bool bare = !key.empty() && std::all_of(key.begin(), key.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-';
  });
  return (path.empty() ? "" : path + ".") + (bare ? key : toml_quoted(key));
}

bool is_section(std::string_view key) {
  return std::any_of(sections().begin(), sections().end(),
                     [key](const Section& section) { return section.name == key; });
}

bool is_prior(std::string_view key) {
  return key == kPriorTables.quantities || key == kPriorTables.correlations;
}

[[noreturn]] void refuse_unknown(const std::string& key, const Value& value, std::string_view what,
                                 const std::string& nearest, std::string all) {
  const std::string advice = nearest.empty() ? "" : fmt::format("; did you mean {}?", nearest);
  throw Error({.where = value.where,
               .key = shown(key),
               .problem = fmt::format("{}{}", what, advice),
               .accepted = nearest.empty() ? std::move(all) : std::string()});
}

[[noreturn]] void refuse_layer(const std::string& path, const Value& value,
                               const std::vector<Layer>& layers) {
  std::vector<std::string> names;
  std::string all;
  for (const Layer& layer : layers) {
    names.push_back(layer.name);
    all += (all.empty() ? "" : ", ") + layer.name;
  }
  const std::string nearest = nearest_key(path.substr(path.find(".layers.") + 8), names);
  const std::string advice = nearest.empty() ? "" : fmt::format("; did you mean {}?", nearest);
  throw Error({.where = value.where,
               .key = shown(path),
               .problem = "no layer of that name" + advice,
               .accepted = all});
}

class Reader {
 public:
  explicit Reader(Config& config) : fields_(fields(config)), prior_(config.prior) {}

  // All keys but those below plant.tissue.
  void read(const Source& source) {
    folder_ = source.folder;
    read_table(source.root, "");
    read_prior_of(source.root);
  }
  // Only those below plant.tissue; false if there are none.
  bool read_plant_tissue(const Source& source);

  Places take_places() { return std::move(places_); }

 private:
  void read_table(const Value& table, const std::string& path);
  void read_field(const Field& field, const Value& value, const std::string& key);
  void read_prior_of(const Value& root);
  void read_layers(const Field& field, const Value& value);
  void read_layer_array(const Field& field, const Value& array);
  void read_layer(const std::string& path, const Value& table, Layer& layer);
  [[noreturn]] void refuse_key(const std::string& path, const std::string& key,
                               const Value& value) const;

  std::vector<Field> fields_;
  Prior& prior_;
  std::string folder_;
  Places places_;
  std::size_t order_ = 0;
};

bool Reader::read_plant_tissue(const Source& source) {
  const Value* plant = source.root.find("plant");
  const Value* tissue = plant == nullptr ? nullptr : plant->find("tissue");
  if (tissue == nullptr) return false;
  const std::string path(kPlantTissue);
  if (tissue->kind != Value::Kind::kTable) {
    refuse_type(path, *tissue, "a table with keys of [tissue]");
  }
  folder_ = source.folder;
  read_table(*tissue, path);
  return !tissue->entries.empty();
}

void Reader::read_table(const Value& table, const std::string& path) {
  for (const auto& [name, value] : table.entries) {
    const std::string key = join(path, name);
    if (key == kPlantTissue || is_prior(key)) continue;
    if (is_section(key)) {
      if (value.kind != Value::Kind::kTable) refuse_type(key, value, fmt::format("[{}]", key));
      read_table(value, key);
      continue;
    }
    const auto field = std::find_if(fields_.begin(), fields_.end(),
                                    [&key](const Field& f) { return f.key == key; });
    if (field == fields_.end()) refuse_key(path, key, value);
    if (std::holds_alternative<LayersField>(field->value)) {
      read_layers(*field, value);
    } else {
      read_field(*field, value, key);
    }
  }
}

void Reader::read_field(const Field& field, const Value& value, const std::string& key) {
  assign(field, value, folder_);
  const bool is_number = value.kind == Value::Kind::kInteger || value.kind == Value::Kind::kFloat;
  places_[key] = {value.where, is_number ? value.text : std::string(), ++order_};
}

// A later prior replaces an earlier one, correlations included.
void Reader::read_prior_of(const Value& root) {
  const Value* const quantities = root.find(kPriorTables.quantities);
  const Value* const correlations = root.find(kPriorTables.correlations);
  if (quantities == nullptr && correlations == nullptr) return;
  if (quantities == nullptr) {
    throw Error({.where = correlations->where,
                 .key = std::string(kPriorTables.correlations),
                 .problem = "without a prior beside it",
                 .accepted = "[[prior]] and [[prior_correlation]] of one file or option"});
  }
  prior_ = read_prior(root, kPriorTables);
  std::erase_if(places_, [](const auto& place) { return place.first.starts_with("prior"); });
  places_["prior"] = {quantities->where, "", ++order_};
  if (correlations != nullptr) places_["prior_correlation"] = {correlations->where, "", ++order_};
  for (const Entry& entry : quantities->entries) {
    const std::string path = "prior." + entry.value.find("key")->string;
    places_[path] = {entry.value.find("key")->where, "", ++order_};
    for (const char* const bound : {"low", "high"}) {
      const Value& value = *entry.value.find(bound);
      places_[path + "." + bound] = {value.where, value.text, ++order_};
    }
  }
}

void Reader::read_layers(const Field& field, const Value& value) {
  if (value.kind == Value::Kind::kArray) {
    read_layer_array(field, value);
    return;
  }
  if (value.kind != Value::Kind::kTable) refuse_type(field.key, value, accepted(field));
  std::vector<Layer>& layers = *std::get<LayersField>(field.value).layers;
  for (const auto& [name, table] : value.entries) {
    const auto layer = std::find_if(layers.begin(), layers.end(),
                                    [&n = name](const Layer& l) { return l.name == n; });
    const std::string path = field.key + "." + name;
    if (layer == layers.end()) refuse_layer(path, table, layers);
    if (table.kind != Value::Kind::kTable) {
      refuse_type(path, table, "keys of a layer, e.g. thickness_um");
    }
    if (table.find("name") != nullptr) {
      refuse_unknown(path + ".name", *table.find("name"), "a layer cannot be renamed", "",
                     "the whole array of layers, for other names");
    }
    read_layer(path, table, *layer);
  }
}

void Reader::read_layer_array(const Field& field, const Value& array) {
  std::vector<Layer> layers;
  std::erase_if(places_, [&](const auto& place) { return place.first.starts_with(field.key); });
  places_[field.key] = {array.where, "", ++order_};
  for (const Entry& element : array.entries) {
    const Value& table = element.value;
    if (table.kind != Value::Kind::kTable) {
      refuse_type(field.key, table, "{ name = …, thickness_um = …, absorption_per_m = … }");
    }
    const Value* name = table.find("name");
    const bool named = name != nullptr && name->kind == Value::Kind::kString;
    const std::string path = field.key + "." + (named ? shown(name->string) : "…");
    for (const char* required : kRequiredLayerKeys) {
      if (table.find(required) != nullptr) continue;
      throw Error({.where = table.where,
                   .key = fmt::format("{}.{}", path, required),
                   .problem = "missing",
                   .accepted = "name, thickness_um and absorption_per_m for every layer"});
    }
    read_layer(path, table, layers.emplace_back());
  }
  *std::get<LayersField>(field.value).layers = std::move(layers);
}

void Reader::read_layer(const std::string& path, const Value& table, Layer& layer) {
  const std::vector<Field> known = layer_fields(layer, path);
  for (const auto& [name, value] : table.entries) {
    const std::string key = path + "." + name;
    const auto field =
        std::find_if(known.begin(), known.end(), [&key](const Field& f) { return f.key == key; });
    if (field == known.end()) {
      std::vector<std::string> keys;
      std::string all;
      for (const Field& f : known) {
        keys.push_back(f.key);
        all += (all.empty() ? "" : ", ") + f.key.substr(path.size() + 1);
      }
      refuse_unknown(key, value, "unknown key", nearest_key(key, keys), all);
    }
    read_field(*field, value, key);
  }
}

void Reader::refuse_key(const std::string& path, const std::string& key, const Value& value) const {
  std::vector<std::string> candidates;
  std::string all;
  const std::string prefix = path.empty() ? "" : path + ".";
  const auto add = [&](std::string name) {
    const bool here = name.starts_with(prefix) && name.find('.', prefix.size()) == name.npos;
    if (here) all += (all.empty() ? "" : ", ") + name.substr(prefix.size());
    candidates.push_back(std::move(name));
  };
  for (const Section& section : sections()) add(std::string(section.name));
  for (const std::string_view name : {kPriorTables.quantities, kPriorTables.correlations}) {
    add(std::string(name));
  }
  for (const Field& field : fields_) {
    const bool elsewhere = path != kPlantTissue && field.key.starts_with(kPlantTissue);
    if (!elsewhere) add(field.key);
    const auto* layers = std::get_if<LayersField>(&field.value);
    if (layers == nullptr || elsewhere) continue;
    for (Layer& layer : *layers->layers) {
      for (const Field& f : layer_fields(layer, field.key + "." + layer.name)) {
        candidates.push_back(f.key);
      }
    }
  }
  refuse_unknown(key, value, "unknown key", nearest_key(key, candidates), all);
}

}  // namespace

Places read_sources(const std::vector<Source>& sources, Config& config) {
  Reader reader(config);
  for (const Source& source : sources) reader.read(source);
  config.plant.tissue = config.tissue;
  config.plant.tissue_differs = false;
  for (const Source& source : sources) {
    if (reader.read_plant_tissue(source)) config.plant.tissue_differs = true;
  }
  return reader.take_places();
}

}  // namespace photocoag
