// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/base/thread_arena.h"

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <stdexcept>

namespace efm {
namespace {

int threadsOf(ThreadArena& arena) {
  return arena.execute([] { return tbb::this_task_arena::max_concurrency(); });
}

TEST(ThreadArena, HasItsNumberOfThreadsAlsoWhenItIsUsedAgain) {
  for (int round = 0; round < 3; ++round) {
    for (const int threads : {1, 2, 5}) {
      ThreadArena arena(threads);
      ThreadArena inner(threads);  // another one: the first is in use
      EXPECT_EQ(threadsOf(arena), threads);
      EXPECT_EQ(arena.execute([&] { return threadsOf(inner); }), threads);
    }
  }
}

TEST(ThreadArena, WorksAfterAnException) {
  for (int round = 0; round < 2; ++round) {
    ThreadArena arena(2);
    EXPECT_THROW(arena.execute([] { throw std::runtime_error("why"); }), std::runtime_error);
  }
  ThreadArena arena(2);
  std::atomic<int> sum = 0;
  arena.execute([&] { tbb::parallel_for(0, 100, [&](int i) { sum += i; }); });
  EXPECT_EQ(sum, 4950);
}

}  // namespace
}  // namespace efm
