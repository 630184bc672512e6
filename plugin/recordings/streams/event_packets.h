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

/// The most events of a packet: 10 ms of the fastest sensors.
inline constexpr std::size_t kMaxPacketEvents = std::size_t{1} << 20;

/// Checks the events of a camera, sorts those that are up to 10 ms late and divides them into
/// packets on a grid of time. Reads on demand: memory holds a block and the events of a packet and
/// 10 ms. More than 4 events a pixel at one time are an error. An event over 1 s ahead of both its
/// neighbours, or 10 s ahead at the end, is a wrong one. A wrong event is a std::runtime_error that
/// names the position, the value and the expected one. It is thrown after the packets of the events
/// before it, and again by every further call.
class EventPackets {
 public:
  /// @param size pixels beyond it are wrong.
  /// @param period_ns of the grid, above 0.
  EventPackets(std::unique_ptr<EventStream> stream, CameraSize size,
               std::int64_t period_ns = kPacketPeriodNs);

  /// Wrong events are given to `bad`, and left out. Called before the others. `bad` outlives this.
  void skipBadEvents(BadEvents& bad);
  /// Leaves out the events before a time, without reading them if the format allows it. Called
  /// before the others.
  void startAt(std::int64_t t_ns);
  /// Leaves out the events from a time on, and reads no further than 10 ms behind it.
  void stopAt(std::int64_t t_ns) { stop_ns_ = t_ns; }

  /// The events of the next period of the grid with events, in time order; events of equal time in
  /// the order of the file. More than `kMaxPacketEvents` are several packets, also those of one
  /// time. Empty at the end.
  std::vector<Event> nextPacket();
  /// The first time of the next packet; nothing at the end. If the next call of `nextPacket`
  /// throws, the time of the newest event.
  /// @throws std::runtime_error at a wrong event without an event before it.
  std::optional<std::int64_t> nextTime();

  /// The number of events after a newer one.
  std::uint64_t sortedEvents() const { return sorted_events_; }
  const EventStream& stream() const { return *stream_; }
  /// The newest event before `startAt` and the first one from `stopAt` on, of those that were read.
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
  void refuseEqualTimes();
  void refuse(const std::string& problem);
  bool isGood(const Event& event) const;
  std::string problemOf(std::size_t i) const;

  std::unique_ptr<EventStream> stream_;
  CameraSize size_;
  std::int64_t period_ns_;
  BadEvents* bad_ = nullptr;
  std::int64_t start_ns_ = -kEndOfTimeNs;
  std::int64_t stop_ns_ = kEndOfTimeNs;
  std::optional<std::int64_t> before_ns_, after_ns_;
  bool ended_ = false;
  std::exception_ptr error_;  // of the wrong event

  std::vector<Event> block_;
  std::vector<Event> events_;  // sorted between calls; returned before first_
  std::size_t first_ = 0;
  std::int64_t newest_ns_ = -kEndOfTimeNs;
  std::int64_t equal_times_ = 0;  // number of events with it, in the last blocks
  std::optional<Event> ahead_;    // good or bad: the next event says it
  std::string ahead_problem_;
  bool disordered_ = false;
  std::uint64_t sorted_events_ = 0;
};

}  // namespace efm
