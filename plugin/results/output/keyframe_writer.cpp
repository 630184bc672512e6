// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/output/keyframe_writer.h"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <iterator>
#include <utility>

#include "plugin/session/session_status.h"

namespace efm {
namespace {

constexpr std::size_t kMaxWaiting = 1;
/// A signal waits for the idle writer at most this long.
constexpr std::chrono::milliseconds kMaxIdle{50};

constexpr int kEndingSignals[] = {SIGINT, SIGTERM, SIGHUP};

sigset_t endingSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : kEndingSignals) sigaddset(&signals, signal);
  return signals;
}

}  // namespace

KeyframeWriter::KeyframeWriter(Write write) : write_(std::move(write)) {
  const sigset_t ending = endingSignals();
  pthread_sigmask(SIG_BLOCK, &ending, &callers_signals_);
  thread_ = std::thread([this] { run(); });
}

KeyframeWriter::~KeyframeWriter() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
  pthread_sigmask(SIG_SETMASK, &callers_signals_, nullptr);
}

void KeyframeWriter::add(const KeyframeDepthMap& keyframe) {
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait(lock, [this] { return error_ || waiting_.size() < kMaxWaiting; });
  if (error_) std::rethrow_exception(error_);
  waiting_.push_back(keyframe);
  changed_.notify_all();
  // The program ends when the writer is idle: give it nothing more.
  changed_.wait(lock, [this] { return error_ || !endIsPending(); });
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

/// Under the lock, so that no keyframe waits. Returns where the program ignores the signal.
void KeyframeWriter::acceptSignals() {
  const sigset_t ending = endingSignals();
  pthread_sigmask(SIG_SETMASK, &callers_signals_, nullptr);
  pthread_sigmask(SIG_BLOCK, &ending, nullptr);
  changed_.notify_all();
}

bool KeyframeWriter::endIsPending() const {
  sigset_t pending;
  sigpending(&pending);
  return std::any_of(std::begin(kEndingSignals), std::end(kEndingSignals), [&](int signal) {
    return sigismember(&pending, signal) == 1 && sigismember(&callers_signals_, signal) == 0;
  });
}

void KeyframeWriter::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    changed_.wait_for(lock, kMaxIdle, [this] { return stop_ || !waiting_.empty(); });
    if (waiting_.empty()) {
      if (stop_) return;
      acceptSignals();
      continue;
    }
    const KeyframeDepthMap keyframe = std::move(waiting_.front());
    waiting_.pop_front();
    busy_ = true;
    changed_.notify_all();
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
