// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/event_checker.h"

#include <algorithm>
#include <utility>

namespace efm {
namespace {

constexpr std::size_t kMaxRuns = 512;

}  // namespace

bool EventChecker::areOthersNear(const Run& run) const {
  return others_ns_ && run.min_ns >= others_ns_->first - kNanosecondsPerSecond &&
         run.max_ns <= others_ns_->second + kNanosecondsPerSecond;
}

std::int64_t EventChecker::waitsSinceNs() const {
  std::int64_t since_ns = kMaxTimeNs;
  for (const Run& run : runs_) since_ns = std::min(since_ns, run.min_ns);
  return since_ns;
}

EventChecker::Verdict EventChecker::add(const Event& event, std::uint64_t number) {
  const std::int64_t t_ns = event.t_ns;
  if (t_ns < newest_ns_ - limits_.pause_ns) return Verdict::kLate;
  const bool follows = !runs_.empty() && t_ns >= runs_.back().max_ns - limits_.pause_ns &&
                       t_ns <= runs_.back().max_ns + limits_.pause_ns;
  if (!follows) {
    runs_.push_back({waiting_.size(), 0, t_ns, t_ns, number, lastNs()});
  }
  waiting_.push_back(event);
  Run& run = runs_.back();
  run.end = waiting_.size();
  run.min_ns = std::min(run.min_ns, t_ns);
  run.max_ns = std::max(run.max_ns, t_ns);
  if (run.max_ns - run.min_ns >= limits_.confirming_ns) {
    settle(Settle::kToConfirmed);
  } else if (runs_.size() == kMaxRuns || waiting_.size() == limits_.max_waiting) {
    settle(Settle::kToMiddle);
  }
  return follows ? Verdict::kWaits : Verdict::kBeginsRun;
}

/// Returns the runs that are in order and have the most events together.
/// @param ends_with_last whether the last run must be one of them.
std::vector<std::size_t> EventChecker::longestChain(bool ends_with_last) const {
  constexpr std::size_t kNone = kMaxRuns;
  std::vector<std::size_t> events(runs_.size()), before(runs_.size(), kNone);
  std::size_t last = kNone;
  for (std::size_t b = 0; b < runs_.size(); ++b) {
    const bool late = runs_[b].min_ns < newest_ns_ - limits_.pause_ns;
    if (runs_[b].wrong || late) continue;
    std::size_t most = 0;
    for (std::size_t a = 0; a < b; ++a) {
      const bool in_order = runs_[b].min_ns >= runs_[a].max_ns - limits_.pause_ns;
      if (events[a] == 0 || !in_order || events[a] < most) continue;
      most = events[a];
      before[b] = a;
    }
    events[b] = most + runs_[b].end - runs_[b].begin;
    if (last == kNone || events[b] >= events[last]) last = b;
  }
  if (ends_with_last) last = runs_.size() - 1;
  std::vector<std::size_t> chain;
  for (; last != kNone; last = before[last]) chain.push_back(last);
  std::reverse(chain.begin(), chain.end());
  return chain;
}

/// Marks the first and the last runs of a chain as wrong, if a pause of over 10 s divides them from
/// the others, and nothing confirms them. @return whether there are any.
bool EventChecker::rejectLoose(const std::vector<std::size_t>& chain, bool at_end) {
  const auto is_sure = [&](std::size_t first, std::size_t last) {  // runs of the chain, inclusive
    for (std::size_t i = first; i <= last; ++i) {
      if (areOthersNear(runs_[chain[i]])) return true;
    }
    return runs_[chain[last]].max_ns - runs_[chain[first]].min_ns >= limits_.confirming_ns;
  };
  const auto is_long = [&](std::int64_t from_ns, std::size_t to) {
    return runs_[chain[to]].min_ns - from_ns > kMaxLastPauseNs;
  };
  const auto reject = [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i <= last; ++i) runs_[chain[i]].wrong = true;
    return true;
  };
  const bool begins = newest_ns_ == -kEndOfTimeNs;  // no event was confirmed yet
  std::size_t loose = 0;                            // the runs before the first long pause
  while (loose + 1 < chain.size() && !is_long(runs_[chain[loose]].max_ns, loose + 1)) ++loose;
  const bool has_more = loose + 1 < chain.size() && is_sure(loose + 1, chain.size() - 1);
  if (begins && has_more && !is_sure(0, loose)) return reject(0, loose);
  if (!at_end || chain.empty()) return false;
  loose = chain.size() - 1;  // the runs behind the last long pause
  while (loose > 0 && !is_long(runs_[chain[loose - 1]].max_ns, loose)) --loose;
  const bool divided = loose > 0 || (!begins && is_long(newest_ns_, 0));
  return divided && !is_sure(loose, chain.size() - 1) && reject(loose, chain.size() - 1);
}

/// Ends the waiting of runs.
void EventChecker::settle(Settle how) {
  std::vector<std::size_t> chain;
  do {
    chain = longestChain(how == Settle::kToConfirmed);
  } while (rejectLoose(chain, how == Settle::kAtEnd));
  const std::size_t count =
      how == Settle::kToMiddle ? std::max<std::size_t>(1, runs_.size() / 2) : runs_.size();
  for (Run& run : runs_) run.wrong = true;
  for (const std::size_t right : chain) runs_[right].wrong = false;
  settled_.clear();
  const auto end = runs_.begin() + static_cast<std::ptrdiff_t>(count);
  for (auto run = runs_.begin(); run != end; ++run) {
    for (std::size_t i = run->begin; i < run->end; ++i) {
      settled_.push_back({waiting_[i], run->wrong, run->first, run->before_ns});
    }
    if (!run->wrong) newest_ns_ = std::max(newest_ns_, run->max_ns);
  }
  const std::size_t events = settled_.size();
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(events));
  runs_.erase(runs_.begin(), end);
  for (Run& run : runs_) {
    run.begin -= events;
    run.end -= events;
    run.wrong = false;  // more events may show it
  }
}

CheckedEvents EventIntake::add(std::vector<Event> events) {
  requirePossible(events, camera_, calibration_);
  EventChecker checker = checker_;  // kept if an event is late
  const auto first = std::find_if_not(events.begin(), events.end(),
                                      [&](const Event& event) { return checker.pass(event); });
  if (first == events.end()) {
    checker_ = std::move(checker);
    return CheckedEvents(std::move(events));
  }
  std::vector<Event> right(events.begin(), first);
  std::vector<Event> wrong;
  for (auto event = first; event != events.end(); ++event) {
    if (checker.pass(*event)) {
      right.push_back(*event);
    } else if (checker.add(*event, 0) == EventChecker::Verdict::kLate) {
      rejectLate(*event, camera_, checker.newestNs());
    } else {
      takeSettled(checker, right, wrong);
    }
  }
  checker_ = std::move(checker);
  count(wrong);
  return CheckedEvents(std::move(right));
}

CheckedEvents EventIntake::finish() {
  std::vector<Event> right, wrong;
  checker_.finish(true);
  takeSettled(checker_, right, wrong);
  count(wrong);
  return CheckedEvents(std::move(right));
}

void EventIntake::takeSettled(EventChecker& checker, std::vector<Event>& right,
                              std::vector<Event>& wrong) {
  for (const EventChecker::Settled& settled : checker.takeSettled()) {
    (settled.wrong ? wrong : right).push_back(settled.event);
  }
}

void EventIntake::count(const std::vector<Event>& wrong) {
  if (wrong_events_ == 0 && !wrong.empty()) {
    first_wrong_ = "camera " + std::to_string(camera_) + ", event at " +
                   formatSeconds(wrong.front().t_ns) +
                   " s: expected a time near those of the events beside it";
  }
  wrong_events_ += wrong.size();
}

}  // namespace efm
