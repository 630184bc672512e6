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

namespace efm {

/// Thins the events of one camera to a rate of sensor time: of each 10 ms of the camera's clock at
/// most a hundredth of the rate, spread evenly (`EvenChoice`). The choice depends on the events in
/// their order of arrival, not on the packets that they arrive in, nor on the machine.
///
/// The events of the current 10 ms are held until a later event, or a packet's cover, ends it. A
/// late event, of the second before, belongs to the current 10 ms. After a step of the clock
/// another interval is the current one.
class EventBudget {
 public:
  /// @param max_rate events per second; 0: all events pass at once.
  explicit EventBudget(double max_rate);

  /// @param covered_until_ns no event before this time is still to come; in: of the packet, out: of
  /// the events that passed.
  /// @return the events that pass, of this packet and of earlier ones.
  std::vector<Event> pass(std::vector<Event> events, std::optional<std::int64_t>& covered_until_ns);
  /// The rest, at the end.
  std::vector<Event> finish();

  std::uint64_t thinned() const { return thinned_; }
  /// Events that wait for the end of their 10 ms.
  std::size_t held() const { return held_.size(); }

 private:
  void endInterval(std::vector<Event>& passed);

  std::size_t max_per_interval_;
  std::int64_t interval_ = 0;  // number of the current 10 ms
  std::vector<Event> held_;    // its events
  std::uint64_t thinned_ = 0;
};

/// Takes the place of a packet that is not to be mapped.
EventPacket skippedPacket(const EventPacket& packet);

/// The input of a mapping that runs in another thread: thinned to the budget, and bounded in events
/// and in bytes. Where it is full, the oldest packets are dropped, never poses. Any thread adds;
/// one takes. Adding never waits for the mapping.
///
/// An event, or a pose, that is over a second ahead of its stream waits for the next one: where
/// that is back, the one ahead is refused alone.
class InputQueue {
 public:
  explicit InputQueue(const LiveOptions& options);

  /// @throws std::invalid_argument where an event lies outside the sensor, or the calibration is
  /// not that of the camera's earlier packets: the packet is refused.
  void add(EventPacket packet);
  void add(PoseSample pose);
  /// Counts a packet that is not to be mapped. A `skippedPacket` takes its place.
  void skip(const EventPacket& packet);
  /// No more input will come. Packets and poses that are added afterwards are counted.
  void end();
  /// Wakes up the thread that takes, for good.
  void stop();

  struct Batch {
    std::vector<PoseSample> poses;  ///< In the order they came.
    std::vector<EventPacket> packets;
    /// The cameras with dropped packets, which are older than `packets`.
    std::map<int, MissingEvents> missing;
    bool ended = false;
  };
  using Clock = std::chrono::steady_clock;
  /// Waits for input, at most until then. Gives packets up to the next skipped one: the windows
  /// before the gap are mapped before it.
  Batch wait(std::optional<Clock::time_point> until = std::nullopt);
  /// The input that is there, up to the next skipped packet. Skipped packets themselves are given
  /// if all complete windows are mapped, as they are before `wait`.
  Batch take(bool all_mapped = false);

  std::uint64_t queuedEvents() const;
  std::map<int, QueueCounts> counts() const;
  /// Poses that came after the end, or were far ahead of their source.
  std::uint64_t refusedPoses() const;

 private:
  /// How far a stream of input has come.
  template <typename Input>
  struct Stream {
    std::optional<std::int64_t> reached_ns;  // the newest time that is not ahead
    std::optional<Input> ahead;              // until the next one confirms its time
    std::int64_t ahead_ns = 0;

    /// The newest time, of a clock that may go back.
    void follow(std::int64_t t_ns);
    /// Ends the wait. @return what waited, if its time is right; otherwise it counts as refused.
    std::optional<Input> settle(bool is_right, std::uint64_t& refused);
    /// At the end of the input.
    std::optional<Input> settleLast(std::uint64_t& refused);
  };

  struct Camera {
    explicit Camera(double max_rate) : budget(max_rate) {}
    EventBudget budget;
    std::optional<EventPacket> last;  // without events
    Stream<EventPacket> stream;       // of events and covers; one event may wait
    QueueCounts counts;
  };

  Camera& cameraOf(int index);
  void takeAhead(Camera& camera, EventPacket& packet);
  void pass(Camera& camera, EventPacket packet);
  void push(EventPacket packet);
  void dropOldest();
  bool isFull() const;
  Batch takeLocked(bool all_mapped);

  const LiveOptions options_;

  mutable std::mutex mutex_;  // of the members below
  std::condition_variable changed_;
  std::map<int, Camera> cameras_;
  std::deque<EventPacket> packets_;
  std::vector<PoseSample> poses_;
  std::map<PoseSourceId, Stream<PoseSample>> pose_streams_;
  std::uint64_t refused_poses_ = 0;
  std::map<int, MissingEvents> missing_;
  std::uint64_t events_ = 0;  // in packets_
  std::uint64_t bytes_ = 0;
  bool ended_ = false;
  bool stopped_ = false;
};

}  // namespace efm
