// SPDX-License-Identifier: BSD-3-Clause
// Tests live operation in one thread: random schedules of troubles, taken in batches of any size.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "test/memory/failing_allocation.h"
#include "test/plugin/session/session_driver.h"

namespace efm {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kS = 1000 * kMs;
constexpr std::int64_t kTickNs = 10 * kMs;
constexpr int kCameras = 2;

using Table = std::map<std::string, std::uint64_t>;

/// Returns all counts.
Table tableOf(const SessionStatus& status) {
  Table table;
  const MapperCounts& counts = status.counts;
  for (std::size_t c = 0; c < counts.cameras.size(); ++c) {
    const EventCounts& of = counts.cameras[c];
    const auto name = [&](const char* what) { return fmt::format("camera {} {}", c, what); };
    table[name("read")] = of.read;
    table[name("used")] = of[EventFate::kUsed];
    table[name("without_pose")] = of[EventFate::kWithoutPose];
    table[name("outside_window")] = of[EventFate::kOutsideWindow];
    table[name("dropped")] = of[EventFate::kDropped];
    table[name("late")] = of[EventFate::kLate];
    table[name("unselected")] = of[EventFate::kUnselected];
    table[name("other")] =
        of[EventFate::kFiltered] + of[EventFate::kOutsideLens] + of[EventFate::kOverBudget];
    table[name("silent in keyframes")] = status.silent_keyframes.at(c);
  }
  for (const auto& [camera, events] : status.rejected_events) {
    table[fmt::format("camera {} rejected", camera)] = events;
  }
  for (const DropReasonRow& row : kDropReasons) {
    table[std::string("dropped: ") + row.key] = counts.dropped_windows[row.reason];
  }
  table["keyframes"] = counts.keyframes;
  table["keyframes_without_pose"] = counts.keyframes_without_pose;
  table["windows_without_events"] = counts.windows_without_events;
  table["duplicate_poses"] = counts.duplicate_poses;
  table["pose_jumps"] = status.live->pose_jumps;
  table["clock_resets"] = status.live->clock_resets;
  table["rejected_poses"] = status.live->rejected_poses;
  return table;
}

/// Returns the counts that differ.
std::vector<std::string> differences(const Table& table, const Table& expected) {
  std::vector<std::string> rows;
  for (const auto& [what, count] : table) {
    const auto at = expected.find(what);
    const std::uint64_t other = at == expected.end() ? 0 : at->second;
    if (count != other) rows.push_back(fmt::format("{}: {}, expected {}", what, count, other));
  }
  return rows;
}

enum Trouble {
  kHealthy,
  kCameraSilent,     // the camera's events are lost
  kCameraLate,       // the camera's packets come together, later
  kCameraClockBack,  // one camera's clock goes back
  kClockBack,        // all clocks go back permanently
  kTrackerLost,
  kTrackerJumps,
  kTrackerClockBack,
  kPosesTwice,
  kLatePoses,
  kBadPoses,
  kLateEvents,
  kBadPackets,
  kEventsAhead,  // a burst of events 100 s ahead
  kPosesAhead,
  kPosesAway,  // every fifth pose is far away
  kPaused,
  kMappingFails,
  kTooMuchWaits,
  kMemoryFails,  // memory of an input
  kNumTroubles
};

struct Phase {
  int fault;
  int camera;
  int ticks;
};

void showValue(const Phase& phase, std::ostream& os) {
  os << "{" << phase.fault << ", camera " << phase.camera << ", " << phase.ticks << " ticks}";
}

const SyntheticRecording& sharedRecording() {
  static const SyntheticRecording recording(6, kCameras, {2, 0.4, 0, 0});
  return recording;
}

/// A test run in one thread.
class Run {
 public:
  /// @param ticks_per_batch 1: each input is mapped before the next one comes.
  Run(const EventFusionOptions& options, const PoseSourceId& source, int ticks_per_batch)
      : options_(options), source_(source), ticks_per_batch_(ticks_per_batch) {
    gate_.add(calibrated({recording_.cameras}, {}, options.rig.time_offsets_ns));
    session_.add(*gate_.take(kMaxTimeNs));
  }

  void play(const std::vector<Phase>& phases) {
    runPhase({kHealthy, 0, 5});
    for (const Phase& phase : phases) runPhase(phase);
    gate_.end();
    step({kHealthy, 0, 1});
    messageOf([&] { session_.finish(); });  // a waiting pose may be rejected
    while (mapNext(kHealthy)) {
    }
    compare();
    RC_ASSERT(gate_.isAtEnd());
    RC_ASSERT(session_.status().held_events == 0U);
    for (const auto& [camera, counts] : gate_.counts()) RC_ASSERT(counts.held == 0U);
    const RefinementState refinement = session_.status().refinement.value_or(RefinementState{});
    RC_ASSERT(refinement.waiting + refinement.failures == 0U);
    gate_.add(sampleOf(recording_.poses[0]));
    gate_.add(0, {{0, 1, 1, true}}, {});
    RC_ASSERT(gate_.counts().at(0).fates[QueueFate::kAfterEnd] == 1U);
    RC_ASSERT(gate_.rejectedPoses() >= 1U);
  }

  /// Returns all counts and the keyframes' times.
  Table result() const {
    SessionStatus status = session_.status();
    status.live->rejected_poses += rejected_poses_ + gate_.rejectedPoses();
    Table table = tableOf(status);
    for (const std::int64_t t_ns : windows_ns_) table[fmt::format("window {}", t_ns)] = 1;
    return table;
  }

 private:
  void runPhase(const Phase& phase) {
    // Odometry waits for a second, so the poses of two clocks would be mixed.
    const bool clock_back = phase.fault == kClockBack && tick_ > 150;
    if (clock_back) shift_ns_ -= 1503 * kMs + phase.ticks * kTickNs;
    if (phase.fault == kTrackerJumps) away_m_ += 10;
    for (int tick = 0; tick < phase.ticks && tick_ + 1 < recording_.poses.size(); ++tick) {
      ++tick_;
      addPose(phase.fault);
      for (int c = 0; c < kCameras; ++c) {
        const bool last = tick + 1 == phase.ticks;
        addPacket(c, c == phase.camera ? phase.fault : pausedOr(phase.fault), last);
      }
      if (tick_ % std::size_t(ticks_per_batch_) == 0) step(phase);
    }
  }
  static int pausedOr(int fault) { return fault == kPaused ? kPaused : kHealthy; }

  void addPose(int fault) {
    StampedPose pose = recording_.poses[tick_];
    pose.t_ns += shift_ns_;
    pose.T_world_rig.translation.y() += away_m_;
    if (fault == kTrackerLost) return;
    if (fault == kTrackerClockBack) pose.t_ns -= 3007 * kMs;  // a time that no other pose has
    if (fault == kBadPoses) pose.T_world_rig.translation.x() = std::nan("");
    if (fault == kPosesAhead && tick_ % 7 < 3) pose.t_ns += 100 * kS;
    if (fault == kPosesAway && tick_ % 5 == 0) pose.T_world_rig.translation.z() += 60;
    if (fault == kPosesTwice) gate_.add(sampleOf(pose, source_));
    gate_.add(sampleOf(pose, source_));
    pose.t_ns -= 505 * kMs;
    if (fault == kLatePoses) gate_.add(sampleOf(pose, source_));
  }

  void addPacket(int c, int fault, bool last) {
    const auto index = static_cast<std::size_t>(c);
    std::vector<Event> part;
    const std::int64_t until_ns = recording_.poses[tick_].t_ns;
    std::size_t& begin = begin_[index];
    const std::vector<Event>& events = recording_.events[index];
    for (; begin < events.size() && events[begin].t_ns < until_ns; ++begin) {
      part.push_back(events[begin]);
      part.back().t_ns += shift_ns_;
    }
    std::optional<std::int64_t> complete_ns = until_ns + shift_ns_;
    if (fault == kCameraSilent) return;
    std::vector<Event>& waiting = late_[index];
    part.insert(part.begin(), waiting.begin(), waiting.end());
    waiting.clear();
    if (fault == kCameraLate && !last) {
      waiting = part;
      return;
    }
    if (fault == kCameraClockBack) {
      complete_ns.reset();
      for (Event& event : part) event.t_ns -= 5 * kS;
    }
    const std::int64_t now_ns = until_ns + shift_ns_;
    const std::int64_t offset_ns = options_.rig.time_offsets_ns[index];
    if (fault == kLateEvents) part.push_back({now_ns - 40 * kMs, 1, 1, true});
    if (fault == kEventsAhead) {
      for (std::size_t i = 0; i < part.size(); i += 2) part[i].t_ns += 100 * kS;
    }
    if (fault == kBadPackets) part.push_back({now_ns, 120, 1, true});
    for (Event& event : part) event.t_ns -= offset_ns;
    if (complete_ns) *complete_ns -= offset_ns;
    received_[index] += part.size();
    if (fault == kPaused) return gate_.skip(c, part);
    try {
      gate_.add(c, std::move(part), complete_ns);
    } catch (const std::invalid_argument&) {
      RC_ASSERT(fault == kBadPackets);
    }
  }

  /// Does one step of the mapping thread.
  void step(const Phase& phase) {
    std::uint64_t queued = 0;
    for (const auto& [camera, counts] : gate_.counts()) {
      RC_ASSERT(counts.received == received_[std::size_t(camera)]);
      queued += counts.queued;
    }
    RC_ASSERT(queued == gate_.queuedEvents());
    RC_ASSERT(queued <= static_cast<std::uint64_t>(options_.live.max_queue_events));
    while (std::optional<Input> input = gate_.take(session_.eventsCompleteNs())) {
      const auto* const packet = std::get_if<EventPacket>(&*input);
      if (packet) taken_[std::size_t(packet->camera)] += packet->events.size();
      const bool is_pose = std::holds_alternative<PoseSample>(*input);
      if (phase.fault == kMemoryFails) {
        failAllocation(Allocating::kThisThread, static_cast<std::size_t>(phase.ticks));
      }
      try {
        session_.add(std::move(*input));
      } catch (const std::invalid_argument&) {
        rejected_poses_ += is_pose ? 1 : 0;
      } catch (const std::bad_alloc&) {
      }
      stopFailing();
      if (phase.fault == kTooMuchWaits) messageOf([&] { session_.limitHeld(-1); });
      while (mapNext(phase.fault)) {
      }
      session_.limitWaits();
    }
    compare();
  }

  bool mapNext(int fault) {
    AlwaysFailingSink sink;
    try {
      const auto keyframe = session_.next(fault == kMappingFails ? &sink : nullptr);
      if (keyframe) windows_ns_.push_back(keyframe->window.t0_ns);
      return keyframe.has_value();
    } catch (const std::runtime_error&) {
      RC_ASSERT(session_.dropFailedWindow());
      return true;
    }
  }

  void compare() {
    const SessionStatus status = session_.status();
    const Table table = tableOf(status);
    const EventCounts all = status.counts.total();
    RC_ASSERT(all.read == all.fates.total() + status.held_events);
    RC_ASSERT(status.counts.keyframes == windows_ns_.size());
    RC_ASSERT(posesOf(session_).size() == windows_ns_.size());
    for (const auto& [what, count] : earlier_) {
      // The choice of options counts the windows without a scene again.
      RC_ASSERT(what == "dropped: no_scene" || table.at(what) >= count);
    }
    earlier_ = table;
    for (const auto& [camera, counts] : gate_.counts()) {
      const auto index = static_cast<std::size_t>(camera);
      RC_ASSERT(counts.queued == 0U);
      RC_ASSERT(counts.taken == taken_[index]);
      const auto rejected = status.rejected_events.find(camera);
      const std::uint64_t rejected_events =
          rejected == status.rejected_events.end() ? 0 : rejected->second;
      const EventCounts& of = status.counts.cameras.at(index);
      RC_ASSERT(counts.taken == of.read + rejected_events);
      if (!isSelected(camera, options_.mapper.cameras)) continue;
      RC_ASSERT(status.live->cameras.at(camera).lost == rejected_events + of[EventFate::kDropped] +
                                                            of[EventFate::kLate] +
                                                            of[EventFate::kWithoutPose]);
    }
  }

  EventFusionOptions options_;
  PoseSourceId source_;
  int ticks_per_batch_;
  const SyntheticRecording& recording_ = sharedRecording();
  Gate gate_{options_.live};
  MappingSession session_{options_};
  std::size_t tick_ = 0;
  std::array<std::size_t, kCameras> begin_{};
  std::array<std::vector<Event>, kCameras> late_;
  std::array<std::uint64_t, kCameras> received_{};
  std::array<std::uint64_t, kCameras> taken_{};
  std::int64_t shift_ns_ = 0;
  double away_m_ = 0;
  std::uint64_t rejected_poses_ = 0;
  std::vector<std::int64_t> windows_ns_;
  Table earlier_;
};

EventFusionOptions someOptions() {
  EventFusionOptions options = syntheticOptions();
  options.live.enabled = true;
  // The second camera's clock is ahead or behind.
  options.rig.time_offsets_ns = {7 * kMs, *rc::gen::element(0L, -3 * kS, 4 * kS)};
  options.mapper.keyframe.planes.num_planes = 4;
  options.mapper.keyframe.sweep.threads = 1;
  options.live.max_event_rate = 0;
  options.live.max_queue_events = *rc::gen::element(60, 1'000'000);
  options.live.max_pose_wait_s = *rc::gen::element(0.2, 0.6, 2.0);
  return options;
}

PoseSourceId someSource() {
  return {*rc::gen::element(PoseKind::kPose, PoseKind::kPose, PoseKind::kOdometry), "tracker"};
}

std::vector<Phase> somePhases(int num_troubles) {
  const auto phase = rc::gen::construct<Phase>(
      rc::gen::inRange(0, num_troubles), rc::gen::inRange(0, kCameras),
      rc::gen::weightedOneOf<int>({{5, rc::gen::inRange(1, 40)}, {1, rc::gen::inRange(90, 250)}}));
  return *rc::gen::resize(100, rc::gen::container<std::vector<Phase>>(phase));
}

// The same input makes the same keyframes and counts, however much of it waits at a time.
RC_GTEST_PROP(LiveSession, DoesNotDependOnBatches, ()) {
  EventFusionOptions options = someOptions();
  options.live.max_queue_events = 1'000'000;
  options.automatic.window_s = options.automatic.min_depth_m = *rc::gen::arbitrary<bool>();
  options.live.max_event_rate = *rc::gen::element(0.0, 1000.0);
  const PoseSourceId source = someSource();
  const std::vector<Phase> phases = somePhases(kMappingFails);
  Run at_once(options, source, 1);
  at_once.play(phases);
  Run in_batches(options, source, *rc::gen::element(2, 17, 1000));
  in_batches.play(phases);
  RC_ASSERT(differences(in_batches.result(), at_once.result()) == std::vector<std::string>{});
  RC_ASSERT(differences(at_once.result(), in_batches.result()) == std::vector<std::string>{});
}

RC_GTEST_PROP(LiveSession, CountsAddUpWithEveryPolicyAutomaticOptionsAndRefinement, ()) {
  EventFusionOptions options = someOptions();
  KeyframePolicyOptions& policy = options.mapper.policy;
  policy.policy = *rc::gen::element(KeyframePolicyKind::kPeriod, KeyframePolicyKind::kEvents,
                                    KeyframePolicyKind::kBaseline);
  policy.window_events = 200;
  policy.min_baseline_ratio = 0.05;
  options.automatic.window_s = options.automatic.min_depth_m = *rc::gen::arbitrary<bool>();
  options.live.max_event_rate = *rc::gen::element(0.0, 1000.0);
  if (*rc::gen::arbitrary<bool>()) options.mapper.cameras = {1};
  options.refinement.enabled = *rc::gen::arbitrary<bool>();
  options.refinement.background = *rc::gen::arbitrary<bool>();
  Run(options, someSource(), *rc::gen::element(1, 20)).play(somePhases(kNumTroubles));
}

}  // namespace
}  // namespace efm
