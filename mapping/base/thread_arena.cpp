// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/base/thread_arena.h"

#include <map>
#include <mutex>
#include <vector>

namespace efm {
namespace {

/// Arenas that nobody uses now, by their number of threads: as many as were used at once.
struct Store {
  std::mutex mutex;
  std::map<int, std::vector<std::unique_ptr<tbb::task_arena>>> idle;
};

/// It is never destroyed: threads may work until the process ends.
Store& store() {
  static Store& made = *new Store;
  return made;
}

}  // namespace

ThreadArena::ThreadArena(int threads) : threads_(threads) {
  Store& from = store();
  const std::lock_guard<std::mutex> lock(from.mutex);
  auto& idle = from.idle[threads];
  if (idle.empty()) {
    arena_ = std::make_unique<tbb::task_arena>(threads);
    return;
  }
  arena_ = std::move(idle.back());
  idle.pop_back();
}

ThreadArena::~ThreadArena() {
  Store& to = store();
  const std::lock_guard<std::mutex> lock(to.mutex);
  to.idle[threads_].push_back(std::move(arena_));
}

}  // namespace efm
