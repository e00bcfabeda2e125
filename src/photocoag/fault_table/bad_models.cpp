#include "photocoag/fault_table/bad_models.hpp"

#include <fmt/format.h>

#include <functional>
#include <nlohmann/json.hpp>

#include "photocoag/core/sha256.hpp"
#include "photocoag/rom/file.hpp"

namespace photocoag {
namespace {

using Json = nlohmann::ordered_json;

/// With a valid checksum, as in deliberate tampering.
std::string sealed(Json json) {
  json.erase("checksum");
  json["checksum"] = sha256_hex(json.dump());
  return json.dump(1) + "\n";
}

struct Change {
  const char* what;
  std::function<void(Json&)> make;
};

Json& a(Json& j) { return j["continuous"]["A"]; }

const std::vector<Change>& changes() {
  static const std::vector<Change> list = {
      {"wrong magic", [](Json& j) { j["format"] = "full model"; }},
      {"future version", [](Json& j) { j["version"] = 2; }},
      {"order 0", [](Json& j) { j["order"] = 0; }},
      {"order -1", [](Json& j) { j["order"] = -1; }},
      {"order 2^31", [](Json& j) { j["order"] = std::int64_t{1} << 31; }},
      {"order 2^62", [](Json& j) { j["order"] = std::int64_t{1} << 62; }},
      {"15 states", [](Json& j) { a(j) = Json(std::vector(15, std::vector<double>(15, 0.0))); }},
      {"100,000 rows", [](Json& j) { a(j) = Json(std::vector(100000, std::vector{1.0})); }},
      {"a ragged matrix", [](Json& j) { a(j)[2].erase(0); }},
      {"an entry that is null", [](Json& j) { a(j)[0][0] = nullptr; }},
      {"an entry that is text", [](Json& j) { a(j)[0][0] = "nan"; }},
      {"an unstable A", [](Json& j) { a(j)[0][0] = 3.0; }},
      {"A of an integrator", [](Json& j) { a(j)[0] = std::vector<double>(a(j).size(), 0.0); }},
      {"no peak",
       [](Json& j) { j["continuous"]["C_peak"][0] = std::vector<double>(a(j).size(), 0.0); }},
      {"peak of another sign",
       [](Json& j) {
         for (Json& entry : j["continuous"]["C_peak"][0]) entry = -entry.get<double>();
       }},
      {"gain that does not grow with alpha",
       [](Json& j) {
         for (Json& point : j["theta"]["points"])
           point["scaled_front"] = point["scaled_back"] = 0.0;
       }},
      {"transposed B",
       [](Json& j) {
         const Json b = j["continuous"]["B"];
         Json transposed = Json::array();
         for (std::size_t c = 0; c < b[0].size(); ++c) {
           Json row = Json::array();
           for (const Json& from : b) row.push_back(from[c]);
           transposed.push_back(row);
         }
         transposed.push_back(transposed[0]);  // square matrices would pass for what they are not
         j["continuous"]["B"] = transposed;
       }},
      {"no interpolation points", [](Json& j) { j["theta"]["points"] = Json::array(); }},
      {"unknown interpolation", [](Json& j) { j["theta"]["kind"] = "splines"; }},
      {"an empty range of alpha", [](Json& j) { j["parameters"][0]["max"] = 0.3; }},
      {"another parameter", [](Json& j) { j["parameters"][0]["name"] = "beta"; }},
      {"a period below zero", [](Json& j) { j["discrete"]["period_s"] = -0.001; }},
      {"discrete matrices of another period", [](Json& j) { j["discrete"]["period_s"] = 0.004; }},
      {"one discrete entry changed",
       [](Json& j) {
         j["discrete"]["B"][1][1] = 1.001 * j["discrete"]["B"][1][1].get<double>() + 1e-9;
       }},
      {"another discretization", [](Json& j) { j["discrete"]["discretization"] = "euler"; }},
      {"a tissue of nothing", [](Json& j) { j["tissue"]["layers"] = Json::array(); }},
      {"a tissue in micrometres", [](Json& j) { j["tissue"]["layers"][1]["thickness_m"] = 6.0; }},
      {"a flattering error", [](Json& j) { j["error"]["peak_relative_max"] = 1e-6; }},
  };
  return list;
}

}  // namespace

std::vector<BadModel> bad_models(const ReducedModel& good) {
  const std::string text = to_json(good);
  std::vector<BadModel> bad = {{"empty", ""},
                               {"no JSON", "model = 1\n"},
                               {"JSON, but no object", "[]"},
                               {"an empty object", "{}"},
                               {"two models", text + text},
                               {"no UTF-8", "\xFF\xFE" + text},
                               {"zero bytes", std::string(4096, '\0')}};
  // Every byte of the first line and a half, then further apart; never the last line's end.
  for (std::size_t length = 1; length + 2 < text.size(); length += length < 64 ? 7 : 997) {
    bad.push_back({fmt::format("cut off after {} bytes", length), text.substr(0, length)});
  }
  std::string altered = text;
  const std::size_t at = altered.find("RPE");
  if (at != std::string::npos) altered[at] = 'r';
  bad.push_back({"altered: checksum", altered});
  for (const std::size_t depth : {std::size_t{100}, std::size_t{200000}}) {
    bad.push_back({fmt::format("{} nested brackets", depth), std::string(depth, '[')});
  }
  std::string infinite = text;
  const std::string key = "\"period_s\": ";
  const std::size_t value = infinite.find(key) + key.size();
  infinite.replace(value, infinite.find(',', value) - value, "1e999");
  bad.push_back({"1e999", infinite});
  for (const Change& change : changes()) {
    Json json = Json::parse(text);
    change.make(json);
    bad.push_back({change.what, sealed(json)});
  }
  return bad;
}

}  // namespace photocoag
