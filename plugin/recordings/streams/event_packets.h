// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// The default period of the grid of packets: packet k has the events of [k·10 ms, (k+1)·10 ms).
inline constexpr std::int64_t kPacketPeriodNs = 10'000'000;

/// The maximum number of events in a packet: 10 ms of the fastest sensors.
inline constexpr std::size_t kMaxPacketEvents = std::size_t{1} << 20;

/// Checks the events of a camera, sorts events that are up to 10 ms late and divides the events
/// into packets on a grid of time. It reads on demand: memory holds one block, one packet and the
/// events of 10 ms. More than 4 events per pixel at one time are an error. An event is wrong if it
/// is over 1 s ahead of both its neighbours, or over 10 s ahead at the end. If more than 1 % of the
/// events, at least ten, are over 10 ms late, they are not in order at all: an error, also if wrong
/// events may be left out. A wrong event is a std::runtime_error that names the position, the value
/// and the expected value. The error is thrown after the packets of the earlier events, and again
/// by every further call.
class EventPackets {
 public:
  /// @param size size of the sensor: events outside it are wrong.
  /// @param period_ns period of the grid, above 0.
  EventPackets(std::unique_ptr<EventStream> stream, CameraSize size,
               std::int64_t period_ns = kPacketPeriodNs);

  /// Counts wrong events in `bad` and leaves them out. Call it first. `bad` must outlive this.
  void skipBadEvents(BadEvents& bad);
  /// Leaves out the events before a time, without reading them if the format allows it. Call it
  /// before `nextPacket` and `nextTime`.
  void startAt(std::int64_t t_ns);
  /// Leaves out the events from a time on, and stops reading 10 ms after this time.
  void stopAt(std::int64_t t_ns) { stop_ns_ = t_ns; }

  /// Returns the events of the next period that has events, in time order. Events of equal time
  /// keep the order of the file. More than `kMaxPacketEvents` events become several packets, even
  /// if all have the same time. The packet is empty at the end.
  std::vector<Event> nextPacket();
  /// Returns the first time of the next packet; std::nullopt at the end. If the next call of
  /// `nextPacket` throws, it returns the time of the newest event.
  /// @throws std::runtime_error at a wrong event if there is no event before it.
  std::optional<std::int64_t> nextTime();

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
  void settleAhead(std::int64_t next_ns);
  void rejectEqualTimes();
  void rejectDisorder();
  std::string inOrder() const;
  void reject(const std::string& problem);
  bool isGood(const Event& event) const;
  std::string problemOf(std::size_t i) const;

  std::unique_ptr<EventStream> stream_;
  CameraSize size_;
  std::int64_t period_ns_;
  BadEvents* bad_ = nullptr;
  std::int64_t start_ns_ = -kEndOfTimeNs;
  std::int64_t stop_ns_ = kEndOfTimeNs;
  std::optional<std::int64_t> before_ns_, after_ns_;
  std::uint64_t read_events_ = 0;
  std::uint64_t late_events_ = 0;  // over 10 ms
  std::string first_late_;         // position of the first of them
  bool ended_ = false;
  std::exception_ptr error_;  // the error of the wrong event

  std::vector<Event> block_;
  std::vector<Event> events_;  // sorted between calls; events before first_ were returned
  std::size_t first_ = 0;
  std::int64_t newest_ns_ = -kEndOfTimeNs;
  std::int64_t equal_times_ = 0;  // number of events at newest_ns_, in the last blocks
  std::optional<Event> ahead_;    // far ahead; the next event shows if it is bad
  std::string ahead_problem_;
  bool disordered_ = false;
  std::uint64_t sorted_events_ = 0;
};

}  // namespace efm
