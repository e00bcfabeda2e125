// `field` and `export`: what they write, and that they agree with the other commands.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "apps/program.hpp"
#include "photocoag/core/vtk.hpp"

namespace photocoag::testing {
namespace {

const std::string kSmall = " --set grid.min_cells=3000 ";

float highest(const TemperatureField& field) {
  return *std::max_element(field.temperature_rise_K.begin(), field.temperature_rise_K.end());
}

TEST(FieldCommand, FollowsAConstantPowerInBothModels) {
  const Sandbox sandbox;
  const std::string rest = "--power 0.03 --times 0.1,0.01 " + kSmall;
  ASSERT_EQ(sandbox.run("field --out full " + rest).exit_code, 0);
  ASSERT_EQ(sandbox.run("field --model reduced --out reduced " + rest).exit_code, 0);
  const ProgramResult response =
      sandbox.run("response --model full --power 0.03 --times 0.1 --csv -" + kSmall);
  const double peak = std::stod(response.out.substr(response.out.find("\n0.1,") + 5));
  for (const std::string name : {"full", "reduced"}) {
    SCOPED_TRACE(name);
    const std::string file = (sandbox.path(name) / "field_0001.vtr").string();
    const TemperatureField field = from_vtr(read_all(file), file);
    EXPECT_NEAR(field.time_s, 0.1, 1e-12) << "files are in the order of time";
    // The hottest cell is beside the peak's place: cells of 1 um, curvature of 1 K per (10 um)^2.
    EXPECT_NEAR(highest(field), peak, 0.02 * peak);
    EXPECT_NE(read_all(sandbox.path(name) / "fields.pvd").find("field_0001.vtr"),
              std::string::npos);
  }
}

TEST(FieldCommand, RepeatsARun) {
  const Sandbox sandbox;
  ASSERT_EQ(sandbox.run("simulate --out run --set run.duration_ms=20" + kSmall).exit_code, 0);
  const std::string file = (sandbox.path("run") / "field.vtr").string();
  const std::string at_the_peak = read_all(file);
  const double time = from_vtr(at_the_peak, file).time_s;
  std::ostringstream command;
  command << "field --run run --out fields --times " << time;
  ASSERT_EQ(sandbox.run(command.str()).exit_code, 0);
  EXPECT_EQ(read_all(sandbox.path("fields") / "field_0000.vtr"), at_the_peak);
}

TEST(FieldCommand, RefusesBadInput) {
  const Sandbox sandbox;
  for (const std::string arguments :
       {"field --out f --times 0.1", "field --out f --power 0.03 --run x --times 0.1",
        "field --out f --power 0.03 --times 0.0015", "field --out f --power -1 --times 0.1"}) {
    EXPECT_EQ(sandbox.run(arguments + kSmall).exit_code, 2) << arguments;
  }
  EXPECT_EQ(sandbox.entries(), 0U);
}

TEST(ExportCommand, WritesMatricesOfOneSystem) {
  const Sandbox sandbox;
  ASSERT_EQ(sandbox.run("export --alphas 0.5,1.1 --out m" + kSmall).exit_code, 0);
  const auto header = [&](const std::string& name) {
    std::istringstream text(read_all(sandbox.path("m") / name));
    std::string first;
    std::getline(text, first);
    EXPECT_EQ(first.rfind("%%MatrixMarket matrix coordinate real ", 0), 0U) << name;
    std::size_t rows = 0, columns = 0, entries = 0, lines = 0;
    text >> rows >> columns >> entries;
    std::size_t row = 0, column = 0;
    double value = 0.0;
    while (text >> row >> column >> value) {
      EXPECT_TRUE(row >= 1 && row <= rows && column >= 1 && column <= columns);
      ++lines;
    }
    EXPECT_EQ(lines, entries) << name;
    return std::pair(rows, columns);
  };
  const auto [states, same] = header("A.mtx");
  EXPECT_GE(states, 3000U);
  EXPECT_EQ(states, same);
  EXPECT_EQ(header("E.mtx"), std::pair(states, states));
  EXPECT_EQ(header("B.mtx"), std::pair(states, std::size_t{2}));
  EXPECT_EQ(header("C.mtx"), std::pair(std::size_t{3}, states));
  const std::string csv = read_all(sandbox.path("m") / "validation.csv");
  EXPECT_EQ(csv.substr(0, csv.find('\n')),
            "signal,time_s,power_W,peak_K_alpha_0.5,peak_K_alpha_1.1,volume_K_alpha_0.5,"
            "volume_K_alpha_1.1");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 2 * 400);
  EXPECT_EQ(sandbox.run("export --alphas -1 --out n" + kSmall).exit_code, 2);
}

}  // namespace
}  // namespace photocoag::testing
