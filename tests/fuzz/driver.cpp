// Runs a fuzz target without libFuzzer: every file of a folder, then so many mutations of them,
// drawn from a fixed seed. Usage: PROGRAM CORPUS COUNT. Ends by itself only if nothing was found.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size);

namespace {

using Generator = std::mt19937_64;

std::size_t below(Generator& random, std::size_t limit) {
  return limit == 0 ? 0 : static_cast<std::size_t>(random() % limit);
}

void mutate(std::string& text, const std::vector<std::string>& corpus, Generator& random) {
  static const std::vector<std::string> kWords = {"nan",
                                                  "inf",
                                                  "-1",
                                                  "0",
                                                  "1e999",
                                                  "1e-320",
                                                  "2147483648",
                                                  "null",
                                                  "[",
                                                  "]",
                                                  "{",
                                                  "}",
                                                  "\"",
                                                  "=",
                                                  "\n",
                                                  "\xff",
                                                  std::string(1, '\0'),
                                                  "18446744073709551616",
                                                  "-0.0",
                                                  "[[",
                                                  "''"};
  const std::size_t at = below(random, text.size() + 1);
  const std::size_t length = 1 + below(random, 16);
  switch (random() % 6) {
    case 0:
      if (!text.empty()) text[below(random, text.size())] ^= static_cast<char>(1U << random() % 8);
      break;
    case 1:
      text.erase(at, length);
      break;
    case 2:
      text.insert(at, kWords[below(random, kWords.size())]);
      break;
    case 3:
      text.insert(at, text.substr(below(random, text.size() + 1), length));
      break;
    case 4:
      text.resize(at);
      break;
    default: {  // the tail of another one
      const std::string& other = corpus[below(random, corpus.size())];
      text = text.substr(0, at) + other.substr(below(random, other.size() + 1));
    }
  }
}

void run(const std::string& text) {
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(argv[1])) files.push_back(entry);
  std::sort(files.begin(), files.end());  // the same order everywhere
  std::vector<std::string> corpus;
  for (const auto& file : files) {
    std::ifstream stream(file, std::ios::binary);
    corpus.emplace_back(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
    run(corpus.back());
  }
  if (corpus.empty()) return 2;
  Generator random(1);
  const long count = std::atol(argv[2]);
  for (long k = 0; k < count; ++k) {
    std::string text = corpus[below(random, corpus.size())];
    for (std::size_t n = 1 + below(random, 4); n > 0; --n) mutate(text, corpus, random);
    run(text);
  }
  std::printf("%zu files, %ld mutations: no finding\n", corpus.size(), count);
  return 0;
}
