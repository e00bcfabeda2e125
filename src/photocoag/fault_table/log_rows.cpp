// Row L1 of the fault table: the disk is full, read-only or stalls, or the program is killed. The
// treatment must not notice; the log must have counted what it lost.
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cerrno>
#include <csignal>

#include "photocoag/core/error.hpp"
#include "photocoag/core/random.hpp"
#include "photocoag/fault_table/process_bench.hpp"
#include "photocoag/log/reader.hpp"
#include "photocoag/rt/clock.hpp"
#include "photocoag/run/observer.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kCycles = 250;

struct Disk {
  const char* what;
  std::size_t ring;
  std::function<ssize_t(int file, const void* bytes, std::size_t count)> write;
};

std::vector<Disk> bad_disks() {
  // The constructor's own write, of the header, goes through: a disk that is bad from the start is
  // refused before the treatment.
  const auto after_the_header = [](auto then) {
    return [then, calls = 0](int file, const void* bytes, std::size_t size) mutable -> ssize_t {
      return calls++ == 0 ? ::write(file, bytes, size) : then(calls, file, bytes, size);
    };
  };
  const auto refuse = [](int why) {
    return [why](int, int, const void*, std::size_t) -> ssize_t {
      errno = why;
      return -1;
    };
  };
  return {
      {"disk full", 4096, after_the_header(refuse(ENOSPC))},
      {"disk read-only", 4096, after_the_header(refuse(EROFS))},
      {"full in the middle of a block", 4096,
       after_the_header([](int calls, int file, const void* bytes, std::size_t size) -> ssize_t {
         if (calls == 2) return ::write(file, bytes, size / 2);
         errno = ENOSPC;
         return -1;
       })},
      {"stalls for 1 s", 64,
       after_the_header([](int calls, int file, const void* bytes, std::size_t size) -> ssize_t {
         if (calls == 2) wait_until(monotonic_ns() + 1'000'000'000);
         return ::write(file, bytes, size);
       })}};
}

LogHeader header_of(const ProcessBench& bench) {
  return {.program = "fault table",
          .config_sha256 = "L1",
          .model_sha256 = {},
          .device = {},
          .period = bench.config.control.period,
          .planned_cycles = static_cast<std::int64_t>(kCycles),
          .fields = {}};
}

std::vector<CycleRecord> treat(const ProcessBench& bench, LogWriter* log) {
  SimulatedEye<FullOrderPlant> device = bench.fresh_eye(1);
  Supervisor supervisor = bench.supervisor(safety_limits(bench.config));
  Controller controller = bench.controller;
  TreatmentObserver observer(bench.config.control.period, 0, {.log = log});
  std::vector<CycleRecord> records(kCycles);
  const LoopOutcome outcome = run_loop(controller, device, supervisor, bench.config.control.period,
                                       std::span(records), observer);
  records.resize(outcome.cycles);
  return records;
}

bool same_powers(const std::vector<CycleRecord>& a, const std::vector<CycleRecord>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& one, const auto& other) {
    return std::bit_cast<std::uint64_t>(one.power) == std::bit_cast<std::uint64_t>(other.power);
  });
}

LogContent content_of(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry);
  return read_segments(files);
}

void spoil_disk(const ProcessFaultOptions& options, const ProcessBench& bench, FaultRow& row) {
  const std::vector<CycleRecord> expected = treat(bench, nullptr);
  for (const Disk& disk : bad_disks()) {
    const ScratchFolder folder;
    LogWriter log(folder.path() / "log", header_of(bench),
                  {.ring_records = disk.ring, .look_ns = 1'000'000, .write = disk.write});
    const std::vector<CycleRecord> records = treat(bench, &log);
    const LogTotals totals = log.close();
    std::string why;
    const auto demand = [&](bool good, const char* what) {
      if (!good && why.empty()) why = fmt::format("{}: {}", disk.what, what);
    };
    demand(same_powers(records, expected), "the powers differ");
    demand(totals.produced == records.size(), "not every cycle was offered to the log");
    demand(totals.produced == totals.written + totals.dropped, "the counts do not add up");
    demand(totals.dropped > 0, "nothing was lost: no fault");
    demand(content_of(folder.path() / "log").records.size() == totals.written,
           "the reader finds another number of records");
    demand(!log.healthy() && !log.trouble().empty(), "no alarm");
    // No next treatment. Without the supervisor there is nobody to refuse it.
    demand(options.supervised &&
               bench.supervisor(safety_limits(bench.config), log.healthy()).status().state ==
                   SafetyState::kSafeStop,
           "the next treatment was not refused");
    for (const CycleRecord& record : records) row.peak = std::max(row.peak, record.truth.peak);
    count(row, why, !log.healthy());
  }
}

/// The child: a record each millisecond, its number published after it was handed over.
[[noreturn]] void produce(const ProcessBench& bench, const std::filesystem::path& folder,
                          std::atomic<std::uint64_t>& produced) {
  try {
    LogWriter log(folder, header_of(bench), {.ring_records = 1024, .write = {}});
    const std::int64_t start = monotonic_ns();
    for (std::int64_t k = 0;; ++k) {
      wait_until(start + k * 1'000'000);
      LogRecord record;
      record.cycle = k;
      log.record(record);
      produced.store(static_cast<std::uint64_t>(k) + 1, std::memory_order_release);
    }
  } catch (...) {
  }
  _exit(1);
}

void kill_writer(const ProcessBench& bench, std::uint64_t draw, FaultRow& row) {
  constexpr std::uint64_t kMostLost = 100;  // records of 1 ms
  const ScratchFolder folder;
  void* shared = mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (shared == MAP_FAILED) throw Error("no shared memory");
  auto& produced = *static_cast<std::atomic<std::uint64_t>*>(shared);
  const pid_t child = fork();
  if (child == 0) produce(bench, folder.path() / "log", produced);
  if (child < 0) throw Error("no process");
  const double wait = 0.12 + 0.28 * uniform(8, draw, RandomStream::kTest);
  wait_until(monotonic_ns() + static_cast<std::int64_t>(1e9 * wait));
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  const std::uint64_t handed_over = produced.load();
  munmap(shared, 4096);
  std::string why;
  try {
    const LogContent log = content_of(folder.path() / "log");
    const std::uint64_t lost =
        handed_over - std::min<std::uint64_t>(handed_over, log.records.size());
    if (lost > kMostLost) why = fmt::format("killed: {} of {} records lost", lost, handed_over);
    for (std::size_t k = 0; k < log.records.size() && why.empty(); ++k) {
      if (log.records[k].cycle != static_cast<std::int64_t>(k)) why = "killed: a gap in the log";
    }
    row.slowest = std::max(row.slowest, static_cast<int>(lost));
  } catch (const std::exception& error) {
    why = fmt::format("killed: {}", error.what());
  }
  count(row, why);
}

}  // namespace

void run_log_row(const ProcessFaultOptions& options, FaultRow& row) {
  std::uint64_t draw = 0;
  for (const double absorption : options.absorptions) {
    const ProcessBench bench(options, absorption);
    spoil_disk(options, bench, row);
    for (int k = 0; k < options.kills && options.supervised; ++k) kill_writer(bench, draw++, row);
  }
}

}  // namespace photocoag
