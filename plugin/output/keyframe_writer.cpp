// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/output/keyframe_writer.h"

#include <pthread.h>

#include <utility>

#include "plugin/session/stage_timer.h"

namespace efm {
namespace {

constexpr std::size_t kMaxWaiting = 2;

}  // namespace

KeyframeWriter::KeyframeWriter(Write write)
    : write_(std::move(write)), thread_([this] { run(); }) {}

KeyframeWriter::~KeyframeWriter() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void KeyframeWriter::add(const KeyframeDepthMap& keyframe) {
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait(lock, [this] { return error_ || waiting_.size() < kMaxWaiting; });
  if (error_) std::rethrow_exception(error_);
  waiting_.push_back(keyframe);
  changed_.notify_all();
}

void KeyframeWriter::finish() {
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait(lock, [this] { return error_ || (waiting_.empty() && !busy_); });
  if (error_) std::rethrow_exception(error_);
}

double KeyframeWriter::cpuSeconds() const {
  clockid_t clock{};
  // The thread runs until the destructor joins it.
  pthread_getcpuclockid(const_cast<std::thread&>(thread_).native_handle(), &clock);  // NOLINT
  return secondsOf(clock);
}

void KeyframeWriter::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stop_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    const KeyframeDepthMap keyframe = std::move(waiting_.front());
    waiting_.pop_front();
    busy_ = true;
    lock.unlock();
    std::exception_ptr error;
    try {
      write_(keyframe);
    } catch (...) {
      error = std::current_exception();
    }
    lock.lock();
    busy_ = false;
    if (error) {
      error_ = error;
      waiting_.clear();
    }
    changed_.notify_all();
  }
}

}  // namespace efm
