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
#include <utility>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/events/event_checker.h"
#include "plugin/session/event_fusion_options.h"
#include "plugin/session/input.h"
#include "plugin/session/pose_intake.h"
#include "plugin/session/session_status.h"

namespace efm {

/// Subsamples the events of one camera to a rate of sensor time. Of each 10 ms of the camera's
/// clock, at most rate / 100 events pass, spread evenly (`EvenChoice`). The choice depends on the
/// order of the events, not on the packets in which they arrive, nor on the machine.
///
/// The events of the current 10 ms are held until a later event, or a packet's `complete_until_ns`,
/// ends the interval. A late event belongs to the current 10 ms.
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

/// The input of live operation. A sensor does not wait and cannot be read again: data may come late
/// or with wrong times, a clock may go back, the tracker may jump, and more may come than can be
/// mapped. The gate finds this, leaves out what is wrong, subsamples the events, and bounds what
/// waits in events and in bytes: if it is full, the oldest packets are dropped, but never poses.
///
/// What passes is in the order of arrival, with the breaks between the data. It depends on the
/// order of the input only, not on when it is taken, as long as the gate is not full. README.md has
/// the rules. Any thread adds; one thread takes. Adding never waits for the mapping.
class Gate {
 public:
  explicit Gate(const LiveOptions& options);

  /// Adds all cameras, before the first events.
  void add(const Rig& rig);
  void add(EventPacket packet);
  /// Adds events that were not checked.
  /// @throws std::invalid_argument if an event is not possible. All events are rejected.
  void add(int camera, std::vector<Event> events, std::optional<std::int64_t> complete_until_ns);
  void add(PoseSample pose);
  /// Counts events that are not to be mapped: they are missing.
  void skip(int camera, const std::vector<Event>& events);
  /// Ends the input. Packets and poses that are added later are counted only.
  void end();
  /// Wakes up the thread that takes. It does not wait again.
  void stop();

  using Clock = std::chrono::steady_clock;
  /// Waits for input, at most until this time.
  void wait(std::optional<Clock::time_point> until = std::nullopt);
  /// Takes the next input. @return std::nullopt if there is none.
  /// @param complete_ns time until which the session has all events of its cameras, on the clock of
  /// the poses. A jump waits until this is the pose before it.
  std::optional<Input> take(std::int64_t complete_ns);
  /// Returns whether the input has ended and was taken.
  bool isAtEnd() const;

  std::uint64_t queuedEvents() const;
  std::map<int, QueueCounts> counts() const;
  /// Returns the number of events over 10 ms older than their camera's newest one.
  std::uint64_t lateEvents() const;
  /// Returns the number of poses that came after the end, or have a wrong time or place.
  std::uint64_t rejectedPoses() const;

 private:
  /// Input in the order of its numbers.
  template <typename One>
  using Numbered = std::deque<std::pair<std::uint64_t, One>>;

  struct Camera {
    explicit Camera(double max_rate) : budget(max_rate) {}
    EventChecker checker;
    EventBudget budget;
    std::optional<std::int64_t> complete_until_ns;  // as the last packet says
    std::optional<std::int64_t> passed_until_ns;    // of the packet that passed
    std::int64_t newest_ns = kMinTimeNs;            // that passed, on the clock of the poses
    std::size_t waiting = 0;                        // events in the checker
    std::size_t older = 0;                          // events in held_
    QueueCounts counts;
  };
  /// Poses of one source.
  struct Tracker {
    std::optional<PoseSample> newest, before;  // the last two that passed
    /// Poses that are far from it, divided where they are far from each other.
    std::vector<std::vector<PoseSample>> away;
  };
  /// A sensor that sends older data than before.
  struct Older {
    std::int64_t since_ns;
    std::map<int, std::int64_t> others_ns;  // newest times of the cameras that continue
  };

  Camera& cameraOf(int index);
  std::int64_t offsetOf(int camera) const;
  void receive(int index, std::vector<Event> events, std::optional<std::int64_t> complete_until_ns);
  void pass(int index, std::vector<Event> right);
  void passRest(int index, Camera& camera, bool at_end);
  void takeSettled(Camera& camera, std::vector<Event>& right);
  void confirmEvents();
  void push(EventPacket packet);
  void push(Input other);
  void dropOldest();
  bool isFull() const;
  void addTimely(std::vector<PoseSample> poses);
  void addTimely(PoseSample pose);
  bool isJump(const PoseSample& from, const PoseSample& to) const;
  bool isBack(const Tracker& tracker, const PoseSample& pose) const;
  void jump(Tracker& tracker);
  void addOlder(int sensor, std::int64_t t_ns, Input input);
  void rejectHeld(int sensor);
  void rejectOlder(int sensor);
  void noteInTime(int sensor, std::int64_t t_ns);
  void resetClock();
  void endClock();
  bool jumpWaits() const;
  std::optional<Input> takeOther();
  std::optional<Input> takePacket();

  const LiveOptions options_;

  mutable std::mutex mutex_;  // guards the members below
  std::condition_variable changed_;
  Rig rig_;
  std::map<int, Camera> cameras_;
  PoseIntake pose_intake_;
  std::map<PoseSourceId, Tracker> trackers_;
  std::map<int, Older> older_;               // by camera, or the tracker
  std::vector<std::pair<int, Input>> held_;  // their data, until it is clear what they are
  std::uint64_t held_events_ = 0;
  Numbered<EventPacket> packets_;
  Numbered<Input> others_;  // all else
  std::uint64_t next_number_ = 0;
  std::map<int, Missing> missing_;  // of dropped packets, which are older than those in packets_
  std::int64_t newest_pose_ns_ = kMinTimeNs;
  std::int64_t complete_ns_ = kMinTimeNs;  // as the last `take` said
  std::uint64_t late_events_ = 0;
  std::uint64_t rejected_poses_ = 0;
  std::uint64_t events_ = 0;  // in packets_
  std::uint64_t bytes_ = 0;
  bool ended_ = false;
  bool stopped_ = false;
};

}  // namespace efm
