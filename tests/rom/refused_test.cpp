// Files that must be refused, with a message that names the file and the field.
#include <gtest/gtest.h>

#include <cctype>
#include <functional>
#include <utility>

#include "photocoag/core/error.hpp"
#include "photocoag/core/random.hpp"
#include "photocoag/rom/file.hpp"
#include "support/reduced_models.hpp"
#include "support/thrown.hpp"

namespace photocoag {
namespace {

using testing::Json;
using testing::sealed;
using testing::thrown_by;

const std::string& good_text() {
  static const std::string text = to_json(testing::coarse_model());
  return text;
}

Json good() { return Json::parse(good_text()); }

// Refused, with the file named (and perhaps a line); returns what was said.
ErrorParts refused(const std::string& text) {
  ErrorParts parts = thrown_by([&] { from_json(text, "some/model.json"); });
  EXPECT_EQ(parts.where.substr(0, parts.where.find(':')), "some/model.json");
  return parts;
}

// Calls `visit(node, path)` on every node below `json`; paths as the messages write them.
void for_each_node(
    const Json& json, const std::string& path, const Json::json_pointer& at,
    const std::function<void(const Json::json_pointer&, const std::string&)>& visit) {
  if (json.is_object()) {
    for (const auto& [key, value] : json.items()) {
      const std::string below = path.empty() ? key : path + "." + key;
      visit(at / key, below);
      for_each_node(value, below, at / key, visit);
    }
  } else if (json.is_array()) {
    for (std::size_t i = 0; i < json.size(); ++i) {
      const std::string below = path + "[" + std::to_string(i) + "]";
      visit(at / i, below);
      for_each_node(json[i], below, at / i, visit);
    }
  }
}

// For people only; never read.
bool is_remark(const std::string& path) {
  return path == "notice" || path.rfind("program", 0) == 0 || path == "error.meaning" ||
         path == "certificate.meaning" || path == "checksum";
}

// What a file may leave out.
bool is_optional(const std::string& path) {
  return path == "certificate" || path == "parameter_dependence" || path == "refinement";
}

std::string first_name(const std::string& path) { return path.substr(0, path.find_first_of(".[")); }

// Stands for one value of a document, so that many documents cost one dump.
constexpr const char* kMark = "<mark>";

// The document `frame` (compact, without checksum) with `value` where the mark is, and a checksum
// that fits.
std::string sealed_with(std::string frame, const Json& value) {
  const std::string mark = Json(kMark).dump();
  frame.replace(frame.find(mark), mark.size(), value.dump());
  const std::string checksum = sha256_hex(frame);
  frame.back() = ',';
  return frame + "\"checksum\":\"" + checksum + "\"}";
}

TEST(RefusedModel, TheTestsOwnSealIsRight) {
  EXPECT_EQ(sealed(good()), good_text());
  Json json = good();
  json.erase("checksum");
  const Json was = std::exchange(json["continuous"]["A"][1][2], kMark);
  EXPECT_EQ(Json::parse(sealed_with(json.dump(), was)), good());
  EXPECT_NO_THROW(from_json(good_text(), "x"));
}

TEST(RefusedModel, CutOffAnywhere) {
  // The last byte is a line end, which nothing depends on.
  for (std::size_t length = 0; length + 1 < good_text().size(); length += 97) {
    refused(good_text().substr(0, length));
  }
  refused(good_text().substr(0, good_text().size() - 2));
}

// Any altered digit is found, or it changed nothing: of numbers written with 17 digits some
// neighbours in the last digit are the same double.
TEST(RefusedModel, AnyDigitAltered) {
  std::vector<std::size_t> digits;
  for (std::size_t i = 0; i < good_text().size(); ++i) {
    if (std::isdigit(static_cast<unsigned char>(good_text()[i]))) digits.push_back(i);
  }
  ASSERT_GT(digits.size(), 2000U);
  int same = 0;
  for (std::uint64_t sample = 0; sample < 200; ++sample) {
    const auto pick = static_cast<std::size_t>(uniform(1, sample, RandomStream::kTest) *
                                               static_cast<double>(digits.size()));
    std::string text = good_text();
    char& digit = text[digits[pick]];
    digit = digit == '9' ? '0' : static_cast<char>(digit + 1);
    try {
      const ReducedModel model = from_json(text, "some/model.json");
      EXPECT_EQ(to_json(model), good_text()) << "altered at byte " << digits[pick];
      ++same;
    } catch (const Error& error) {
      EXPECT_EQ(error.parts().where, "some/model.json");
    }
  }
  EXPECT_LT(same, 20);
}

TEST(RefusedModel, AlteredTextIsFoundByTheChecksum) {
  for (const char* from :
       {"\"pod-deim\"", "1 kg", "\"RPE\"", "not a medical device", "\"alpha\"", "true", "false"}) {
    std::string text = good_text();
    const std::size_t at = text.find(from);
    if (at == std::string::npos) continue;
    text[at + 1] = text[at + 1] == 'x' ? 'y' : 'x';
    const ErrorParts parts = refused(text);
    EXPECT_TRUE(parts.key == "checksum" || parts.problem.find("JSON") != std::string::npos) << from;
  }
  Json json = good();
  json["full_order_states"] = 1;
  EXPECT_EQ(refused(json.dump(1)).key, "checksum");
  json = good();
  json["checksum"] = std::string(64, '0');
  EXPECT_EQ(refused(json.dump(1)).key, "checksum");
}

TEST(RefusedModel, EveryMissingKeyIsNamed) {
  int removed = 0;
  for_each_node(good(), "", Json::json_pointer(),
                [&](const Json::json_pointer& at, const std::string& path) {
                  if (path.back() == ']' || is_remark(path) || is_optional(path)) return;
                  Json json = good();
                  json[at.parent_pointer()].erase(at.back());
                  EXPECT_EQ(refused(sealed(json)).key, path);
                  ++removed;
                });
  EXPECT_GT(removed, 60);
}

TEST(RefusedModel, EveryWrongTypeIsNamed) {
  const std::vector<Json> others = {Json(nullptr),
                                    Json(true),
                                    Json("x"),
                                    Json(-7),
                                    Json::array(),
                                    Json::object(),
                                    Json::array({Json::array({"x"})})};
  int tried = 0;
  Json json = good();
  json.erase("checksum");
  for_each_node(
      good(), "", Json::json_pointer(), [&](const Json::json_pointer& at, const std::string& path) {
        if (is_remark(path)) return;
        const Json was = std::exchange(json[at], kMark);
        const std::string frame = json.dump();
        json[at] = was;
        for (const Json& other : others) {
          if (other.type() == was.type() || (other.is_number() && was.is_number())) continue;
          ++tried;
          const ErrorParts parts = refused(sealed_with(frame, other));
          const bool named = parts.key.rfind(first_name(path), 0) == 0 ||
                             parts.key == "error.peak_relative" ||
                             parts.key == first_name(path.substr(path.find('.') + 1));
          EXPECT_TRUE(named) << path << " = " << other.dump() << ": " << Error(parts).what();
        }
      });
  EXPECT_GT(tried, 1500);
}

TEST(RefusedModel, NotANumber) {
  // JSON has no NaN: writers make it null, or write what is no JSON at all.
  Json json = good();
  json["continuous"]["A"][0][0] = nullptr;
  EXPECT_EQ(refused(sealed(json)).key, "continuous.A[0][0]");
  for (const char* number : {"NaN", "nan", "Infinity", "-inf", "1e999", "0x10", "1,5"}) {
    std::string text = good_text();
    const std::string key = "\"period_s\": ";
    const std::size_t at = text.find(key) + key.size();
    text.replace(at, text.find(',', at) - at, number);
    EXPECT_NE(refused(text).problem.find("JSON"), std::string::npos) << number;
  }
}

struct Change {
  const char* what;
  const char* key;
  std::function<void(Json&)> make;
};

// Changes by somebody who also made the checksum fit.
TEST(RefusedModel, WrongContentWithAFittingChecksum) {
  const std::vector<Change> changes = {
      {"another format", "format", [](Json& j) { j["format"] = "full model"; }},
      {"an older version", "version", [](Json& j) { j["version"] = 0; }},
      {"a newer version", "version", [](Json& j) { j["version"] = 2; }},
      {"another order", "order", [](Json& j) { j["order"] = 5; }},
      {"another parameter", "parameters[0].name",
       [](Json& j) { j["parameters"][0]["name"] = "beta"; }},
      {"the same parameter twice", "parameters[1].name",
       [](Json& j) { j["parameters"].push_back(j["parameters"][0]); }},
      {"no parameter", "parameters", [](Json& j) { j["parameters"] = Json::array(); }},
      {"a long story for a method", "method", [](Json& j) { j["method"] = std::string(81, 'x'); }},
      {"states in a unit whose square no double holds", "discrete.B",
       [](Json& j) {
         for (const char* part : {"continuous", "discrete"}) {
           for (Json& row : j[part]["B"]) {
             for (Json& entry : row) entry = entry.get<double>() * 1e160;
           }
         }
       }},
      {"empty range", "parameters[0].max", [](Json& j) { j["parameters"][0]["max"] = 0.3; }},
      {"range from zero", "parameters[0].max", [](Json& j) { j["parameters"][0]["min"] = 0.0; }},
      {"unknown theta", "theta.kind", [](Json& j) { j["theta"]["kind"] = "splines"; }},
      {"no theta", "theta", [](Json& j) { j["theta"]["points"] = Json::array(); }},
      {"too many thetas", "theta.points",
       [](Json& j) {
         for (int i = 0; i < 20; ++i) j["theta"]["points"].push_back(j["theta"]["points"][0]);
       }},
      {"a ragged matrix", "continuous.A[2]", [](Json& j) { j["continuous"]["A"][2].erase(0); }},
      {"a row missing", "A",
       [](Json& j) {
         j["continuous"]["A"].erase(5);
         j["order"] = 5;
       }},
      {"B of another order", "B", [](Json& j) { j["continuous"]["B"].erase(0); }},
      {"C_volume short", "C_volume", [](Json& j) { j["continuous"]["C_volume"].erase(0); }},
      {"two rows of C_peak", "continuous.C_peak",
       [](Json& j) { j["continuous"]["C_peak"].push_back(j["continuous"]["C_peak"][0]); }},
      {"empty rows", "A",
       [](Json& j) {
         j["continuous"]["A"] = Json::array({Json::array()});
         j["order"] = 1;
       }},
      {"a matrix of 15 rows", "continuous.A",
       [](Json& j) {
         j["continuous"]["A"] =
             Json(std::vector<std::vector<double>>(15, std::vector<double>(15, 0.0)));
       }},
      {"a row of 100,000", "continuous.B[0]",
       [](Json& j) { j["continuous"]["B"][0] = std::vector<double>(100000, 1.0); }},
      {"100,000 rows", "discrete.A",
       [](Json& j) { j["discrete"]["A"] = std::vector<std::vector<double>>(100000, {1.0}); }},
      {"another discretization", "discrete.discretization",
       [](Json& j) { j["discrete"]["discretization"] = "explicit-euler"; }},
      {"the discretization exchanged", "discrete",
       [](Json& j) { j["discrete"]["discretization"] = "implicit-euler"; }},
      {"another period", "discrete", [](Json& j) { j["discrete"]["period_s"] = 0.004; }},
      {"a period below zero", "discrete.period_s",
       [](Json& j) { j["discrete"]["period_s"] = -0.001; }},
      {"one discrete entry changed", "discrete",
       [](Json& j) { j["discrete"]["B"][3][2] = 1.001 * j["discrete"]["B"][3][2].get<double>(); }},
      {"A changed, the discrete one not", "discrete",
       [](Json& j) {
         j["continuous"]["A"][1][1] = 1.01 * j["continuous"]["A"][1][1].get<double>();
       }},
      {"an unstable A", "A", [](Json& j) { j["continuous"]["A"][0][0] = 3.0; }},
      {"no peak", "C_peak",
       [](Json& j) { j["continuous"]["C_peak"][0] = std::vector<double>(6, 0.0); }},
      {"peak of another sign", "C_peak",
       [](Json& j) {
         for (Json& entry : j["continuous"]["C_peak"][0]) entry = -entry.get<double>();
       }},
      {"negative impulse response", "C_peak",
       [](Json& j) {  // The modes are in ascending order of decay rate: the first is the fastest or
                      // the slowest.
         Json& peak = j["continuous"]["C_peak"][0];
         const bool first =
             j["continuous"]["A"][0][0].get<double>() < j["continuous"]["A"][5][5].get<double>();
         Json& fastest = peak[first ? 0 : 5];
         fastest = -4.0 * fastest.get<double>();
       }},
      {"gain that does not grow with alpha", "C_peak",
       [](Json& j) {
         for (Json& point : j["theta"]["points"])
           point["scaled_front"] = point["scaled_back"] = 0.0;
       }},
      {"normalized, but not the tissue", "volume_normalized",
       [](Json& j) { j["volume_normalized"] = true; }},
      {"another absorbed fraction", "absorbed_fraction",
       [](Json& j) { j["absorbed_fraction"]["scaled_back"] = 0.5; }},
      {"a tissue of nothing", "tissue.layers",
       [](Json& j) { j["tissue"]["layers"] = Json::array(); }},
      {"a tissue in micrometres", "tissue.layers.RPE.thickness_um",
       [](Json& j) { j["tissue"]["layers"][1]["thickness_m"] = 6.0; }},
      {"an unknown output", "tissue.volume_temperature",
       [](Json& j) { j["tissue"]["volume_temperature"] = "mean"; }},
      {"errors without alphas", "error.peak_relative",
       [](Json& j) { j["error"]["absorption_factors"] = Json::array(); }},
      {"a flattering summary", "error.peak_relative_max",
       [](Json& j) { j["error"]["peak_relative_max"] = 1e-6; }},
      {"a flattering summary", "error.volume_relative_max",
       [](Json& j) { j["error"]["volume_relative_max"] = 0.0; }},
  };
  for (const Change& change : changes) {
    SCOPED_TRACE(change.what);
    Json json = good();
    change.make(json);
    const ErrorParts parts = refused(sealed(json));
    EXPECT_EQ(parts.key, change.key) << Error(parts).what();
    EXPECT_FALSE(parts.accepted.empty());
  }
}

TEST(RefusedModel, WhatIsNoModelAtAll) {
  for (const std::string text :
       {"", " ", "\n", "{}", "[]", "null", "0", "\"model\"", "{", "}", "model = 1",
        "{\"format\": \"photocoag reduced model\"}", "\xEF\xBB\xBF", "\xFF\xFE\x00"}) {
    refused(text);
  }
  refused(good_text() + "{}");
  std::string garbage;
  for (std::uint64_t i = 0; i < 5000; ++i) {
    garbage += static_cast<char>(256.0 * uniform(2, i, RandomStream::kTest));
  }
  refused(garbage);
  // Raw bytes inside an otherwise good file.
  std::string text = good_text();
  text[text.find("RPE")] = '\xFE';
  refused(text);
}

// A program that copies or writes such a value level by level runs out of stack.
TEST(RefusedModel, DeepNesting) {
  for (const std::size_t depth : {std::size_t{100}, std::size_t{200000}, std::size_t{4000000}}) {
    const std::string open(depth, '[');
    const std::string close(depth, ']');
    refused(open);
    refused(open + close);
    refused("{\"format\": " + open + close + "}");
    std::string text = good_text();
    text.insert(1, "\"x\": " + open + close + ",");
    refused(text);
  }
  std::string objects;
  for (int i = 0; i < 100000; ++i) objects += "{\"a\":";
  refused(objects);
}

}  // namespace
}  // namespace photocoag
