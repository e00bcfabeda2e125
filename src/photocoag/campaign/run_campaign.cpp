#include "photocoag/campaign/run_campaign.hpp"

#include <fmt/format.h>

#include <bit>
#include <chrono>
#include <ctime>
#include <memory>
#include <system_error>
#include <thread>
#include <utility>

#include "photocoag/campaign/campaign_statistics.hpp"
#include "photocoag/campaign/results_file.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/parallel.hpp"
#include "photocoag/run/claimed_folder.hpp"

namespace photocoag {
namespace {

using Clock = std::chrono::steady_clock;
namespace fs = std::filesystem;

constexpr std::size_t kBatchPerThread = 8;              // spots that a rank asks for at a time
constexpr auto kPoll = std::chrono::microseconds(500);  // of the main thread, between looks

// The threads of one rank: numbers of spots in, records out.
using Pool = Workers<std::uint64_t, SpotRecord>;

// Numbers of spots that are still to do; rank 0 hands them out.
class SpotQueue {
 public:
  SpotQueue(std::uint64_t total, const SpotSet& done) : total_(total), done_(done) {}
  std::vector<std::uint64_t> next(std::size_t count) {
    std::vector<std::uint64_t> spots;
    while (spots.size() < count) {
      const std::uint64_t spot = done_.next_missing(next_);
      if (spot >= total_) break;
      spots.push_back(spot);
      next_ = spot + 1;
    }
    return spots;
  }
  void close() { next_ = total_; }

 private:
  std::uint64_t total_;
  const SpotSet& done_;
  std::uint64_t next_ = 0;  // those before it are done or under way
};

void require_room(const fs::path& out, const Campaign& campaign) {
  std::error_code error;
  fs::path there = fs::absolute(out, error);
  while (!error && !fs::exists(there, error) && there.has_relative_path()) {
    there = there.parent_path();
  }
  const fs::space_info space = fs::space(there, error);
  if (error) return;
  double needed = campaign_bytes(campaign);
  const std::uintmax_t journal = fs::file_size(out / "journal.bin", error);
  if (!error) needed -= static_cast<double>(journal);
  if (needed <= static_cast<double>(space.available)) return;
  throw Error(ErrorParts{
      .where = out.string(),
      .problem = "the disk has no room for this campaign",
      .found = fmt::format("{:.3g} GB", static_cast<double>(space.available) * 1e-9),
      .accepted = fmt::format("{:.3g} GB, {:.0f} bytes a spot for journal, table and statistics",
                              needed * 1e-9,
                              campaign_bytes(campaign) / static_cast<double>(campaign.spots))});
}

// Accepts a new or empty folder, or one with this campaign's journal; locks the journal.
std::unique_ptr<Journal> prepare_folder(const fs::path& out, const Campaign& campaign) {
  if (!fs::exists(out / "journal.bin")) check_run_folder(out);
  require_room(out, campaign);
  std::error_code error;
  fs::create_directories(out, error);
  if (error) {
    throw Error(ErrorParts{.where = "--out",
                           .problem = "the folder cannot be made: " + error.message(),
                           .found = out.string()});
  }
  auto journal = std::make_unique<Journal>(out / "journal.bin", campaign);
  write_file((out / "campaign.toml").string(), campaign.text);
  write_file((out / "config.toml").string(), to_toml(campaign.config));
  return journal;
}

// Rank 0: hands out work, keeps the journal.
void lead(const Campaign& campaign, Journal& journal, Ranks& ranks, Pool& pool, unsigned threads,
          const std::atomic<bool>& stop,
          const std::function<void(const CampaignProgress&)>& progress, CampaignResult& result) {
  SpotQueue queue(campaign.spots, journal.spots());
  const auto begin = Clock::now();
  const std::clock_t cpu_begin = std::clock();
  auto reported = begin;
  int working = ranks.size() - 1;  // other ranks that have not been told the end
  std::size_t outside = 0;         // spots that other ranks have and have not sent back
  const auto keep = [&](const SpotRecord& record) {
    journal.append(record);
    ++result.computed;
  };
  const auto tell = [&] {
    const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    CampaignProgress now{.done = journal.spots().size(), .total = campaign.spots};
    now.per_second = seconds > 0.0 ? static_cast<double>(result.computed) / seconds : 0.0;
    now.seconds_left =
        now.per_second > 0.0 ? static_cast<double>(now.total - now.done) / now.per_second : 0.0;
    progress(now);
  };
  bool exhausted = false;
  while (true) {
    if (stop.load(std::memory_order_relaxed)) {
      queue.close();
      pool.clear();
    }
    for (const SpotRecord& record : pool.take()) keep(record);
    if (pool.waiting() < threads) {
      const auto spots = queue.next(kBatchPerThread * threads);
      for (const std::uint64_t spot : spots) pool.add(spot);
      exhausted = spots.empty();
    }
    while (auto message = ranks.receive()) {
      if (message->tag == Ranks::Tag::kResult) {
        keep(from_block(message->values.data(), campaign.inputs.size()));
        --outside;
        continue;
      }
      // A request: its number of threads. An empty answer is the end.
      const auto count = kBatchPerThread * static_cast<std::size_t>(message->values.at(0));
      std::vector<double> answer;
      for (const std::uint64_t spot : queue.next(count)) {
        answer.push_back(std::bit_cast<double>(spot));
      }
      outside += answer.size();
      if (answer.empty()) --working;
      ranks.send(message->from, Ranks::Tag::kWork, answer);
    }
    if (exhausted && working == 0 && outside == 0 && pool.idle()) break;
    if (progress && Clock::now() - reported > std::chrono::milliseconds(200)) {
      reported = Clock::now();
      tell();
    }
    std::this_thread::sleep_for(kPoll);
  }
  if (progress) tell();
  result.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  result.cpu_seconds = static_cast<double>(std::clock() - cpu_begin) / CLOCKS_PER_SEC;
  result.complete = journal.spots().size() == campaign.spots;
}

// Another rank: asks for more while its threads still have some; an empty answer is the end.
void follow(Ranks& ranks, Pool& pool, unsigned threads) {
  bool asked = false;
  bool ended = false;
  std::size_t held = 0;  // spots received and not yet sent back
  while (!ended) {
    for (const SpotRecord& record : pool.take()) {
      ranks.send(0, Ranks::Tag::kResult, to_block(record));
      --held;
    }
    if (!asked && pool.waiting() < threads) {
      ranks.send(0, Ranks::Tag::kRequest, {static_cast<double>(threads)});
      asked = true;
    }
    while (auto message = ranks.receive()) {
      asked = false;
      ended = message->values.empty();
      for (const double spot : message->values) {
        pool.add(std::bit_cast<std::uint64_t>(spot));
        ++held;
      }
    }
    std::this_thread::sleep_for(kPoll);
  }
  while (held > 0) {
    for (const SpotRecord& record : pool.take()) {
      ranks.send(0, Ranks::Tag::kResult, to_block(record));
      --held;
    }
    std::this_thread::sleep_for(kPoll);
  }
}

}  // namespace

double campaign_bytes(const Campaign& campaign) noexcept {
  const auto spots = static_cast<double>(campaign.spots);
  const double a_spot =
      static_cast<double>(Journal::bytes_per_spot(campaign) + bytes_per_row(campaign));
  return spots * a_spot + statistics_bytes(spots);
}

CampaignResult run_campaign(const Campaign& campaign, const CampaignOptions& options, Ranks& ranks,
                            const std::atomic<bool>& stop,
                            const std::function<void(const CampaignProgress&)>& progress) {
  std::unique_ptr<Journal> journal;
  if (ranks.rank() == 0) journal = prepare_folder(options.out, campaign);
  const SpotModels models = make_spot_models(campaign, options.use_cache);
  const unsigned threads = thread_count(options.threads);
  Pool pool(threads, [&campaign, &models] {
    return [runner = std::make_unique<SpotRunner>(campaign, models)](std::uint64_t spot) {
      return runner->run(spot);
    };
  });
  CampaignResult result;
  result.full_order_states =
      models.standing ? models.standing->states() : models.controller.full_order_states;
  if (journal) {
    lead(campaign, *journal, ranks, pool, threads, stop, progress, result);
  } else {
    follow(ranks, pool, threads);
  }
  result.journal = std::move(journal);
  return result;
}

}  // namespace photocoag
