// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mapping/events/event_checker.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// The default period of the grid of packets: packet k has the events of [k·10 ms, (k+1)·10 ms).
inline constexpr std::int64_t kPacketPeriodNs = 10'000'000;

/// The maximum number of events in a packet: 10 ms of the fastest sensors.
inline constexpr std::size_t kMaxPacketEvents = std::size_t{1} << 20;

/// Checks the events of a camera, sorts events that are up to 10 ms late and divides the events
/// into packets on a grid of time. It reads on demand: memory holds one block, one packet and the
/// events of 10 ms. More than 4 events per pixel at one time are an error. `EventChecker` tells
/// whose times are wrong. If more than 1 % of the events are over 10 ms late, and not in a few
/// bursts, they are not in order at all: an error, also if wrong events may be left out. A wrong
/// event is a damage: it ends the packets, after the earlier events.
class EventPackets {
 public:
  /// @param size size of the sensor: events outside it are wrong.
  /// @param period_ns period of the grid, above 0.
  EventPackets(std::unique_ptr<EventStream> stream, CameraSize size,
               std::int64_t period_ns = kPacketPeriodNs);

  /// Counts wrong events in `bad` and leaves them out. Call it first. `bad` must outlive this.
  void skipBadEvents(BadEvents& bad);
  /// Poses of these times, on the camera's clock, confirm the first and the last events.
  void expectPoses(std::int64_t first_ns, std::int64_t last_ns) {
    checker_.expectOthers(first_ns, last_ns);
  }
  /// Leaves out the events before a time, without reading them if the format allows it. Call it
  /// before `nextPacket` and `nextTime`.
  void startAt(std::int64_t t_ns);
  /// Leaves out the events from a time on, and stops reading 10 ms after this time.
  void stopAt(std::int64_t t_ns) { stop_ns_ = t_ns; }

  /// Returns the events of the next period that has events, in time order. Events of equal time
  /// keep the order of the file. More than `kMaxPacketEvents` events become several packets, even
  /// if all have the same time. The packet is empty at the end.
  CheckedEvents nextPacket();
  /// Returns the first time of the next packet; std::nullopt at the end. At damage, the time of the
  /// newest event.
  std::optional<std::int64_t> nextTime();
  /// Returns whether damage comes next.
  bool isAtDamage();
  /// Returns the position, value and expected value of the damage; empty if there is none so far.
  const std::string& damage() const { return damage_; }

  /// The number of events that came after a newer event.
  std::uint64_t sortedEvents() const { return sorted_events_; }
  const EventStream& stream() const { return *stream_; }
  /// Times of the newest read event before `startAt` and the first read event from `stopAt` on.
  std::optional<std::int64_t> nearestBefore() const { return before_ns_; }
  std::optional<std::int64_t> nearestAfter() const { return after_ns_; }

 private:
  void readAhead();
  bool packetIsComplete() const;
  std::int64_t periodEnd(std::int64_t t_ns) const;
  void readBlock();
  void takeBlock();
  void take(const Event& event);
  void takeSettled();
  void rejectEqualTimes();
  void rejectDisorder();
  void endInDisorder(std::uint64_t late, std::uint64_t of, const std::string& first);
  bool isDisorder(const std::vector<EventChecker::Settled>& settled);
  std::string inOrder() const;
  void reject(const std::string& problem);
  bool needsText() const { return bad_ == nullptr || bad_->needsText(); }
  bool isPossible(const Event& event) const;
  std::string problemOf(std::size_t i) const;
  std::string timeProblemOf(std::int64_t t_ns, std::uint64_t number, std::int64_t newest_ns) const;

  std::unique_ptr<EventStream> stream_;
  CameraSize size_;
  std::int64_t period_ns_;
  BadEvents* bad_ = nullptr;
  std::int64_t start_ns_ = -kEndOfTimeNs;
  std::int64_t stop_ns_ = kEndOfTimeNs;
  std::optional<std::int64_t> before_ns_, after_ns_;
  std::uint64_t read_events_ = 0;
  std::uint64_t block_begin_ = 0;  // number of the block's first event
  std::uint64_t late_events_ = 0;  // over 10 ms
  std::uint64_t late_bursts_ = 0;  // successive ones, at most 1000
  std::uint64_t late_in_row_ = 0;
  std::string first_late_;  // position of the first of them
  bool ended_ = false;      // the stream
  bool stopped_ = false;    // over 10 ms after stop_ns_
  std::string damage_;

  std::vector<Event> block_;
  std::vector<Event> events_;  // sorted between calls; events before first_ were returned
  std::size_t first_ = 0;
  std::int64_t newest_ns_ = -kEndOfTimeNs;
  std::int64_t equal_times_ = 0;  // number of events at equal_ns_, in the last blocks
  std::int64_t equal_ns_ = 0;
  EventChecker checker_;
  std::map<std::uint64_t, std::string> places_;  // of some waiting events, by their numbers
  bool disordered_ = false;
  std::uint64_t sorted_events_ = 0;
};

}  // namespace efm
