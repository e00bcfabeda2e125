// Role: tests of the documents; reads Markdown.
#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace photocoag::testing {

inline std::filesystem::path source_folder() { return PHOTOCOAG_SOURCE_DIR; }

inline std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error("cannot read " + file.string());
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Every .md file of the repository: the root, docs/, tests/ and benchmarks/.
inline std::vector<std::filesystem::path> documents() {
  namespace fs = std::filesystem;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(source_folder())) {
    if (entry.path().extension() == ".md") files.push_back(entry.path());
  }
  for (const char* folder : {"docs", "tests", "benchmarks"}) {
    for (const auto& entry : fs::recursive_directory_iterator(source_folder() / folder)) {
      if (entry.path().extension() == ".md") files.push_back(entry.path());
    }
  }
  return files;
}

/// The lines of a document outside (code = false) or inside (code = true) of fenced blocks. The
/// language of a fence selects: empty takes all.
inline std::vector<std::string> lines_of(const std::string& text, bool code,
                                         const std::string& language = "") {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  std::string line;
  bool inside = false;
  std::string fence;
  while (std::getline(stream, line)) {
    if (line.rfind("```", 0) == 0) {
      inside = !inside;
      fence = inside ? line.substr(3) : "";
      continue;
    }
    if (inside == code && (!inside || language.empty() || fence == language)) lines.push_back(line);
  }
  return lines;
}

}  // namespace photocoag::testing
