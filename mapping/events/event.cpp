// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/event.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "mapping/geometry/timestamp.h"

namespace efm {

void reject(const Event& event, int camera, const std::string& expected) {
  throw std::invalid_argument("camera " + std::to_string(camera) + ", event at " +
                              formatSeconds(event.t_ns) + " s: " + expected);
}

void rejectLate(const Event& event, int camera, std::int64_t newest_ns) {
  reject(event, camera,
         "must not come more than 10 ms after a newer one, that at " + formatSeconds(newest_ns) +
             " s");
}

void requirePossible(EventSpan events, int camera, const RigCamera& calibration) {
  const CameraModel& model = calibration.model;
  const std::int64_t offset_ns = calibration.time_offset_ns;
  const std::int64_t from_ns = std::max(-kEndOfTimeNs, -kEndOfTimeNs - offset_ns);
  const std::int64_t until_ns = std::min(kEndOfTimeNs, kEndOfTimeNs - offset_ns);
  for (const Event& event : events) {
    if (event.x >= model.width || event.y >= model.height) {
      reject(event, camera,
             "pixel (" + std::to_string(event.x) + ", " + std::to_string(event.y) +
                 ") must lie inside the sensor of " + std::to_string(model.width) + "x" +
                 std::to_string(model.height));
    }
    if (event.t_ns < from_ns || event.t_ns > until_ns) {
      reject(event, camera,
             "times must lie within " + formatSeconds(kEndOfTimeNs) +
                 " s, with the camera's offset of " + formatSeconds(offset_ns) + " s too");
    }
  }
}

namespace {

/// Returns pseudo-random bits: the finaliser of SplitMix64 (Steele et al., OOPSLA 2014).
std::uint64_t randomBits(std::uint64_t number) {
  std::uint64_t bits = (number + 1) * 0x9e3779b97f4a7c15U;
  bits = (bits ^ (bits >> 30U)) * 0xbf58476d1ce4e5b9U;
  bits = (bits ^ (bits >> 27U)) * 0x94d049bb133111ebU;
  return bits ^ (bits >> 31U);
}

}  // namespace

EvenChoice::EvenChoice(std::size_t events, std::size_t limit)
    : events_(events), size_(limit == 0 || limit > events ? events : limit) {}

std::size_t EvenChoice::operator[](std::size_t k) const {
  if (all()) return k;
  const std::size_t begin = k * events_ / size_;
  const std::size_t end = (k + 1) * events_ / size_;
  return begin + randomBits(k) % (end - begin);
}

EventSpan chooseEvenly(EventSpan events, std::size_t limit, std::vector<Event>& buffer) {
  const EvenChoice choice(events.size(), limit);
  if (choice.all()) return events;
  buffer.clear();
  buffer.reserve(choice.size());
  for (std::size_t k = 0; k < choice.size(); ++k) buffer.push_back(events[choice[k]]);
  return EventSpan(buffer);
}

std::vector<Event> chosenEvenly(EventSpan events, std::size_t limit) {
  std::vector<Event> chosen;
  const EventSpan view = chooseEvenly(events, limit, chosen);
  if (chosen.empty()) chosen.assign(view.begin(), view.end());
  return chosen;
}

std::size_t EventSpan::indexOf(std::int64_t t_ns) const {
  const Event* first = std::lower_bound(
      begin_, end_, t_ns, [](const Event& event, std::int64_t time) { return event.t_ns < time; });
  return static_cast<std::size_t>(first - begin_);
}

std::size_t EventBuffer::indexOf(std::int64_t t_ns) const {
  return begin + EventSpan(events).part(begin, events.size()).indexOf(t_ns);
}

std::uint64_t EventBuffer::insert(EventSpan added) {
  std::int64_t newest = begin < events.size() ? events.back().t_ns : kMinTimeNs;
  std::int64_t earliest_late = kMaxTimeNs;
  std::uint64_t late = 0;
  for (const Event& event : added) {
    if (event.t_ns < newest) {
      ++late;
      earliest_late = std::min(earliest_late, event.t_ns);
    }
    newest = std::max(newest, event.t_ns);
  }
  // Old events are sorted. + 1 (ns) finds the first event later than the earliest late event.
  const std::size_t first_unsorted = late > 0 ? indexOf(earliest_late + 1) : 0;
  const std::size_t before = events.size();
  try {
    events.insert(events.end(), added.begin(), added.end());
    used.resize(events.size());
    if (late > 0) sortFrom(first_unsorted);
  } catch (...) {  // out of memory
    events.resize(before);
    used.resize(before);
    throw;
  }
  return late;
}

void EventBuffer::sortFrom(std::size_t index) {
  std::vector<std::pair<Event, bool>> tail;
  for (std::size_t i = index; i < events.size(); ++i) tail.emplace_back(events[i], used[i]);
  std::stable_sort(tail.begin(), tail.end(),
                   [](const auto& a, const auto& b) { return a.first.t_ns < b.first.t_ns; });
  for (const auto& [event, was_used] : tail) {
    events[index] = event;
    used[index++] = was_used;
  }
}

void EventBuffer::compact() {
  if (begin < events.size() / 2) return;
  const auto count = static_cast<std::ptrdiff_t>(begin);
  events.erase(events.begin(), events.begin() + count);
  used.erase(used.begin(), used.begin() + count);
  begin = 0;
}

}  // namespace efm
