// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/streams/event_packets.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "mapping/base/option.h"
#include "mapping/events/event.h"

namespace efm {
namespace {

constexpr std::uint64_t kFewBursts = 10;  // of wrong times: fewer are no disorder of the file

}  // namespace

void BadEvents::skip(const std::string& error) {
  if (count_ == limit_) {
    throw std::runtime_error(limit_ == 0
                                 ? error + " (--skip-bad-events N leaves out up to N bad events)"
                                 : fmt::format("{} ({} bad events before it were left out, as "
                                               "--skip-bad-events allows)",
                                               error, count_));
  }
  if (count_++ == 0) first_ = error;
}

EventPackets::EventPackets(std::unique_ptr<EventStream> stream, CameraSize size,
                           std::int64_t period_ns)
    : stream_(std::move(stream)), size_(size), period_ns_(period_ns) {
  requireOption(period_ns > 0, "packet period (ns)", period_ns, "above 0");
}

void EventPackets::skipBadEvents(BadEvents& bad) {
  bad_ = &bad;
  stream_->skipBadEvents(bad);
}

void EventPackets::startAt(std::int64_t t_ns) {
  start_ns_ = t_ns;
  stream_->seek(t_ns - kMaxEventDelayNs);
}

CheckedEvents EventPackets::nextPacket() {
  readAhead();
  if (first_ == events_.size()) return {};
  const auto begin = events_.begin() + static_cast<std::ptrdiff_t>(first_);
  const std::size_t most = std::min(events_.size() - first_, kMaxPacketEvents);
  const auto end = std::partition_point(
      begin, begin + static_cast<std::ptrdiff_t>(most),
      [end_ns = periodEnd(begin->t_ns)](const Event& event) { return event.t_ns < end_ns; });
  first_ = static_cast<std::size_t>(end - events_.begin());
  return CheckedEvents({begin, end});
}

std::optional<std::int64_t> EventPackets::nextTime() {
  readAhead();
  if (first_ < events_.size()) return events_[first_].t_ns;
  return damage_.empty() ? std::nullopt : std::optional(newest_ns_);
}

bool EventPackets::isAtDamage() {
  readAhead();
  return first_ == events_.size() && !damage_.empty();
}

void EventPackets::readAhead() {
  while (!ended_ && !stopped_ && damage_.empty() && !packetIsComplete()) {
    events_.erase(events_.begin(), events_.begin() + static_cast<std::ptrdiff_t>(first_));
    first_ = 0;
    readBlock();
    if (!std::exchange(disordered_, false)) continue;
    std::stable_sort(events_.begin(), events_.end(),
                     [](const Event& a, const Event& b) { return a.t_ns < b.t_ns; });
  }
}

/// Returns the end of the grid period that contains a time.
std::int64_t EventPackets::periodEnd(std::int64_t t_ns) const {
  std::int64_t rest_ns = t_ns % period_ns_;
  if (rest_ns < 0) rest_ns += period_ns_;
  return t_ns - rest_ns + period_ns_;
}

/// Returns whether no further event can belong to the first packet.
bool EventPackets::packetIsComplete() const {
  if (first_ == events_.size()) return false;
  std::int64_t end_ns = periodEnd(events_[first_].t_ns);
  if (events_.size() - first_ >= kMaxPacketEvents) {
    end_ns = std::min(end_ns, events_[first_ + kMaxPacketEvents - 1].t_ns);
  }
  return newest_ns_ - kMaxEventDelayNs >= end_ns;
}

/// Reads the next block. The events before damage are taken.
void EventPackets::readBlock() {
  ended_ = !stream_->read(block_);
  takeBlock();
  if (ended_ || !damage_.empty()) {
    checker_.finish(damage_.empty() && stream_->damage().empty());
    takeSettled();
    if (damage_.empty()) rejectDisorder();
  }
  if (damage_.empty() && !stopped_ && !stream_->sharesDamage()) damage_ = stream_->damage();
}

bool EventPackets::isPossible(const Event& event) const {
  return event.x < size_.width && event.y < size_.height && event.t_ns < kEndOfTimeNs;
}

/// Describes why an event of the block cannot be.
std::string EventPackets::problemOf(std::size_t i) const {
  const auto problem = [&](const char* name, const auto& value, const std::string& expected) {
    return fmt::format("{}: {} = '{}': expected {}", stream_->positionOf(i), name, value, expected);
  };
  const auto pixel_problem = [&](const char* name, int value, int side) {
    return problem(name, value,
                   fmt::format("a whole number from 0 to {} (the sensor has {}x{} pixels; are x "
                               "and y in this order, and is the resolution right?)",
                               side - 1, size_.width, size_.height));
  };
  const Event& event = block_[i];
  if (event.x >= size_.width) return pixel_problem("x", event.x, size_.width);
  if (event.y >= size_.height) return pixel_problem("y", event.y, size_.height);
  return problem("t", event.t_ns, "a time in ns before the year 2116");
}

/// Describes a wrong time. The place of a few events is noted, that of others is known as long as
/// their block.
/// @param number of the event. @param newest_ns of the events before it.
std::string EventPackets::timeProblemOf(std::int64_t t_ns, std::uint64_t number,
                                        std::int64_t newest_ns) const {
  const auto noted = places_.find(number);
  const bool in_block = number >= block_begin_ && number - block_begin_ < block_.size();
  const std::string place =
      noted != places_.end() ? noted->second
      : in_block             ? stream_->positionOf(static_cast<std::size_t>(number - block_begin_))
                             : stream_->name();
  const std::string command = stream_->commandInOrder();
  const std::string sorts =
      command.empty() ? "" : "; if they are not in order, this sorts them: " + command;
  std::string expected = "a time near those of the events after it" + sorts;
  if (newest_ns > t_ns) {
    expected = fmt::format("events in time order, at most 10 ms before the newest ({}){}",
                           formatSeconds(newest_ns), inOrder());
  } else if (newest_ns != -kEndOfTimeNs) {
    expected =
        fmt::format("a time near those of the events beside it, of which the one before is at {}{}",
                    formatSeconds(newest_ns), sorts);
  }
  return fmt::format("{}: t = '{}': expected {}", place, formatSeconds(t_ns), expected);
}

/// Returns what sorts the events, for errors.
std::string EventPackets::inOrder() const {
  const std::string command = stream_->commandInOrder();
  return command.empty() ? "; sort the events by time" : "; this sorts them: " + command;
}

/// Rejects events of which many are late: without them, the rest would be a wrong recording.
void EventPackets::rejectDisorder() {
  constexpr std::uint64_t kEnough = 1000;
  const bool at_end = ended_ || stopped_;
  const std::uint64_t share = at_end ? 100 : 5;
  const bool enough = at_end || read_events_ >= kEnough;
  if (!enough || late_bursts_ < kFewBursts || share * late_events_ <= read_events_) return;
  if (read_events_ <= block_.size()) events_.clear();  // none of them was used yet
  endInDisorder(late_events_, read_events_, first_late_);
}

void EventPackets::endInDisorder(std::uint64_t late, std::uint64_t of, const std::string& first) {
  damage_ = fmt::format(
      "{}: {} of {} events are over 10 ms late, first {}: expected events in time order{}; "
      "--skip-bad-events is for at most 1 % of late events",
      stream_->name(), late, of, first, inOrder());
  checker_ = {};  // what waits is of no use
}

void EventPackets::take(const Event& event) {
  if (event.t_ns >= newest_ns_) {
    newest_ns_ = event.t_ns;
    stopped_ = newest_ns_ - kMaxEventDelayNs >= stop_ns_;
    if (stopped_) return;
  } else {
    disordered_ = true;
    ++sorted_events_;
  }
  if (event.t_ns < start_ns_) {
    before_ns_ = std::max(before_ns_.value_or(event.t_ns), event.t_ns);
  } else if (event.t_ns >= stop_ns_) {
    after_ns_ = std::min(after_ns_.value_or(event.t_ns), event.t_ns);
  } else {
    events_.push_back(event);
  }
}

void EventPackets::takeBlock() {
  constexpr std::uint64_t kBurst = 1000;
  constexpr std::size_t kMaxPlaces = 16;  // some formats find them slowly
  block_begin_ = read_events_;
  for (std::size_t i = 0; i < block_.size() && damage_.empty(); ++i) {
    const Event& event = block_[i];
    if (stopped_) return rejectDisorder();  // errors after this time do not matter
    const std::uint64_t number = read_events_++;
    if (!isPossible(event)) {
      reject(needsText() ? problemOf(i) : std::string());
    } else if (checker_.pass(event)) {
      late_in_row_ = 0;
      take(event);
    } else if (const auto verdict = checker_.add(event, number);
               verdict != EventChecker::Verdict::kLate) {
      late_in_row_ = 0;
      const bool begins = verdict == EventChecker::Verdict::kBeginsRun;
      if (begins && places_.size() < kMaxPlaces) places_.emplace(number, stream_->positionOf(i));
      takeSettled();
    } else {
      if (late_events_++ == 0) first_late_ = stream_->positionOf(i);
      if (late_in_row_++ % kBurst == 0) ++late_bursts_;
      reject(needsText() ? timeProblemOf(event.t_ns, number, newest_ns_) : std::string());
    }
  }
  if (damage_.empty()) rejectEqualTimes();
  if (damage_.empty()) rejectDisorder();
}

/// Takes the events whose times are known to be right now, and rejects the others.
void EventPackets::takeSettled() {
  const bool ends = !damage_.empty();
  std::optional<std::uint64_t> burst;
  const std::vector<EventChecker::Settled> settled = checker_.takeSettled();
  if (!ends && isDisorder(settled)) return;
  for (const auto& [event, wrong, first, before_ns] : settled) {
    if (stopped_ || (!ends && !damage_.empty())) return;
    if (!wrong) {
      take(event);
    } else if (!ends && event.t_ns - kMaxEventDelayNs < stop_ns_) {
      const bool told = needsText() || late_events_ == 0;
      const std::string problem =
          told ? timeProblemOf(event.t_ns, first, before_ns) : std::string();
      if (late_events_++ == 0) first_late_ = problem.substr(0, problem.find(": t = "));
      if (std::exchange(burst, first) != first) ++late_bursts_;
      reject(problem);
    }
  }
  if (!settled.empty()) {
    places_.erase(places_.begin(), places_.upper_bound(settled.back().first));
  }
}

/// Returns whether most of the events that waited are wrong, and not in a few bursts: damage.
bool EventPackets::isDisorder(const std::vector<EventChecker::Settled>& settled) {
  const EventChecker::Settled* first = nullptr;
  std::optional<std::uint64_t> burst;
  std::uint64_t bursts = 0;
  std::uint64_t wrong = 0;
  for (const EventChecker::Settled& event : settled) {
    if (!event.wrong) continue;
    ++wrong;
    if (first == nullptr) first = &event;
    if (std::exchange(burst, event.first) != event.first) ++bursts;
  }
  if (bursts < kFewBursts || 2 * wrong <= settled.size()) return false;
  const std::string problem = timeProblemOf(first->event.t_ns, first->first, first->before_ns);
  endInDisorder(wrong, settled.size(), problem.substr(0, problem.find(": t = ")));
  return true;
}

/// Counts in whole blocks, which costs nothing: too many events of one time fill several blocks.
void EventPackets::rejectEqualTimes() {
  constexpr std::int64_t kMaxPixels = std::int64_t{1} << 21;  // if the sensor is unknown
  const auto pixels = std::min(kMaxPixels, std::int64_t{1} * size_.width * size_.height);
  if (block_.empty()) return;
  const std::int64_t t_ns = block_.front().t_ns;
  const bool equal = t_ns == block_.back().t_ns && t_ns == checker_.lastNs();
  if (!equal || t_ns != std::exchange(equal_ns_, t_ns)) equal_times_ = 0;
  if (equal) equal_times_ += static_cast<std::int64_t>(block_.size());
  if (equal_times_ <= 4 * pixels) return;
  damage_ = fmt::format(
      "{}: t = '{}': {} events have this time, over 4 a pixel: expected times that differ (are the "
      "column and the unit of the times right, and are they no float32?)",
      stream_->positionOf(block_.size() - 1), formatSeconds(t_ns), equal_times_);
}

/// Leaves out a wrong event; where wrong events are not allowed, it is damage.
void EventPackets::reject(const std::string& problem) {
  if (bad_ == nullptr) {
    damage_ = problem;
    return;
  }
  try {
    bad_->skip(problem);
  } catch (const std::runtime_error& too_many) {
    damage_ = too_many.what();
  }
}

}  // namespace efm
