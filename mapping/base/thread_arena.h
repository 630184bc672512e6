// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <tbb/task_arena.h>

#include <memory>
#include <utility>

namespace efm {

/// An arena of oneTBB for a number of threads, from a store of arenas that are used again. A new
/// arena each time would cost memory without end: on a busy machine, oneTBB 2021.8 never frees
/// arenas whose threads came too late to work (its issue 967).
class ThreadArena {
 public:
  explicit ThreadArena(int threads);
  /// Returns the arena to the store.
  ~ThreadArena();
  ThreadArena(const ThreadArena&) = delete;
  ThreadArena& operator=(const ThreadArena&) = delete;

  template <typename Function>
  decltype(auto) execute(Function&& function) {
    return arena_->execute(std::forward<Function>(function));
  }

 private:
  int threads_;
  std::unique_ptr<tbb::task_arena> arena_;
};

}  // namespace efm
