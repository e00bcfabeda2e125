// docs/model-file.md says what is in the file: its list of fields is complete and its program
// works.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>

#include "photocoag/core/files.hpp"
#include "photocoag/rom/file.hpp"
#include "support/reduced_models.hpp"
#include "support/temporary_folder.hpp"
#include "support/tissues.hpp"
#include "support/uncertain_eyes.hpp"

namespace photocoag {
namespace {

using testing::Json;

std::string document() {
  return read_file(std::string(PHOTOCOAG_SOURCE_DIR) + "/docs/model-file.md", 1000000);
}

// Keys as the document writes them: lists of objects as key[].name, lists of numbers as key.
void collect(const Json& json, const std::string& path, std::set<std::string>& keys) {
  if (json.is_object()) {
    for (const auto& [key, value] : json.items()) {
      collect(value, path.empty() ? key : path + "." + key, keys);
    }
  } else if (json.is_array() && !json.empty() && json.front().is_object()) {
    for (const auto& item : json) collect(item, path + "[]", keys);
  } else {
    keys.insert(path);
  }
}

TEST(ModelDocument, ListsExactlyTheFieldsOfTheFile) {
  std::set<std::string> in_file;
  // The default tissue's has a certificate; the other what is written only where it differs.
  for (const Tissue& tissue :
       {Tissue{}, testing::ring_beam(testing::with_beta(testing::layered()))}) {
    ReducedModel model = testing::coarse_model(tissue);
    model.uncertain = testing::seven_quantity_model();
    collect(Json::parse(to_json(model)), "", in_file);
  }
  std::set<std::string> in_document;
  std::istringstream lines(document());
  std::string line;
  const std::string start = "| `";
  while (std::getline(lines, line)) {
    if (line.rfind(start, 0) != 0) continue;
    const std::string key = line.substr(start.size(), line.find('`', start.size()) - start.size());
    EXPECT_TRUE(in_document.insert(key).second) << key << " twice";
  }
  EXPECT_EQ(in_document, in_file);
}

std::string output_of(const std::string& command) {
  std::string text;
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return text;
  char buffer[4096];
  for (std::size_t size = 0; (size = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;)
    text.append(buffer, size);
  return pclose(pipe) == 0 ? text : "failed: " + text;
}

TEST(ModelDocument, ItsPythonProgramComputesTheSameStepResponse) {
  if (std::system("python3 -c '' > /dev/null 2>&1") != 0) GTEST_SKIP() << "no python3";
  const std::string text = document();
  const std::size_t start = text.find("```python\n") + 10;
  ASSERT_GT(start, std::size_t{10});
  const testing::TemporaryFolder folder;
  write_file(folder.file("read.py"), text.substr(start, text.find("```", start) - start));
  struct Case {
    Tissue tissue;
    ParameterDependence dependence;
    std::string arguments;
    AbsorptionFactors at;
  };
  const Tissue both = testing::with_beta();
  for (const Case& c :
       {Case{{}, ParameterDependence::kDeim, "1.1", 1.1},
        Case{testing::normalized(Tissue{}), ParameterDependence::kChebyshev, "1.1", 1.1},
        Case{testing::normalized(both), ParameterDependence::kDeim, "1.1 1.7", {1.1, 1.7}},
        Case{both, ParameterDependence::kChebyshev, "1.1 0.6", {1.1, 0.6}}}) {
    const ReducedModel model =
        reduce(testing::coarse_full_model(c.tissue), {.parameter_dependence = c.dependence}, 1e-3,
               Discretization::kZeroOrderHold);
    save_reduced_model(model, folder.file("model.json"));
    const std::string printed = output_of("python3 " + folder.file("read.py") + " " +
                                          folder.file("model.json") + " " + c.arguments + " 2>&1");
    std::istringstream lines(printed);
    std::string line;
    std::getline(lines, line);
    ASSERT_EQ(line, "time_s,peak_K,volume_K") << printed;
    ReducedPlant plant(model, c.at);
    int rows = 0;
    while (std::getline(lines, line)) {
      plant.step(1.0);
      double time = 0.0;
      double peak = 0.0;
      double volume = 0.0;
      ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf", &time, &peak, &volume), 3) << line;
      EXPECT_NEAR(time, ++rows * 1e-3, 1e-12);
      // theta as a difference of exponentials keeps some 13 digits.
      EXPECT_NEAR(peak, plant.outputs().peak, 1e-10 * peak);
      EXPECT_NEAR(volume, plant.outputs().volume, 1e-10 * volume);
    }
    EXPECT_EQ(rows, 10);
  }
}

TEST(ModelDocument, ItsPythonProgramNoticesAnAlteredFile) {
  if (std::system("python3 -c '' > /dev/null 2>&1") != 0) GTEST_SKIP() << "no python3";
  const std::string text = document();
  const std::size_t start = text.find("```python\n") + 10;
  const testing::TemporaryFolder folder;
  write_file(folder.file("read.py"), text.substr(start, text.find("```", start) - start));
  std::string model = to_json(testing::coarse_model());
  model.replace(model.find("\"period_s\": 0.001"), 17, "\"period_s\": 0.002");
  write_file(folder.file("model.json"), model);
  EXPECT_NE(
      output_of("python3 " + folder.file("read.py") + " " + folder.file("model.json") + " 1.1 2>&1")
          .find("altered"),
      std::string::npos);
}

}  // namespace
}  // namespace photocoag
