// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/base/stage_times.h"

#include <pthread.h>

#include <ctime>
#include <mutex>
#include <vector>

namespace efm {
namespace {

double secondsOf(clockid_t clock) {
  std::timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

clockid_t clockOfThread() {
  clockid_t clock{};
  pthread_getcpuclockid(pthread_self(), &clock);
  return clock;
}

/// The processor time of all threads of WorkAside, at work or ended.
struct TimeAside {
  std::mutex mutex;
  std::vector<clockid_t> at_work;
  double ended_s = 0;
};
TimeAside& timeAside() {
  static TimeAside aside;
  return aside;
}

double secondsOf(Processors processors) {
  return processors == Processors::kThis ? threadSeconds() : processSeconds() - asideSeconds();
}

}  // namespace

double processSeconds() { return secondsOf(CLOCK_PROCESS_CPUTIME_ID); }
double threadSeconds() { return secondsOf(CLOCK_THREAD_CPUTIME_ID); }

double asideSeconds() {
  TimeAside& aside = timeAside();
  const std::lock_guard<std::mutex> lock(aside.mutex);
  double seconds = aside.ended_s;
  for (const clockid_t clock : aside.at_work) seconds += secondsOf(clock);
  return seconds;
}

WorkAside::WorkAside() {
  const std::lock_guard<std::mutex> lock(timeAside().mutex);
  timeAside().at_work.push_back(clockOfThread());
}

WorkAside::~WorkAside() {
  TimeAside& aside = timeAside();
  const clockid_t mine = clockOfThread();
  const std::lock_guard<std::mutex> lock(aside.mutex);
  aside.ended_s += threadSeconds();
  for (auto clock = aside.at_work.begin(); clock != aside.at_work.end(); ++clock) {
    if (*clock != mine) continue;
    aside.at_work.erase(clock);
    break;
  }
}

StageScope::StageScope(StageTimes* times, double StageSeconds::*stage, Processors of)
    : times_(times), stage_(stage), of_(of) {
  if (times_ == nullptr) return;
  cpu_begin_s_ = secondsOf(of_);
  begin_ = std::chrono::steady_clock::now();
}

StageScope::~StageScope() {
  if (times_ == nullptr) return;
  const auto passed = std::chrono::steady_clock::now() - begin_;
  times_->real.*stage_ += std::chrono::duration<double>(passed).count();
  times_->cpu.*stage_ += secondsOf(of_) - cpu_begin_s_;
}

}  // namespace efm
