// Role: tests; the exact step responses of tests/oracle (what they are: the README there).
#pragma once

#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "photocoag/tissue/tissue.hpp"
#include "support/tissues.hpp"

namespace photocoag::testing {

struct OracleRow {
  double time;               // s
  double peak;               // K/W
  double volume;             // K/W, absorption-weighted
  double volume_normalized;  // K/W
};

struct OracleCase {
  std::string file;
  double alpha;
  Tissue tissue;
};

/// Every file with the geometry that its first line tells.
inline std::vector<OracleCase> oracle_cases() {
  return {{"paper_alpha_0.3.csv", 0.3, Tissue{}},
          {"paper_alpha_0.7363.csv", 0.7363, Tissue{}},
          {"paper_alpha_1.1.csv", 1.1, Tissue{}},
          {"literature_choroid_alpha_0.7363.csv", 0.7363, literature_choroid()},
          {"vitreous_alpha_0.7363.csv", 0.7363, with_vitreous()}};
}

inline std::string oracle_folder() { return std::string(PHOTOCOAG_SOURCE_DIR) + "/tests/oracle/"; }

inline std::vector<OracleRow> read_oracle(const std::string& file) {
  std::ifstream stream(oracle_folder() + file);
  std::string line;
  std::getline(stream, line);  // the geometry
  std::getline(stream, line);
  if (line != "time_s,peak_K_per_W,volume_K_per_W,volume_normalized_K_per_W") {
    throw std::runtime_error("unexpected columns in " + file);
  }
  std::vector<OracleRow> rows;
  while (std::getline(stream, line)) {
    std::istringstream fields(line);
    OracleRow row{};
    char comma = 0;
    fields >> row.time >> comma >> row.peak >> comma >> row.volume >> comma >>
        row.volume_normalized;
    if (!fields) throw std::runtime_error("cannot read " + file + ": " + line);
    rows.push_back(row);
  }
  return rows;
}

}  // namespace photocoag::testing
