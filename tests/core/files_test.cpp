#include "photocoag/core/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

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

// A planted link, also under the name that earlier versions gave to what they were writing.
TEST(Files, WhatIsBeingWrittenFollowsNoLink) {
  const TemporaryFolder folder;
  write_file(folder.file("private"), "secret");
  for (const std::string& name :
       {fmt::format("a.part{}", getpid()), fmt::format(".photocoag-{}-0.part", getpid()),
        fmt::format(".photocoag-{}-1.part", getpid())}) {
    std::filesystem::create_symlink(folder.file("private"), folder.file(name));
  }
  write_file(folder.file("a"), "new");
  EXPECT_EQ(read_file(folder.file("private"), 100), "secret");
  EXPECT_EQ(read_file(folder.file("a"), 100), "new");
  EXPECT_FALSE(std::filesystem::is_symlink(folder.file("a")));
}

TEST(Files, LinksStayAndTheirTargetsAreReplaced) {
  const TemporaryFolder folder;
  const auto link = [&](const char* to, const char* name) {
    std::filesystem::create_symlink(to, folder.file(name));
  };
  std::filesystem::create_directory(folder.file("below"));
  write_file(folder.file("below/real"), "old");
  chmod(folder.file("below/real").c_str(), 0640);
  link("below/real", "one");
  link("one", "two");
  link("below/new", "dangling");
  link("circle", "circle");
  write_file(folder.file("two"), "new");
  write_file(folder.file("dangling"), "made");
  EXPECT_EQ(read_file(folder.file("below/real"), 100), "new");
  EXPECT_EQ(read_file(folder.file("below/new"), 100), "made");
  struct stat status {};
  ASSERT_EQ(stat(folder.file("below/real").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0640U);
  for (const char* name : {"one", "two", "dangling"}) {
    EXPECT_TRUE(std::filesystem::is_symlink(folder.file(name))) << name;
  }
  const std::string circle = folder.file("circle");
  EXPECT_EQ(message_of([&] { write_file(circle, "x"); }).rfind(circle, 0), 0U);
}

TEST(Files, PipesAndDevicesAreWrittenToAndStay) {
  const TemporaryFolder folder;
  const std::string pipe = folder.file("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  std::string seen;
  std::thread reader([&] {
    std::ifstream stream(pipe, std::ios::binary);
    seen.assign(std::istreambuf_iterator<char>(stream), {});
  });
  write_file(pipe, "through");
  reader.join();
  EXPECT_EQ(seen, "through");
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));
  // A device of the test's own, if it may make one: a failure here must not cost /dev/null.
  const std::string null = folder.file("null");
  if (mknod(null.c_str(), S_IFCHR | 0600, makedev(1, 3)) == 0) {
    write_file(null, "x");
    EXPECT_TRUE(std::filesystem::is_character_file(null));
  }
  const std::string full = folder.file("full");
  if (mknod(full.c_str(), S_IFCHR | 0600, makedev(1, 7)) == 0) {
    EXPECT_NE(message_of([&] { write_file(full, "x"); }).find("No space"), std::string::npos);
  }
}

// Behind >> there is something already: it stays.
TEST(Files, AnOpenFileOfTheProcessIsWrittenToWhereItStands) {
  const TemporaryFolder folder;
  write_file(folder.file("a"), "before ");
  const int file = open(folder.file("a").c_str(), O_WRONLY | O_APPEND);
  ASSERT_GE(file, 0);
  for (const char* form : {"/dev/fd/{}", "/proc/self/fd/{}"}) {
    write_file(fmt::format(fmt::runtime(form), file), "after ");
  }
  close(file);
  EXPECT_EQ(read_file(folder.file("a"), 100), "before after after ");
}

TEST(Files, LibrariesThatNeedANameWriteIntoMemory) {
  const std::string content(200'000, 'x');
  EXPECT_EQ(written_by([&](const std::string& name) { std::ofstream(name) << content; }), content);
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
