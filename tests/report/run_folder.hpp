// A run folder in a temporary place, with a short realistic run that a test can change.
#pragma once

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

namespace photocoag::testing {

struct RunFolder {
  std::filesystem::path path;
  int cycles = 60;
  double period_s = 1e-3;
  bool truth = true;
  std::string stopped_for = "null";  ///< JSON
  std::string timing = "";           ///< JSON members after the others, with a comma in front
  std::string config_comment = "# the whole configuration";
  double peak_sigma_K = 0.0;  ///< 0: the run has no such column
  double height = 30.25;      ///< K, at which the true peak is held
  int violation_at = -1;      ///< this cycle's true peak is 40 K

  RunFolder() {
    static int count = 0;
    path = std::filesystem::temp_directory_path() /
           fmt::format("photocoag_report_{}_{}", ::getpid(), count++);
    std::filesystem::create_directories(path);
  }
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;
  ~RunFolder() { std::filesystem::remove_all(path); }

  void put(const std::string& name, const std::string& text) const {
    std::ofstream(path / name, std::ios::binary) << text;
  }
  std::string get(const std::string& name) const {
    std::ostringstream text;
    text << std::ifstream(path / name, std::ios::binary).rdbuf();
    return text.str();
  }

  double peak(int cycle) const {
    if (cycle == violation_at) return 40.0;
    return height * (1.0 - std::exp(-(cycle + 1) * period_s / 2e-3));
  }

  void write() const {
    std::string csv =
        "cycle,time_s,power_W,volume_true_K,volume_measured_K,volume_estimate_K,peak_true_K,"
        "peak_estimate_K,absorption_estimate,absorption_sigma,power_reference_W,solver_status,"
        "solver_iterations,something_new";
    csv += peak_sigma_K > 0.0 ? ",peak_sigma_K\n" : "\n";
    double highest = 0.0, highest_estimate = 0.0;
    for (int k = 0; k < cycles; ++k) {
      const double y = peak(k);
      highest = std::max(highest, y);
      highest_estimate = std::max(highest_estimate, 30.0 * y / 30.25);
      fmt::format_to(std::back_inserter(csv), "{},{},{},{},{},{},{},{},{},{},{},{},{},7{}\n", k,
                     (k + 1) * period_s, k < 3 ? 0.1 : 0.025,
                     truth ? fmt::format("{}", 0.8 * y) : "", 0.8 * y + 0.1 * std::sin(7.0 * k),
                     0.79 * y, truth ? fmt::format("{}", y) : "", 30.0 * y / 30.25,
                     1.1 - 0.36 / (k + 1.0), 0.25 / (k + 1.0), 0.0225,
                     k == 2 ? "iteration_limit" : "solved", 1 + k % 4,
                     peak_sigma_K > 0.0 ? fmt::format(",{}", peak_sigma_K) : "");
    }
    put("run.csv", csv);
    put("config.toml", config_comment +
                           "\n[control]\npeak_reference_K = 30.0\npeak_max_K = 32.0\n"
                           "power_max_W = 0.1\n[tissue]\nambient_C = 22.0\n"
                           "[plant]\nabsorption_factor = 1.1\n");
    const std::string none = "null";
    put("summary.json",
        fmt::format(
            "{{\"peak_true_max_K\": {}, \"peak_estimate_max_K\": {}, \"limit_K\": 32.0,\n"
            "\"limit_violations\": {}, \"limit_active_cycles\": 4, \"time_to_95_percent_s\": {},\n"
            "\"rms_error_after_50_ms_K\": {}, \"absorption_error_final\": -0.00545,\n"
            "\"cycles\": {}, \"overruns\": 17, \"full_order_states\": 80641, \"stopped_for\": {},\n"
            "\"seed\": 123456789, \"config_sha256\": \"{:0>64}\", \"version\": "
            "\"0.1.0-test\"{}}}\n",
            truth ? fmt::format("{}", highest) : none, highest_estimate,
            truth ? fmt::format("{}", violation_at >= 0 ? 1 : 0) : none,
            truth && height >= 28.5 ? "0.006" : "null", truth ? "0.249" : "null", cycles,
            stopped_for, "abc", timing));
  }
};

inline std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++count;
  return count;
}

// Empty if every tag of an XML text is closed in order and every attribute is quoted; else the
// first problem.
inline std::string xml_problem(const std::string& text) {
  std::vector<std::string> open;
  for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at + 1)) {
    const std::size_t end = text.find('>', at);
    if (end == std::string::npos) return "a tag does not end";
    std::string tag = text.substr(at + 1, end - at - 1);
    at = end;
    if (tag.starts_with('?')) continue;
    if (tag.find('<') != std::string::npos) return "a tag in a tag: " + tag;
    if (count_of(tag, "\"") % 2 != 0) return "quotes: " + tag;
    const std::string name =
        tag.substr(tag.starts_with('/'), tag.find_first_of(" /\n", 1) - tag.starts_with('/'));
    if (tag.starts_with('/')) {
      if (open.empty() || open.back() != tag.substr(1)) return "closes what is not open: " + tag;
      open.pop_back();
    } else if (!tag.ends_with('/')) {
      open.push_back(name);
    }
  }
  return open.empty() ? "" : "not closed: " + open.back();
}

}  // namespace photocoag::testing
