// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <vector>

#include "mapping/events/event.h"
#include "plugin/session/event_fusion_options.h"
#include "plugin/session/mapping_session.h"
#include "plugin/session/pose_intake.h"

namespace efm {

/// Subsamples the events of one camera to a rate of sensor time. Of each 10 ms of the camera's
/// clock, at most rate / 100 events pass, spread evenly (`EvenChoice`). The choice depends on the
/// order of the events, not on the packets in which they arrive, nor on the machine.
///
/// The events of the current 10 ms are held until a later event, or a packet's `complete_until_ns`,
/// ends the interval. A late event, by less than a second, belongs to the current 10 ms. After a
/// clock reset, the current interval is one of the new clock.
class EventBudget {
 public:
  /// @param max_rate events per second; 0: all events pass at once.
  explicit EventBudget(double max_rate);

  /// @param complete_until_ns no event before this time can still arrive; in: of the packet, out:
  /// of the events that passed.
  /// @return the events that pass, of this packet and of earlier packets.
  std::vector<Event> pass(std::vector<Event> events,
                          std::optional<std::int64_t>& complete_until_ns);
  /// Returns the held events that pass at the end.
  std::vector<Event> finish();

  std::uint64_t subsampled() const { return subsampled_; }
  /// Returns the number of events that wait for the end of their 10 ms.
  std::size_t held() const { return held_.size(); }

 private:
  void endInterval(std::vector<Event>& passed);

  std::size_t max_per_interval_;
  std::int64_t interval_ = 0;  // number of the current 10 ms
  std::vector<Event> held_;    // events of this interval
  std::uint64_t subsampled_ = 0;
};

/// A packet in the queue: its late events are left out where the session takes it. In place of a
/// packet that is not to be mapped, one without events.
struct QueuedPacket : EventPacket {
  /// End of the events that the host left out, on the camera's clock.
  std::optional<std::int64_t> skipped_until_ns = std::nullopt;
};

/// Returns what replaces a packet that is not to be mapped.
QueuedPacket skippedPacket(int camera, const std::vector<Event>& events);

/// Input of a mapping that runs in another thread: subsampled, and bounded in events and in bytes.
/// If the queue is full, its oldest packets are dropped, but never poses. Any thread adds; one
/// thread takes. Adding never waits for the mapping.
///
/// An event that is over a second ahead of its stream waits for the next one. If the next one is
/// back at the former time, only the event that was ahead is rejected. Poses: see `PoseIntake`.
class InputQueue {
 public:
  explicit InputQueue(const LiveOptions& options);

  /// Adds all cameras, before the first events.
  void add(const Rig& rig);
  void add(EventPacket packet);
  /// Adds events that were not checked.
  /// @throws std::invalid_argument if an event is not possible. All events are rejected.
  void add(int camera, std::vector<Event> events, std::optional<std::int64_t> complete_until_ns);
  void add(PoseSample pose);
  /// Counts events that are not to be mapped, and adds their `skippedPacket`.
  void skip(int camera, const std::vector<Event>& events);
  /// Ends the input. Packets and poses that are added later are counted only.
  void end();
  /// Wakes up the thread that takes. It does not wait again.
  void stop();

  struct Batch {
    std::optional<Rig> rig;         ///< All cameras, once.
    std::vector<PoseSample> poses;  ///< In the order of arrival.
    std::vector<QueuedPacket> packets;
    /// Missing events of the cameras with dropped packets, which are older than `packets`.
    std::map<int, MissingEvents> missing;
    bool ended = false;
  };
  using Clock = std::chrono::steady_clock;
  /// Waits for input, at most until this time. Returns packets up to the next skipped one: the
  /// windows before the gap are mapped first.
  Batch wait(std::optional<Clock::time_point> until = std::nullopt);
  /// Returns the available input, up to the next skipped packet. If `all_mapped` (all complete
  /// windows are mapped, as before `wait`), the input begins with the skipped packets.
  Batch take(bool all_mapped = false);

  std::uint64_t queuedEvents() const;
  std::map<int, QueueCounts> counts() const;
  /// Returns the number of poses that came after the end, or have a wrong time.
  std::uint64_t rejectedPoses() const;

 private:
  /// Progress of a camera's events.
  struct Stream {
    std::optional<std::int64_t> reached_ns;  // newest time that is not ahead
    std::optional<Event> ahead;              // waits until the next event confirms its time

    /// Takes a new time. The clock may go back.
    void follow(std::int64_t t_ns);
    /// Ends the wait of the event `ahead` and returns it if its time is right. Otherwise adds 1 to
    /// `rejected` and returns std::nullopt.
    std::optional<Event> finalize(bool is_right, std::uint64_t& rejected);
  };

  struct Camera {
    explicit Camera(double max_rate) : budget(max_rate) {}
    EventBudget budget;
    std::optional<std::int64_t> complete_until_ns;  // of the last packet
    Stream stream;  // of events and `complete_until_ns`; one event may wait
    QueueCounts counts;
  };

  Camera& cameraOf(int index);
  void take(int index, std::vector<Event> events, std::optional<std::int64_t> complete_until_ns);
  void takeAhead(int index, std::vector<Event>& events,
                 std::optional<std::int64_t>& complete_until_ns);
  void pass(int index, std::vector<Event> events, std::optional<std::int64_t> complete_until_ns);
  void push(QueuedPacket packet);
  void pushPoses(std::vector<PoseSample> poses);
  void dropOldest();
  bool isFull() const;
  Batch takeLocked(bool all_mapped);

  const LiveOptions options_;

  mutable std::mutex mutex_;  // guards the members below
  std::condition_variable changed_;
  std::optional<Rig> new_rig_;  // not yet taken
  Rig rig_;
  std::map<int, Camera> cameras_;
  std::deque<QueuedPacket> packets_;
  std::vector<PoseSample> poses_;
  PoseIntake pose_intake_;
  std::uint64_t rejected_poses_ = 0;  // after the end
  std::map<int, MissingEvents> missing_;
  std::uint64_t events_ = 0;  // in packets_
  std::uint64_t bytes_ = 0;
  bool ended_ = false;
  bool stopped_ = false;
};

}  // namespace efm
