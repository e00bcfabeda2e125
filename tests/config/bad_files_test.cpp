// Files that are not configurations: refused with a message, never a crash or a hang.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "config/temporary_folder.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

std::string refusal(const std::string& file) {
  try {
    load_config(file, {});
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

class BadFile : public testing::Test {
 protected:
  void expect_text(std::string_view text, const std::string& place, const std::string& part) {
    const std::string file = folder_.write("bad.toml", text);
    const std::string message = refusal(file);
    EXPECT_EQ(message.substr(0, file.size() + place.size()), file + place);
    EXPECT_NE(message.find(part), std::string::npos) << message;
    EXPECT_LT(message.size(), 1000U);
  }
  TemporaryFolder folder_;
};

TEST_F(BadFile, EmptyAndHarmlessOnesAreTheDefaults) {
  for (const char* text : {"", "\n", "# nothing\r\n", "\xEF\xBB\xBF", "\xEF\xBB\xBF# x\n",
                           "[control]\r\nperiod_ms = 1.0\r\n", "[plant.tissue]\n"}) {
    EXPECT_EQ(load_config(folder_.write("c.toml", text), {}), Config{}) << text;
  }
}

TEST_F(BadFile, NotARegularFile) {
  EXPECT_EQ(refusal(folder_ / "missing.toml"),
            folder_ / "missing.toml" +
                std::string(": cannot be read: No such file or directory; accepted: a regular TOML "
                            "file of at most 1 MB"));
  EXPECT_NE(refusal(folder_.path().string()).find(": a directory; accepted"), std::string::npos);
  EXPECT_NE(refusal("/dev/zero").find(": not a regular file"), std::string::npos);
  ASSERT_EQ(mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  EXPECT_NE(refusal(folder_ / "pipe").find(": not a regular file"), std::string::npos);
  fs::create_symlink("loop", folder_.path() / "loop");
  EXPECT_NE(refusal(folder_ / "loop").find("symbolic links"), std::string::npos);
  EXPECT_NE(refusal(std::string("a\0b", 3)).find("zero byte"), std::string::npos);
}

TEST_F(BadFile, TooLarge) {
  EXPECT_EQ(load_config(folder_.write("c.toml", std::string(1'000'000, '\n')), {}), Config{});
  expect_text(std::string(1'000'001, '\n'), ": larger than 1 MB", "at most 1 MB");
  expect_text(std::string(10'000'000, ' '), ": larger than 1 MB", "at most 1 MB");
}

TEST_F(BadFile, NotToml) {
  expect_text("[control\n", ":1:9: not TOML: ", "[control");
  expect_text("\n\nperiod_ms 1\n", ":3:", "the line `period_ms 1`");
  expect_text("[control]\nperiod_ms = 1e999\n", ":2:", "the line `period_ms = 1e999`");
  expect_text("[run]\nseed = 9223372036854775808\n", ":2:", "64 bits");
  expect_text("[control]\nhorizon = 2\nhorizon = 3\n", ":3:", "cannot redefine");
  expect_text("[control]\nhorizon = 2\n[control]\nperiod_ms = 1\n", ":3:", "cannot redefine");
  expect_text("# \xFF\xFE\n", ":1:", "utf-8");
  expect_text("model.file = \"a\xC3\"\n", ":1:", "utf-8");
  expect_text(std::string_view("a = 1\0\n", 7), ":1:", "a zero byte");
  expect_text("\xFF\xFE[\0c\0", ":1:1: not TOML", "utf-8");
  expect_text("control.period_ms =\n", ":1:", "not TOML");
  expect_text("control.solver = dense\n", ":1:", "the line `control.solver = dense`");
}

TEST_F(BadFile, DeeplyNested) {
  expect_text("a = " + std::string(10000, '['), ":1:", "nested value depth");
  expect_text("a = " + std::string(10000, '[') + std::string(10000, ']'), ":1:", "not TOML");
  std::string tables = "a = ";
  for (int i = 0; i < 10000; ++i) tables += "{a=";
  expect_text(tables, ":1:", "nested value depth");
  std::string dotted = "[a";
  for (int i = 0; i < 200000; ++i) dotted += ".a";
  expect_text("\n" + dotted + "]\n", ":2: too many dots in a line", "at most 64");
  std::string both;  // as deep as the two limits let it
  for (int i = 0; i < 127; ++i) {
    both += "a";
    for (int j = 0; j < 63; ++j) both += ".a";
    both += i < 126 ? " = [\n{" : " = 1";
  }
  for (int i = 0; i < 126; ++i) both += "}\n]";
  expect_text(both, ":", "a: unknown key");
}

TEST_F(BadFile, ManyEntriesTakeNoTime) {
  std::string text;
  for (int i = 0; text.size() < 990'000; ++i)
    text.append("a").append(std::to_string(i)).append(" = 1\n");
  expect_text(text, ":1: a0: unknown key", "");
  text.clear();
  while (text.size() < 990'000) text += "[[a]]\nb=1.5\n";
  expect_text(text, ":1: a: unknown key", "");
}

TEST_F(BadFile, LongAndStrangeKeysAreShownSafely) {
  expect_text(std::string(100'000, 'a') + " = 1\n", ":1: aaaa", "unknown key");
  expect_text("\"\\u001B[31m\" = 1\n", ":1: ", "unknown key");
  EXPECT_EQ(refusal(folder_ / "bad.toml").find('\x1B'), std::string::npos);
}

// Whatever happens to a good file, the answer is a configuration or an Error.
TEST_F(BadFile, RandomDamage) {
  const std::string good = to_toml(load_config("", {"plant.tissue.ambient_C=20"}));
  std::mt19937_64 random(5);
  constexpr std::string_view kPieces = "[]{}=.,#\"'\\\n\r\t -+_0e9\xFF\xC3n";
  int refused = 0;
  for (int i = 0; i < 200; ++i) {
    std::string text = good;
    for (std::size_t n = 1 + random() % 3; n > 0; --n) {
      const std::size_t at = random() % text.size();
      const char piece = kPieces[random() % kPieces.size()];
      switch (random() % 4) {
        case 0:
          text[at] = piece;
          break;
        case 1:
          text.insert(at, 1 + random() % 3, piece);
          break;
        case 2:
          text.erase(at, 1 + random() % 40);
          break;
        default:
          text.resize(at + 1);
      }
    }
    const std::string message = refusal(folder_.write("damaged.toml", text));
    if (message == "accepted") continue;
    ++refused;
    EXPECT_EQ(message.find(folder_ / "damaged.toml"), 0U) << message;
  }
  EXPECT_GT(refused, 50);
}

}  // namespace
}  // namespace photocoag
