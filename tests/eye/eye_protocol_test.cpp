// What strangers, or broken programs, can do to an eye and its controller: nothing.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <thread>
#include <vector>

#include "eye/running_eye.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/rt/clock.hpp"
#include "photocoag/rt/eye_socket.hpp"
#include "support/thrown.hpp"

namespace photocoag::testing {
namespace {

std::size_t open_descriptors() {
  const std::filesystem::directory_iterator all("/proc/self/fd");
  return static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

int observer_descriptor(const std::string& socket) {
  const int connection = connect_to(socket);
  send_message(connection, "observe", 7);
  std::array<char, 64> answer{};
  std::array<int, 1> descriptor{};
  receive_message(connection, answer.data(), answer.size(), 5000, descriptor);
  close(connection);
  return descriptor[0];
}

TEST(EyeProtocol, AnObserverCanNeitherWriteNorResizeWhatItSees) {
  const RunningEye eye;
  const int descriptor = observer_descriptor(eye.socket());
  ASSERT_GE(descriptor, 0);
  EXPECT_NE(ftruncate(descriptor, 0), 0);
  EXPECT_NE(ftruncate(descriptor, 1 << 24), 0);
  EXPECT_LT(pwrite(descriptor, "x", 1, 0), 0);
  EXPECT_EQ(mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0), MAP_FAILED);
  const std::string again = "/proc/self/fd/" + std::to_string(descriptor);
  const int reopened = open(again.c_str(), O_RDWR | O_CLOEXEC);
  EXPECT_LT(pwrite(reopened, "x", 1, 0), 0);
  close(reopened);
  void* seen = mmap(nullptr, 4096, PROT_READ, MAP_SHARED, descriptor, 0);
  ASSERT_NE(seen, MAP_FAILED);
  EXPECT_NE(mprotect(seen, 4096, PROT_READ | PROT_WRITE), 0);
  munmap(seen, 4096);
  close(descriptor);
}

/// Answers one controller's handshake with `reply`.
void with_fake_eye(const std::function<void(int guest)>& reply,
                   const std::function<void(const std::string& socket)>& controller) {
  const TemporaryFolder folder;
  const Listener listener(folder.file("eye"));
  std::thread fake([&] {
    int guest = -1;
    while ((guest = listener.accept()) < 0) std::this_thread::yield();
    std::array<char, 256> message{};
    receive_message(guest, message.data(), message.size(), 5000);  // pulse-period
    send_message(guest, "500000", 6);
    receive_message(guest, message.data(), message.size(), 5000);  // hello
    reply(guest);
    receive_message(guest, message.data(), message.size(), 5000);  // until it has gone
    close(guest);
  });
  controller(folder.file("eye"));
  fake.join();
}

EyeLinkSettings link_to(const std::string& socket) {
  return {.socket = socket, .transport = EyeTransport::kSharedMemory, .period = kPeriod};
}

TEST(EyeProtocol, AFakeEyesMemoryIsLookedAtBeforeItIsUsed) {
  for (const bool sealed : {false, true}) {
    with_fake_eye(
        [&](int guest) {
          std::array<int, 2> empty{};
          for (int& descriptor : empty) {
            descriptor = memfd_create("fake", MFD_CLOEXEC | MFD_ALLOW_SEALING);
            // Sealed and too small; or large enough and shrunk later.
            const int done = sealed ? fcntl(descriptor, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW)
                                    : ftruncate(descriptor, sizeof(EyeSharedMemory));
            EXPECT_EQ(done, 0);
          }
          const EyeWelcome welcome{.start_ns = monotonic_ns(), .pulse_period_ns = 500'000};
          send_message(guest, &welcome, sizeof(welcome), empty);
          for (const int descriptor : empty) close(descriptor);
        },
        [&](const std::string& socket) {
          EXPECT_NE(message_of([&] { EyeDevice device(link_to(socket)); }).find("memory"),
                    std::string::npos);
        });
  }
}

TEST(EyeProtocol, AClockThatIsFarAheadIsNotWaitedFor) {
  with_fake_eye(
      [&](int guest) {
        std::array<int, 2> memory{-1, -1};
        const auto seen = make_sealed<EyeSharedMemory>(Access::kRead, memory[0]);
        const auto orders = make_sealed<EyeOrderMemory>(Access::kWrite, memory[1]);
        seen->magic = orders->magic = kEyeMagic;
        seen->size = sizeof(EyeSharedMemory);
        orders->size = sizeof(EyeOrderMemory);
        const EyeWelcome welcome{.start_ns = std::int64_t{1} << 62, .pulse_period_ns = 500'000};
        send_message(guest, &welcome, sizeof(welcome), memory);
        for (const int descriptor : memory) close(descriptor);
      },
      [&](const std::string& socket) {
        EXPECT_NE(message_of([&] { EyeDevice device(link_to(socket)); }).find("clock"),
                  std::string::npos);
      });
}

TEST(EyeProtocol, EveryDescriptorThatComesAlongIsClosed) {
  RunningEye eye;
  const int connection = connect_to(eye.socket());
  eye.status("pulses");
  const std::size_t before = open_descriptors();
  for (int i = 0; i < 20; ++i) {
    const std::array<int, 2> gifts{STDERR_FILENO, STDERR_FILENO};
    ASSERT_TRUE(send_message(connection, "status", 6, gifts));
    std::array<char, 1024> answer{};
    ASSERT_GT(receive_message(connection, answer.data(), answer.size(), 5000), 0);
  }
  EXPECT_LE(open_descriptors(), before + 5) << "40 were sent";
  close(connection);
}

TEST(EyeProtocol, AMessageThatIsTooLongIsRefused) {
  const RunningEye eye;
  EXPECT_NE(command_eye(eye.socket(), std::string(20'000, 'x')).find("too long"),
            std::string::npos);
}

TEST(EyeProtocol, ManyConnectionsKeepNobodyOut) {
  RunningEye eye;
  const std::size_t before = open_descriptors();
  std::vector<int> idle;
  for (int i = 0; i < 200; ++i) idle.push_back(connect_to(eye.socket()));
  EXPECT_NE(command_eye(eye.socket(), "status").find("pulses="), std::string::npos);
  EXPECT_LE(open_descriptors(), before + 200 + 20) << "the eye, in this process, keeps 16";
  const EyeDevice device(eye.link(EyeTransport::kSharedMemory));
  EXPECT_EQ(device.pulses_per_period(), 10);
  for (const int connection : idle) close(connection);
}

TEST(EyeProtocol, AServerThatTakesNoConnectionIsGivenUp) {
  const TemporaryFolder folder;
  const Listener listener(folder.file("deaf"));
  std::vector<int> waiting;
  std::string problem;
  while (problem.empty() && waiting.size() < 1000) {
    problem = message_of([&] { waiting.push_back(connect_to(folder.file("deaf"), 50)); });
  }
  EXPECT_NE(problem.find("accepts no connection"), std::string::npos) << problem;
  for (const int connection : waiting) close(connection);
}

TEST(EyeProtocol, OnlyASocketThatNobodyServesIsReplaced) {
  const TemporaryFolder folder;
  const std::string file = folder.file("precious");
  std::ofstream(file) << "data";
  EXPECT_NE(message_of([&] { Listener listener(file); }).find("no socket"), std::string::npos);
  EXPECT_EQ(std::filesystem::file_size(file), 4u);
  const std::string link = folder.file("link");
  std::filesystem::create_symlink(file, link);
  EXPECT_NE(message_of([&] { Listener listener(link); }).find("no socket"), std::string::npos);

  const std::string path = folder.file("eye");
  {
    const Listener first(path);
    EXPECT_NE(message_of([&] { Listener second(path); }).find("already"), std::string::npos);
    close(connect_to(path));
  }
  EXPECT_FALSE(std::filesystem::exists(path));
  // A socket whose server was killed.
  const int orphan = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof(address.sun_path) - 1);
  ASSERT_EQ(bind(orphan, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  close(orphan);
  const Listener again(path);
  close(connect_to(path));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 3);
}

TEST(EyeProtocol, TheSocketIsItsOwnersWhateverTheUmask) {
  const TemporaryFolder folder;
  const mode_t before = umask(0);
  {
    const Listener open_hearted(folder.file("a"));
    umask(0777);
    const Listener close_fisted(folder.file("b"));
    umask(before);
    for (const char* name : {"a", "b"}) {
      struct stat file {};
      ASSERT_EQ(stat(folder.file(name).c_str(), &file), 0);
      EXPECT_EQ(file.st_mode & 0777U, 0600U) << name;
    }
  }
}

TEST(EyeProtocol, AnAbstractNameServesAsWellAndLeavesNoFile) {
  const std::string name = "@photocoag-test-" + std::to_string(getpid());
  const Listener listener(name);
  EXPECT_FALSE(message_of([&] { Listener second(name); }).empty());
  close(connect_to(name));
  EXPECT_FALSE(std::filesystem::exists(name));
}

TEST(EyeProtocol, CommandsForLaterPeriodsFeedNoWatchdog) {
  RunningEye eye;
  EyeLink link(eye.socket(), EyeTransport::kSharedMemory, 5'000'000);
  while (link.pulses() == 0) std::this_thread::yield();
  link.lockstep();
  const auto upto = [&](std::uint64_t pulses) {
    link.grant(pulses);
    while (link.pulses() < pulses) std::this_thread::yield();
  };
  const std::uint64_t first = link.pulses() / 10 + 2;
  upto(first * 10);
  link.command(first, 0.02, 1);
  upto(first * 10 + 5);
  // One by one, all far off: were they fed, there would be light for as long as they come.
  for (std::uint64_t k = 0; k < 8; ++k) {
    link.command(first + 50 + k, 0.02, 2 + k);
    upto((first + 1 + k) * 10 + 5);
  }
  PulseRecord record;
  ASSERT_TRUE(link.record((first + 1) * 10, record));
  EXPECT_EQ(record.power_readback, 0.02);
  for (std::uint64_t p = (first + 2) * 10; p < (first + 8) * 10; ++p) {
    ASSERT_TRUE(link.record(p, record));
    EXPECT_EQ(record.power_readback, 0.0) << p - first * 10;
  }
  // Nor do they hold when their period comes.
  upto((first + 60) * 10);
  for (std::uint64_t p = (first + 49) * 10; p < (first + 60) * 10; ++p) {
    ASSERT_TRUE(link.record(p, record));
    EXPECT_EQ(record.power_readback, 0.0) << p;
  }
}

TEST(EyeProtocol, APowerBeyondTheEyesLimitIsRefusedAndSaidToBe) {
  RunningEye eye(false, 10.0, 0.05);
  EyeDevice device(eye.link(EyeTransport::kSharedMemory));
  EXPECT_EQ(device.welcome().power_max, 0.05);
  device.follow_in_lockstep();
  device.begin(4);
  device.write_power(0.05, 1);
  device.wait_sample(0);
  EXPECT_EQ(device.readback().power, 0.05);
  EXPECT_EQ(device.write_power(0.0501, 2), DeviceStatus::kGood);
  device.wait_sample(1);
  EXPECT_EQ(device.readback().power, 0.0);
  EXPECT_EQ(device.write_power(0.02, 3), DeviceStatus::kTimeout) << "the last write was refused";
  EXPECT_EQ(eye.status("refused"), 1);
  device.wait_sample(2);
  EXPECT_EQ(device.readback().power, 0.02);
}

}  // namespace
}  // namespace photocoag::testing
