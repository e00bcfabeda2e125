// Other programs: everything passes through, no shell, and an end whatever they do.
#include "photocoag/core/process.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "photocoag/core/error.hpp"
#include "photocoag/core/stop_signal.hpp"

namespace photocoag {
namespace {

constexpr double kNoTimeout = 1e6;  // s

TEST(Process, PassesMuchInputAndOutputThrough) {
  const std::string text(3'000'000, 'x');
  const ProgramResult result = run_program({"cat"}, {.input = text});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.output, text);
}

TEST(Process, UsesNoShellAndSurvivesAChildThatDoesNotRead) {
  EXPECT_EQ(run_program({"echo", "$(id); `id` | x"}).output, "$(id); `id` | x\n");
  EXPECT_EQ(run_program({"false"}, {.input = std::string(3'000'000, 'x')}).exit_code, 1);
  EXPECT_FALSE(run_program({"no-such-program-of-that-name"}).found);
}

/// Runs the shell script in a child, whose message must hold `said`; the child writes its id first.
void expect_killed(const std::string& script, double patience, const std::string& said) {
  std::string file = ::testing::TempDir() + "/process-XXXXXX";
  const int id_file = mkstemp(file.data());
  ASSERT_GE(id_file, 0);
  try {
    run_program({"sh", "-c", "echo $$ >'" + file + "'; " + script}, {.patience = patience});
    ADD_FAILURE() << "it has ended";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(said), std::string::npos) << error.what();
  }
  char digits[16] = {};
  EXPECT_GT(read(id_file, digits, sizeof digits - 1), 0);
  close(id_file);
  unlink(file.c_str());
  EXPECT_NE(kill(std::atoi(digits), 0), 0) << "it still runs";
}

TEST(Process, OneThatHangsIsKilledWhenItsTimeIsOver) {
  const std::string said = "has not ended after 0.3 s";
  expect_killed("exec sleep 1000000", 0.3, said);
  expect_killed("trap '' TERM INT HUP; exec >&- 2>&-; while :; do sleep 1; done", 0.3, said);
  expect_killed("sleep 1000000 & exit", 0.3, said);  // what it has started holds its output open
}

TEST(Process, ASignalEndsTheWait) {
  struct sigaction before {};
  sigaction(SIGTERM, nullptr, &before);
  stop_on_signals({SIGTERM});
  // The program itself sends the signal: the wait has begun.
  expect_killed("kill -TERM $PPID; exec sleep 1000000", kNoTimeout,
                "stopped, as asked by a signal");
  EXPECT_TRUE(stop_requested());
  // One that came before does not count: a treatment that was stopped still gets its report.
  EXPECT_EQ(run_program({"echo", "drawn"}).output, "drawn\n");
  sigaction(SIGTERM, &before, nullptr);
}

TEST(Process, WaitsForAChildOfItsOwn) {
  const pid_t quick = fork();
  if (quick == 0) _exit(7);
  const std::optional<int> status = wait_for_child(quick, kNoTimeout);
  ASSERT_TRUE(status);
  EXPECT_EQ(WEXITSTATUS(*status), 7);
  const pid_t slow = fork();
  if (slow == 0) {
    for (;;) pause();
  }
  EXPECT_FALSE(wait_for_child(slow, 0.1));
  EXPECT_NE(kill(slow, 0), 0);
}

TEST(StopSignal, OneThatIsIgnoredStaysIgnored) {
  const pid_t child = fork();
  if (child == 0) {
    const int before = stop_requests();
    signal(SIGINT, SIG_DFL);
    signal(SIGHUP, SIG_IGN);  // nohup
    stop_on_signals();
    raise(SIGHUP);
    const bool kept = stop_requests() == before;
    raise(SIGINT);
    _exit(kept && stop_requested() && stop_requests() == before + 1 ? 0 : 1);
  }
  EXPECT_EQ(wait_for_child(child, kNoTimeout), 0);
}

}  // namespace
}  // namespace photocoag
