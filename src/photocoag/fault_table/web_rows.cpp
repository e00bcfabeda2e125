// Row L2 of the fault table: the console's server under attack while a spot runs. Every power is
// what the controller computes without clients.
#include <fmt/format.h>

#include <atomic>
#include <csignal>
#include <iterator>
#include <thread>

#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/fault_table/process_bench.hpp"
#include "photocoag/fault_table/program_run.hpp"
#include "photocoag/fault_table/raw_client.hpp"
#include "photocoag/rt/clock.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

constexpr double kPatience = 120.0;  // s
constexpr std::size_t kMostText = std::size_t{1} << 26;

struct Address {
  std::uint16_t port = 0;
  std::string token;
};

// What the program prints once it listens.
Address address_in(const fs::path& said) {
  const std::int64_t end = monotonic_ns() + static_cast<std::int64_t>(kPatience * 1e9);
  constexpr std::string_view kBefore = "http://127.0.0.1:";
  constexpr std::string_view kBetween = "/#token=";
  while (monotonic_ns() < end) {
    const std::string text = read_file(said.string(), kMostText);
    const std::size_t port = text.find(kBefore);
    const std::size_t token = text.find(kBetween);
    const std::size_t line = text.find('\n', token);
    if (token != std::string::npos && line != std::string::npos) {
      const std::size_t secret = token + kBetween.size();
      return {static_cast<std::uint16_t>(std::stoi(text.substr(port + kBefore.size()))),
              text.substr(secret, line - secret)};
    }
    wait_until(monotonic_ns() + 10'000'000);
  }
  throw Error("the console does not come up");
}

// A hundred clients at once, with and without the token, most of them rude, until told to stop.
void attack(const Address& at, const std::atomic<bool>& over) {
  const std::string frames[] = {web_frame(1, std::string(1 << 20, 'a')),
                                web_frame(1, "{}", std::uint64_t{1} << 31),
                                web_frame(2, "\x01\x02"),
                                web_frame(1, "{\"command\":"),
                                web_frame(1, "{\"command\":\"start\"}"),
                                web_frame(9, "ping"),
                                std::string(4096, '\xff')};
  for (std::size_t round = 0; !over; ++round) {
    std::vector<RawClient> crowd;
    for (std::size_t k = 0; k < 100 && !over; ++k) {
      try {
        crowd.emplace_back(at.port, 1024);
        const bool knows = k % 2 == 0;
        crowd.back().upgrade({.token = knows ? at.token : "guessed",
                              .origin = k % 3 == 0 ? "http://evil.example" : "",
                              .host = {}});
        crowd.back().send(frames[(k + round) % std::size(frames)]);
      } catch (const Error&) {  // refused: as it should
      }
    }
    // They read nothing meanwhile.
    wait_until(monotonic_ns() + 20'000'000);
  }
}

std::string ask(RawClient& client, std::string_view command) {
  client.say(fmt::format(R"({{"command":"{}"}})", command));
  const std::string done = R"("done":true)";
  const std::string answer = client.hear_of(R"("type":"answer")", kPatience).value_or("no answer");
  return answer.find(done) != std::string::npos ? "" : fmt::format("{}: {}", command, answer);
}

// The operator: arms, starts, sees the spot through.
std::string operate(const Address& at) {
  RawClient client(at.port);
  if (client.upgrade({.token = at.token, .origin = {}, .host = {}}) != 101) return "not let in";
  if (!client.hear_of(R"("state":"standby")", kPatience)) return "no standby";
  for (const char* command : {"arm", "start"}) {
    if (const std::string why = ask(client, command); !why.empty()) return why;
  }
  if (!client.hear_of(R"("state":"treating")", kPatience)) return "no spot";
  std::atomic<bool> over{false};
  std::thread attackers([&] { attack(at, over); });
  const bool ended = client.hear_of(R"("type":"spot")", kPatience).has_value();
  over = true;
  attackers.join();
  return ended ? "" : "the operator lost the console before the spot ended";
}

std::string under_attack(const ProcessFaultOptions& options, double absorption, bool& refused) {
  const ScratchFolder folder;
  const Arguments settings = {"--set", "grid.min_cells=2000",
                              "--set", fmt::format("plant.absorption_factor={}", absorption),
                              "--set", "run.duration_ms=1500"};
  Arguments arguments = {"console", "--out", "out"};
  arguments.insert(arguments.end(), settings.begin(), settings.end());
  std::string why;
  const ProgramRun run = run_program(options, folder.path(), arguments,
                                     {.environment = {}, .during = [&](pid_t child) {
                                        try {
                                          why = operate(address_in(folder.path() / "said.txt"));
                                        } catch (const Error& error) {
                                          why = error.what();
                                        }
                                        kill(child, SIGINT);
                                      }});
  refused = run.said.find("refused   ") != std::string::npos;
  if (!why.empty()) return why;
  if (run.code > 1) return fmt::format("exit code {}: {}", run.code, last_line(run.said));
  if (!refused) return "nothing was refused";
  const fs::path spot = folder.path() / "out" / "spot-001";
  const ProgramRun again = run_program(options, folder.path(), {"replay", spot.string()});
  if (again.code != 0) return "the powers differ: " + last_line(again.said);
  // Where nothing overran they are those of virtual time.
  if (run.said.find(" 0 overruns") == std::string::npos) return {};
  Arguments alone = {"simulate", "--out", "alone"};
  alone.insert(alone.end(), settings.begin(), settings.end());
  run_program(options, folder.path(), alone);
  const auto csv = [](const fs::path& run_folder) {
    return read_file((run_folder / "run.csv").string(), kMostText);
  };
  return csv(spot) == csv(folder.path() / "alone") ? "" : "run.csv differs from simulate's";
}

}  // namespace

void run_web_row(const ProcessFaultOptions& options, FaultRow& row) {
  for (const double absorption : options.absorptions) {
    bool refused = false;
    const std::string why = under_attack(options, absorption, refused);
    count(row, why, refused);
  }
}

}  // namespace photocoag
