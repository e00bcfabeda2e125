// Independent tasks on all cores: each once, told as they end, the first failure thrown.
#include "photocoag/core/parallel.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <thread>

namespace photocoag {
namespace {

TEST(Parallel, EveryTaskRunsOnceAndTheCallingThreadIsToldOfAll) {
  std::vector<std::atomic<int>> runs(1000);
  std::vector<std::size_t> told;
  const std::thread::id caller = std::this_thread::get_id();
  for_each_in_parallel(
      runs.size(), [&](std::size_t i) { ++runs[i]; },
      [&](std::size_t done) {
        EXPECT_EQ(std::this_thread::get_id(), caller);
        told.push_back(done);
      });
  for (const auto& count : runs) EXPECT_EQ(count, 1);
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
  EXPECT_EQ(told.back(), runs.size());
}

TEST(Parallel, TheFirstFailureIsThrownAndTheRestIsLeftOut) {
  std::atomic<std::size_t> begun{0};
  EXPECT_THROW(for_each_in_parallel(1'000'000,
                                    [&](std::size_t) {
                                      ++begun;
                                      throw std::runtime_error("no");
                                    }),
               std::runtime_error);
  EXPECT_LE(begun, std::size_t{1000});
}

TEST(Parallel, NothingToDo) {
  for_each_in_parallel(0, [](std::size_t) { FAIL(); });
}

}  // namespace
}  // namespace photocoag
