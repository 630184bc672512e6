// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/event_budget.h"

#include <algorithm>
#include <cmath>

#include "mapping/events/event.h"

namespace efm {
namespace {

constexpr std::int64_t kIntervalNs = 10'000'000;
constexpr std::int64_t kLateIntervals = 100;

std::int64_t intervalOf(std::int64_t t_ns) {
  return t_ns / kIntervalNs - (t_ns % kIntervalNs < 0 ? 1 : 0);
}

}  // namespace

EventBudget::EventBudget(double max_rate)
    : max_per_interval_(static_cast<std::size_t>(std::ceil(max_rate / 100))) {}

std::vector<Event> EventBudget::pass(std::vector<Event> events,
                                     std::optional<std::int64_t>& covered_until_ns) {
  if (max_per_interval_ == 0) return events;
  std::vector<Event> passed;
  for (const Event& event : events) {
    const std::int64_t interval = intervalOf(event.t_ns);
    const bool is_late =
        !held_.empty() && interval < interval_ && interval > interval_ - kLateIntervals;
    if (interval != interval_ && !is_late) {
      endInterval(passed);
      interval_ = interval;
    }
    held_.push_back(event);
  }
  if (!covered_until_ns) return passed;
  if (intervalOf(*covered_until_ns) > interval_) endInterval(passed);
  if (!held_.empty()) {
    const auto earlier = [](const Event& a, const Event& b) { return a.t_ns < b.t_ns; };
    const Event& oldest = *std::min_element(held_.begin(), held_.end(), earlier);
    covered_until_ns = std::min({*covered_until_ns, interval_ * kIntervalNs, oldest.t_ns});
  }
  return passed;
}

std::vector<Event> EventBudget::finish() {
  std::vector<Event> passed;
  endInterval(passed);
  return passed;
}

void EventBudget::endInterval(std::vector<Event>& passed) {
  std::vector<Event> buffer;
  const EventSpan chosen = chooseEvenly(held_, max_per_interval_, buffer);
  thinned_ += held_.size() - chosen.size();
  passed.insert(passed.end(), chosen.begin(), chosen.end());
  held_.clear();
}

}  // namespace efm
