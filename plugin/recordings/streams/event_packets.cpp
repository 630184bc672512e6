// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/streams/event_packets.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "mapping/base/option.h"
#include "mapping/events/event.h"

namespace efm {

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

std::vector<Event> EventPackets::nextPacket() {
  readAhead();
  if (first_ == events_.size()) {
    if (error_) std::rethrow_exception(error_);
    return {};
  }
  const auto begin = events_.begin() + static_cast<std::ptrdiff_t>(first_);
  const std::size_t most = std::min(events_.size() - first_, kMaxPacketEvents);
  const auto end = std::partition_point(
      begin, begin + static_cast<std::ptrdiff_t>(most),
      [end_ns = periodEnd(begin->t_ns)](const Event& event) { return event.t_ns < end_ns; });
  first_ = static_cast<std::size_t>(end - events_.begin());
  return {begin, end};
}

std::optional<std::int64_t> EventPackets::nextTime() {
  readAhead();
  if (first_ < events_.size()) return events_[first_].t_ns;
  if (!error_) return std::nullopt;
  if (newest_ns_ == -kEndOfTimeNs) std::rethrow_exception(error_);
  return newest_ns_;
}

void EventPackets::readAhead() {
  while (!ended_ && !error_ && !packetIsComplete()) {
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

/// Reads the next block. Events before damage are kept: the error is thrown after them.
void EventPackets::readBlock() {
  std::exception_ptr damaged;
  try {
    ended_ = !stream_->read(block_);
  } catch (const std::exception&) {
    damaged = std::current_exception();
  }
  try {
    takeBlock();
    if (ahead_ && (ended_ || damaged)) {
      const std::int64_t t_ns = ahead_->t_ns;
      const bool bad =
          ended_ && t_ns - kMaxEventDelayNs < stop_ns_ && t_ns - newest_ns_ > kMaxLastPauseNs;
      settleAhead(bad ? newest_ns_ : t_ns);
    }
  } catch (const std::runtime_error&) {
    error_ = std::current_exception();
  }
  if (!error_ && !ended_) error_ = damaged;
}

bool EventPackets::isGood(const Event& event) const {
  const bool in_order = event.t_ns >= newest_ns_ || newest_ns_ - event.t_ns <= kMaxEventDelayNs;
  return event.x < size_.width && event.y < size_.height && event.t_ns < kEndOfTimeNs && in_order;
}

/// Describes why an event of the block is wrong.
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
  if (event.t_ns >= kEndOfTimeNs) {
    return problem("t", event.t_ns, "a time in ns before the year 2116");
  }
  const char* const expected =
      event.t_ns > newest_ns_
          ? "a time near those of the events beside it, of which the one before is at {}"
          : "events in time order, at most 10 ms before the newest ({})";
  return problem("t", formatSeconds(event.t_ns),
                 fmt::format(expected, formatSeconds(newest_ns_)) +
                     (event.t_ns > newest_ns_ ? "" : inOrder()));
}

/// Returns what sorts the events, for errors.
std::string EventPackets::inOrder() const {
  const std::string command = stream_->commandInOrder();
  return command.empty() ? "; sort the events by time" : "; this sorts them: " + command;
}

/// Rejects events of which many are late: without them, the rest would be a wrong recording.
void EventPackets::rejectDisorder() {
  constexpr std::uint64_t kEnough = 1000;
  constexpr std::uint64_t kFew = 10;
  const bool many = read_events_ >= kEnough && 5 * late_events_ > read_events_;  // before the end
  const bool some = ended_ && late_events_ >= kFew && 100 * late_events_ > read_events_;
  if (!many && !some) return;
  if (read_events_ <= block_.size()) events_.clear();  // none of them was used yet
  throw std::runtime_error(fmt::format(
      "{}: {} of {} events are over 10 ms late, first {}: expected events in time order{}; "
      "--skip-bad-events is for at most 1 % of late events",
      stream_->name(), late_events_, read_events_, first_late_, inOrder()));
}

void EventPackets::take(const Event& event) {
  if (event.t_ns >= newest_ns_) {
    newest_ns_ = event.t_ns;
    ended_ = newest_ns_ - kMaxEventDelayNs >= stop_ns_;
    if (ended_) return;
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
  events_.reserve(events_.size() + block_.size());
  for (std::size_t i = 0; i < block_.size(); ++i) {
    const Event& event = block_[i];
    if (ahead_) settleAhead(event.t_ns);
    if (ended_) return rejectDisorder();  // errors after this time do not matter
    ++read_events_;
    if (!isGood(event)) {
      if (event.t_ns < newest_ns_ - kMaxEventDelayNs && late_events_++ == 0) {
        first_late_ = stream_->positionOf(i);
      }
      reject(problemOf(i));
    } else if (event.t_ns - newest_ns_ <= kFarAheadNs || newest_ns_ == -kEndOfTimeNs) {
      take(event);
    } else {
      ahead_ = event;
      ahead_problem_ = problemOf(i);
    }
  }
  rejectEqualTimes();
  rejectDisorder();
}

/// Counts in whole blocks, which costs nothing: too many events of one time fill several blocks.
void EventPackets::rejectEqualTimes() {
  constexpr std::int64_t kMaxPixels = std::int64_t{1} << 21;  // if the sensor is unknown
  const auto pixels = std::min(kMaxPixels, std::int64_t{1} * size_.width * size_.height);
  const bool equal = !block_.empty() && block_.front().t_ns == block_.back().t_ns &&
                     block_.front().t_ns == newest_ns_;
  equal_times_ = equal ? equal_times_ + static_cast<std::int64_t>(block_.size()) : 0;
  if (equal_times_ <= 4 * pixels) return;
  throw std::runtime_error(fmt::format(
      "{}: t = '{}': {} events have this time, over 4 a pixel: expected times that differ (are the "
      "column and the unit of the times right, and are they no float32?)",
      stream_->positionOf(block_.size() - 1), formatSeconds(newest_ns_), equal_times_));
}

/// Takes the event that is far ahead, or rejects it if the next event is in order without it.
void EventPackets::settleAhead(std::int64_t next_ns) {
  const Event ahead = *std::exchange(ahead_, std::nullopt);
  const bool back = next_ns < ahead.t_ns - kMaxEventDelayNs;
  if (back && next_ns >= newest_ns_ - kMaxEventDelayNs) return reject(ahead_problem_);
  take(ahead);
}

/// Leaves out a wrong event, or throws its error if wrong events are not allowed.
void EventPackets::reject(const std::string& problem) {
  if (bad_ == nullptr) throw std::runtime_error(problem);
  bad_->skip(problem);
}

}  // namespace efm
