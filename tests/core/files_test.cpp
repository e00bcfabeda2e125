#include "photocoag/core/files.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <thread>

#include "photocoag/core/error.hpp"
#include "support/temporary_folder.hpp"
#include "support/thrown.hpp"

namespace photocoag {
namespace {

using testing::message_of;
using testing::TemporaryFolder;

std::size_t entries(const std::filesystem::path& folder) {
  std::size_t count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder)) ++count;
  return count;
}

TEST(Files, GiveBackEveryByte) {
  const TemporaryFolder folder;
  std::string content;
  for (int i = 0; i < 1000; ++i) content += static_cast<char>(i % 256);
  write_file(folder.file("a"), content);
  EXPECT_EQ(read_file(folder.file("a"), 1000), content);
  write_file(folder.file("a"), "");
  EXPECT_EQ(read_file(folder.file("a"), 1000), "");
  EXPECT_EQ(entries(folder.path()), 1U);  // nothing left over from the writing
}

// Readers that look at the file at any moment see one of the two contents, whole.
TEST(Files, AreReplacedAsAWhole) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a");
  const std::string contents[2] = {std::string(300000, 'x'), std::string(200000, 'y')};
  write_file(path, contents[0]);
  std::atomic<bool> done = false;
  std::thread writer([&] {
    for (int i = 1; i <= 60; ++i) write_file(path, contents[i % 2]);
    done = true;
  });
  int torn = 0;
  while (!done) {
    // An open file stays the one it was when opened; a mixture would come from writing in place.
    std::ifstream stream(path, std::ios::binary);
    const std::string seen{std::istreambuf_iterator<char>(stream), {}};
    if (seen != contents[0] && seen != contents[1]) ++torn;
  }
  writer.join();
  EXPECT_EQ(torn, 0);
  EXPECT_EQ(read_file(path, 1000000), contents[0]);
}

TEST(Files, RefusedToReadWithTheNameInTheMessage) {
  const TemporaryFolder folder;
  write_file(folder.file("large"), std::string(101, 'x'));
  ASSERT_EQ(mkfifo(folder.file("pipe").c_str(), 0600), 0);
  for (const std::string name : {"missing", "large", "pipe", "."}) {
    const std::string path = folder.file(name);
    const std::string message = message_of([&] { read_file(path, 100); });
    EXPECT_EQ(message.rfind(path, 0), 0U) << message;
  }
  EXPECT_NE(message_of([&] { read_file(folder.file("large"), 100); }).find("larger than"),
            std::string::npos);
  EXPECT_NO_THROW(read_file(folder.file("large"), 101));
}

TEST(Files, FailedWriteNamesTheFileAndLeavesNothing) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.file("folder"));
  for (const std::string name : {"missing/a", "folder"}) {
    const std::string path = folder.file(name);
    EXPECT_EQ(message_of([&] { write_file(path, "x"); }).rfind(path, 0), 0U);
  }
  EXPECT_EQ(entries(folder.path()), 1U);
}

}  // namespace
}  // namespace photocoag
