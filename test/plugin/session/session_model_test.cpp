// SPDX-License-Identifier: BSD-3-Clause
// Tests live operation against a naive model of each event, pose and window. The input queue and
// the session agree with the model after every step of random schedules.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "plugin/session/input_queue.h"
#include "test/memory/failing_allocation.h"
#include "test/plugin/session/session_driver.h"

namespace efm {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kS = 1000 * kMs;
constexpr std::int64_t kTickNs = 10 * kMs;
constexpr int kCameras = 2;
constexpr int kTracker = -1;

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
    table[name("other")] =
        of[EventFate::kFiltered] + of[EventFate::kOutsideLens] + of[EventFate::kOverBudget];
    table[name("silent in keyframes")] = status.silent_keyframes.at(c);
  }
  for (const auto& [camera, events] : status.rejected_events) {
    table[fmt::format("camera {} refused", camera)] = events;
  }
  for (const DropReasonRow& row : kDropReasons) {
    table[std::string("given up: ") + row.key] = counts.dropped_windows[row.reason];
  }
  table["keyframes"] = counts.keyframes;
  table["keyframes_without_pose"] = counts.keyframes_without_pose;
  table["windows_without_events"] = counts.windows_without_events;
  table["late_events"] = counts.late_events;
  table["duplicate_poses"] = counts.duplicate_poses;
  table["pose_jumps"] = status.live->pose_jumps;
  table["clock_steps"] = status.live->clock_resets;
  table["refused_poses"] = status.live->rejected_poses;
  return table;
}

/// Returns the counts that differ.
std::vector<std::string> differences(const Table& table, const Table& expected) {
  std::vector<std::string> rows;
  for (const auto& [what, count] : table) {
    const auto at = expected.find(what);
    const std::uint64_t other = at == expected.end() ? 0 : at->second;
    if (count != other) rows.push_back(fmt::format("{}: {}, model {}", what, count, other));
  }
  return rows;
}

/// A model of the session's counts for windows of one length and stride and given options. It keeps
/// all waiting data in plain lists and searches all of them each time.
class Model {
 public:
  explicit Model(const EventFusionOptions& options)
      : window_ns_(std::llround(options.mapper.policy.window_s * 1e9)),
        stride_ns_(std::llround(options.mapper.policy.stride_s * 1e9)),
        pose_wait_ns_(std::llround(options.live.max_pose_wait_s * 1e9)),
        max_speed_m_s_(options.live.max_speed_m_s),
        queue_events_(static_cast<double>(options.live.max_queue_events)),
        offsets_ns_(options.rig.time_offsets_ns) {
    status.live.emplace();
    status.counts.cameras.resize(kCameras);
    status.silent_keyframes.resize(kCameras);
  }

  SessionStatus status;

  void addPose(const StampedPose& pose, bool is_odometry) {
    if (clock_reset_) return later_.push_back([=] { addPose(pose, is_odometry); });
    if (!source_selected_ && is_odometry) {
      waiting_.push_back(pose);  // waits for a better source
    } else if (!use(pose)) {
      ++status.live->rejected_poses;
      const auto& newest = clock_.newest_pose;
      if (newest && pose.t_ns < newest->t_ns - kS) noteOlder(kTracker, pose.t_ns);
    } else {
      clock_.older.erase(kTracker);
    }
  }

  void addEvents(EventPacket packet) {
    if (clock_reset_) return later_.push_back([=] { addEvents(packet); });
    const int c = packet.camera;
    const std::int64_t offset_ns = offsets_ns_[static_cast<std::size_t>(c)];
    std::vector<Event> events = packet.events.all();
    for (Event& event : events) event.t_ns += offset_ns;
    if (packet.complete_until_ns) *packet.complete_until_ns += offset_ns;
    Camera& camera = clock_.cameras[static_cast<std::size_t>(c)];
    EventCounts& counts = status.counts.cameras[static_cast<std::size_t>(c)];
    std::int64_t newest_ns = camera.newest_ns.value_or(kMinTimeNs + kTickNs);
    const auto is_late = [&](const Event& event) { return event.t_ns < newest_ns - kTickNs; };
    const auto is_before = [](const Event& a, const Event& b) { return a.t_ns < b.t_ns; };
    if (!events.empty() && std::is_sorted(events.begin(), events.end(), is_before) &&
        std::all_of(events.begin(), events.end(), is_late)) {
      status.rejected_events[c] += events.size();
      return noteOlder(c, events.front().t_ns);
    }
    std::vector<std::int64_t> in_time;
    for (const Event& event : events) {
      ++counts.read;
      if (is_late(event)) ++status.counts.late_events;
      if (is_late(event) || event.t_ns < clock_.released_ns) ++counts[EventFate::kDropped];
      if (is_late(event)) continue;
      newest_ns = std::max(newest_ns, event.t_ns);
      in_time.push_back(event.t_ns);
      if (event.t_ns >= clock_.released_ns) camera.held.push_back({event.t_ns, false});
    }
    if (packet.complete_until_ns) {
      camera.covered_ns = std::max(camera.covered_ns, *packet.complete_until_ns);
    }
    if (in_time.empty()) {
      if (packet.complete_until_ns) dropMissing(c, *packet.complete_until_ns);
      return;
    }
    const std::int64_t first_ns = in_time.front();
    const std::int64_t last_ns = in_time.back();
    camera.newest_ns = std::max(camera.newest_ns.value_or(last_ns), last_ns);
    clock_.newest_begin_ns = std::max(clock_.newest_begin_ns, first_ns);
    clock_.reached_ns = std::max(clock_.reached_ns, last_ns);
    dropMissing(c, last_ns);
    clock_.older.erase(c);
    for (auto& [other, older] : clock_.older) older.others_ns[c] = first_ns;
    const std::map<int, MissingEvents> missing = clock_.missing;
    for (const auto& [other, lacking] : missing) {
      if (lacking.until_ns <= clock_.newest_begin_ns) dropMissing(other, kMaxTimeNs);
    }
    clock_.first_ns = std::min(clock_.first_ns, first_ns);
    const bool fills_queue = static_cast<double>(heldEvents()) > queue_events_ / 2;
    if (fills_queue || clock_.newest_begin_ns - clock_.first_ns > kS) selectSource();
  }

  void noteMissing(int camera, const MissingEvents& missing) {
    if (clock_reset_) return later_.push_back([=] { noteMissing(camera, missing); });
    MissingEvents& noted = clock_.missing[camera];
    const std::int64_t until_ns = missing.until_ns + offsets_ns_[static_cast<std::size_t>(camera)];
    noted = {std::max(noted.until_ns, until_ns), missing.reason};
  }

  void finish() {
    finished_ = true;
    while (!clock_.missing.empty()) dropMissing(clock_.missing.begin()->first, kMaxTimeNs);
    selectSource();
  }

  /// Returns the next window that can be mapped. Windows without events are skipped.
  std::optional<Window> nextWindow() {
    do {
      if (const std::optional<Window> window = windowOfStretch()) return window;
    } while (beginStretch() || beginClock());
    return std::nullopt;
  }

  /// Returns the same window, but does not go on to the poses after a jump.
  std::optional<Window> oldestWindow() { return windowOfStretch(); }

  enum class Outcome { kMapped, kMappingFails, kStoringFails, kTooMuch };
  /// @return whether a keyframe was computed.
  bool map(const Window& window, Outcome outcome) {
    MapperCounts& counts = status.counts;
    bool empty = true;
    for (Camera& camera : clock_.cameras) empty = empty && !camera.has(window);
    const bool mapped = !empty && hasPose(window.t_ref_ns);
    ++clock_.next;
    if (outcome == Outcome::kTooMuch || (outcome == Outcome::kMappingFails && mapped)) {
      ++(outcome == Outcome::kTooMuch ? counts.dropped_windows[DropReason::kOverload]
                                      : counts.dropped_windows[DropReason::kError]);
      lose(window.t0_ns, nextStartNs());
    } else if (mapped) {
      ++(outcome == Outcome::kMapped ? counts.keyframes
                                     : counts.dropped_windows[DropReason::kError]);
      for (std::size_t c = 0; c < kCameras; ++c) {
        bool silent = true;
        for (Held& event : clock_.cameras[c].held) {
          if (!window.contains(event.t_ns) || !hasPose(event.t_ns)) continue;
          event.used = true;
          silent = false;
        }
        if (silent && outcome == Outcome::kMapped) ++status.silent_keyframes[c];
      }
    } else {
      ++(empty ? counts.windows_without_events : counts.keyframes_without_pose);
    }
    release(finished_ ? nextStartNs() : std::min(nextStartNs(), completeNs()));
    return mapped;
  }

  void dropOlderHalf() {
    std::int64_t oldest_ns = kMaxTimeNs;  // oldest event that no earlier event can follow
    for (const Camera& camera : clock_.cameras) {
      for (const Held& event : camera.held) {
        if (event.t_ns < completeNs(camera)) oldest_ns = std::min(oldest_ns, event.t_ns);
      }
    }
    if (oldest_ns >= clock_.reached_ns) return;
    const auto held_ns = static_cast<double>(clock_.reached_ns - oldest_ns);
    const double needed =
        static_cast<double>(heldEvents()) * static_cast<double>(window_ns_) / held_ns;
    const bool too_large =
        needed > queue_events_ && static_cast<double>(heldEvents()) > queue_events_ / 2;
    dropWindowsBefore((oldest_ns + clock_.reached_ns) / 2 + 1,
                      too_large ? DropReason::kTooLarge : DropReason::kOverload);
  }

  /// Drops and releases data when no window can be mapped.
  void wait() {
    if (finished_) return release(kMaxTimeNs);
    if (clock_.start_ns) release(std::min(nextStartNs(), completeNs()));
    if (clock_.reached_ns == kMinTimeNs) return;
    std::optional<std::int64_t> newest_pose_ns;
    if (clock_.newest_pose) newest_pose_ns = clock_.newest_pose->t_ns;
    if (!clock_.next_segment.empty()) newest_pose_ns = clock_.next_segment.back().t_ns;
    if (!waiting_.empty()) newest_pose_ns = waiting_.back().t_ns;
    const std::int64_t overdue_ns = clock_.reached_ns - pose_wait_ns_;
    if (!newest_pose_ns || *newest_pose_ns < overdue_ns) {
      dropWindowsBefore(overdue_ns, DropReason::kNoPose);
    }
  }

  std::int64_t eventsCompleteNs() const {
    std::int64_t complete_ns = kMaxTimeNs;
    for (const Camera& camera : clock_.cameras) {
      complete_ns = std::min(complete_ns, completeNs(camera));
    }
    return complete_ns;
  }

 private:
  struct Held {
    std::int64_t t_ns;
    bool used;
  };
  struct Camera {
    std::vector<Held> held;
    std::optional<std::int64_t> newest_ns;
    std::int64_t covered_ns = kMinTimeNs;

    bool has(const Window& window) const {
      return std::any_of(held.begin(), held.end(),
                         [&](const Held& event) { return window.contains(event.t_ns); });
    }
  };
  struct Older {
    std::int64_t since_ns;
    std::map<int, std::int64_t> others_ns;
  };
  /// State that starts again when the clock goes back.
  struct Clock {
    std::array<Camera, kCameras> cameras;
    std::set<std::int64_t> poses_ns;
    std::optional<StampedPose> newest_pose;
    std::vector<StampedPose> next_segment;  // poses after a jump
    std::optional<std::int64_t> start_ns;
    std::int64_t next = 0;  // number of the next window
    std::int64_t first_ns = kMaxTimeNs;
    std::int64_t newest_begin_ns = kMinTimeNs;
    std::int64_t reached_ns = kMinTimeNs;
    std::int64_t released_ns = kMinTimeNs;
    std::vector<std::pair<std::int64_t, std::int64_t>> lost_ns;  // windows that were not mapped
    std::map<int, MissingEvents> missing;
    std::map<int, Older> older;
  };

  std::size_t heldEvents() const {
    return clock_.cameras[0].held.size() + clock_.cameras[1].held.size();
  }
  bool hasPose(std::int64_t t_ns) const {
    constexpr std::int64_t kMaxGapNs = 250 * kMs;
    const auto after = clock_.poses_ns.lower_bound(t_ns);
    if (after == clock_.poses_ns.end()) return false;
    if (*after == t_ns) return true;
    return after != clock_.poses_ns.begin() && *after - *std::prev(after) <= kMaxGapNs;
  }
  std::int64_t completeNs(const Camera& camera) const {
    if (finished_ && !clock_reset_) return kMaxTimeNs;
    std::int64_t complete_ns = camera.covered_ns;
    if (camera.newest_ns) complete_ns = std::max(complete_ns, *camera.newest_ns - kTickNs);
    const bool any = clock_.newest_begin_ns != kMinTimeNs;
    return any ? std::max(complete_ns, clock_.newest_begin_ns - kS) : complete_ns;
  }
  std::int64_t completeNs() const {
    if (clock_.poses_ns.empty()) return kMinTimeNs;
    return std::min(*clock_.poses_ns.rbegin(), eventsCompleteNs());
  }
  std::int64_t nextStartNs() const { return *clock_.start_ns + clock_.next * stride_ns_; }

  void selectSource() {
    source_selected_ = true;
    useAll(std::exchange(waiting_, {}));
  }
  void useAll(const std::vector<StampedPose>& poses) {
    for (const StampedPose& pose : poses) status.live->rejected_poses += use(pose) ? 0 : 1;
  }
  /// @return false if the pose is rejected.
  bool use(const StampedPose& pose) {
    if (!clock_.next_segment.empty() || isJump(pose)) {
      clock_.next_segment.push_back(pose);
      return true;
    }
    if (!pose.T_world_rig.translation.allFinite()) return false;
    if (!clock_.poses_ns.empty() && pose.t_ns < *clock_.poses_ns.rbegin() - kS) return false;
    if (!clock_.poses_ns.insert(pose.t_ns).second) ++status.counts.duplicate_poses;
    if (!clock_.newest_pose || pose.t_ns >= clock_.newest_pose->t_ns) clock_.newest_pose = pose;
    return true;
  }
  bool isJump(const StampedPose& pose) const {
    if (!clock_.newest_pose || pose.t_ns <= clock_.newest_pose->t_ns) return false;
    const auto step = pose.T_world_rig.translation - clock_.newest_pose->T_world_rig.translation;
    return step.norm() >
           max_speed_m_s_ * 1e-9 * static_cast<double>(pose.t_ns - clock_.newest_pose->t_ns);
  }
  bool beginStretch() {
    if (clock_.next_segment.empty()) return false;
    if (!finished_ && eventsCompleteNs() < clock_.newest_pose->t_ns) return false;
    ++status.live->pose_jumps;
    dropWindowsBefore(clock_.next_segment.front().t_ns, DropReason::kJump);
    clock_.newest_pose.reset();
    useAll(std::exchange(clock_.next_segment, {}));
    return true;
  }

  std::optional<Window> windowOfStretch() {
    if (!findStart()) return std::nullopt;
    passEmptyWindows();
    const std::int64_t t0_ns = nextStartNs();
    const Window window{t0_ns, t0_ns + window_ns_, t0_ns + window_ns_ / 2};
    const bool covered = clock_.reached_ns >= window.t1_ns && completeNs() >= window.t1_ns;
    return covered ? std::optional(window) : std::nullopt;
  }
  /// Sets the start, the first event with a pose, once no camera can send an earlier event.
  bool findStart() {
    if (clock_.start_ns || clock_.poses_ns.empty()) return clock_.start_ns.has_value();
    std::int64_t first_ns = kMaxTimeNs;
    for (const Camera& camera : clock_.cameras) {
      for (const Held& event : camera.held) {
        if (hasPose(event.t_ns)) first_ns = std::min(first_ns, event.t_ns);
      }
    }
    decide(std::min(first_ns, completeNs()));
    if (first_ns < kMaxTimeNs && eventsCompleteNs() >= first_ns) clock_.start_ns = first_ns;
    return clock_.start_ns.has_value();
  }
  void passEmptyWindows() {
    std::int64_t empty_ns = clock_.reached_ns;
    for (const Camera& camera : clock_.cameras) {
      std::int64_t next_ns = kMaxTimeNs;
      for (const Held& event : camera.held) {
        if (event.t_ns >= nextStartNs()) next_ns = std::min(next_ns, event.t_ns);
      }
      empty_ns = std::min(empty_ns, next_ns == kMaxTimeNs ? completeNs(camera) : next_ns);
    }
    for (; nextStartNs() + window_ns_ <= empty_ns; ++clock_.next) {
      ++status.counts.windows_without_events;
    }
  }

  void dropWindowsBefore(std::int64_t t_ns, DropReason reason) {
    std::int64_t from_ns = kMinTimeNs;
    std::int64_t until_ns = t_ns;
    if (clock_.start_ns) {
      from_ns = nextStartNs();
      for (; nextStartNs() < t_ns; ++clock_.next) ++status.counts.dropped_windows[reason];
      until_ns = nextStartNs();
    }
    if (reason != DropReason::kPaused) lose(from_ns, until_ns);
    release(t_ns);
  }
  void dropMissing(int camera, std::int64_t next_ns) {
    const auto missing = clock_.missing.find(camera);
    if (missing == clock_.missing.end()) return;
    dropWindowsBefore(std::min(missing->second.until_ns, next_ns), missing->second.reason);
    clock_.missing.erase(camera);
  }
  void lose(std::int64_t t0_ns, std::int64_t t1_ns) { clock_.lost_ns.push_back({t0_ns, t1_ns}); }
  void release(std::int64_t t_ns) {
    if (t_ns <= clock_.released_ns) return;
    clock_.released_ns = t_ns;
    decide(t_ns);
  }
  /// Counts the fate of the events before a time.
  void decide(std::int64_t t_ns) {
    for (std::size_t c = 0; c < kCameras; ++c) {
      EventCounts& counts = status.counts.cameras[c];
      std::vector<Held> later;
      for (const Held& event : clock_.cameras[c].held) {
        const bool lost =
            std::any_of(clock_.lost_ns.begin(), clock_.lost_ns.end(), [&](const auto& interval) {
              return event.t_ns >= interval.first && event.t_ns < interval.second;
            });
        if (event.t_ns >= t_ns) {
          later.push_back(event);
        } else {
          ++(event.used             ? counts[EventFate::kUsed]
             : !hasPose(event.t_ns) ? counts[EventFate::kWithoutPose]
             : lost                 ? counts[EventFate::kDropped]
                                    : counts[EventFate::kOutsideWindow]);
        }
      }
      clock_.cameras[c].held = later;
    }
  }
  /// A clock that alone is behind the others is wrong. Otherwise a second of older data means that
  /// all clocks went back.
  void noteOlder(int sensor, std::int64_t t_ns) {
    for (auto& [other, older] : clock_.older) older.others_ns.erase(sensor);
    const Older older = clock_.older.try_emplace(sensor, Older{t_ns, {}}).first->second;
    for (const auto& [other, other_ns] : older.others_ns) {
      if (sensor != kTracker && other_ns - t_ns > kS) return;
    }
    if (t_ns - older.since_ns < kS) return;
    clock_reset_ = true;
  }
  /// Starts the new clock after the complete windows before it are mapped.
  bool beginClock() {
    if (!clock_reset_) return false;
    dropWindowsBefore(clock_.reached_ns + 1, DropReason::kClockReset);
    clock_ = {};
    ++status.live->clock_resets;
    clock_reset_ = false;
    for (const auto& call : std::exchange(later_, {})) call();
    return true;
  }

  std::int64_t window_ns_;
  std::int64_t stride_ns_;
  std::int64_t pose_wait_ns_;
  double max_speed_m_s_;
  double queue_events_;
  std::vector<std::int64_t> offsets_ns_;
  Clock clock_;
  bool source_selected_ = false;
  bool clock_reset_ = false;
  std::vector<std::function<void()>> later_;
  std::vector<StampedPose> waiting_;
  bool finished_ = false;
};

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
  kPaused,
  kHostStalls,  // the host takes no input
  kMappingFails,
  kStoringFails,
  kTooMuchWaits,
  kMemoryFails,  // memory of an input: not in the model
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

/// A test run: session, queue and model in one thread.
class Run {
 public:
  /// @param predicts if true, the model predicts the windows; otherwise only properties of any
  /// windows are compared.
  Run(const EventFusionOptions& options, const PoseSourceId& source, bool predicts)
      : options_(options), source_(source), predicts_(predicts) {
    queue_.add(session_.status().rig);
  }

  void play(const std::vector<Phase>& phases) {
    runPhase({kHealthy, 0, 5});
    for (const Phase& phase : phases) runPhase(phase);
    queue_.end();
    taking_ = true;
    step({kHealthy, 0, 1});
    RC_ASSERT(session_.status().held_events == 0U);
    for (const auto& [camera, counts] : queue_.counts()) RC_ASSERT(counts.held == 0U);
    const RefinementState refinement = session_.status().refinement.value_or(RefinementState{});
    RC_ASSERT(refinement.waiting + refinement.failures == 0U);
    queue_.add(sampleOf(recording_.poses[0]));
    queue_.add(0, {{0, 1, 1, true}}, {});
    RC_ASSERT(queue_.counts().at(0).fates[EventFate::kAfterEnd] == 1U);
    RC_ASSERT(queue_.rejectedPoses() >= 1U);
  }

 private:
  void runPhase(const Phase& phase) {
    // Odometry waits at first, so the poses of two clocks would be mixed.
    const bool clock_back = phase.fault == kClockBack && session_.status().pose_source;
    if (clock_back) shift_ns_ -= 1503 * kMs + phase.ticks * kTickNs;
    if (phase.fault == kTrackerJumps) away_m_ += 10;
    taking_ = phase.fault != kHostStalls;
    for (int tick = 0; tick < phase.ticks && tick_ + 1 < recording_.poses.size(); ++tick) {
      ++tick_;
      addPose(phase.fault);
      for (int c = 0; c < kCameras; ++c) {
        const bool last = tick + 1 == phase.ticks;
        addPacket(c, c == phase.camera ? phase.fault : pausedOr(phase.fault), last);
      }
      step(phase);
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
    if (fault == kPosesTwice) queue_.add(sampleOf(pose, source_));
    queue_.add(sampleOf(pose, source_));
    pose.t_ns -= 505 * kMs;
    if (fault == kLatePoses) queue_.add(sampleOf(pose, source_));
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
    if (fault == kBadPackets) part.push_back({now_ns, 120, 1, true});
    for (Event& event : part) event.t_ns -= offset_ns;
    if (complete_ns) *complete_ns -= offset_ns;
    received_[index] += part.size();
    if (fault == kPaused) return queue_.skip(c, part);
    try {
      queue_.add(c, std::move(part), complete_ns);
    } catch (const std::invalid_argument&) {
      RC_ASSERT(fault == kBadPackets);
    }
  }

  /// Does one step of the mapping thread.
  void step(const Phase& phase) {
    std::uint64_t queued = 0;
    for (const auto& [camera, counts] : queue_.counts()) {
      RC_ASSERT(counts.received == received_[std::size_t(camera)]);
      queued += counts.queued;
    }
    RC_ASSERT(queued == queue_.queuedEvents());
    RC_ASSERT(queued <= static_cast<std::uint64_t>(options_.live.max_queue_events));
    if (!taking_) return;
    while (takeBatch(phase)) {
    }
    compare();
  }

  /// @return whether there were packets; more packets may wait behind skipped packets.
  bool takeBatch(const Phase& phase) {
    const InputQueue::Batch batch = queue_.take(true);
    const auto add = [&](auto input) {
      if (phase.fault == kMemoryFails) {
        failAllocation(Allocating::kThisThread, static_cast<std::size_t>(phase.ticks));
      }
      bool taken = false;
      try {
        input();
        taken = true;
      } catch (const std::invalid_argument&) {
      } catch (const std::bad_alloc&) {
      }
      stopFailing();
      return taken;
    };
    for (const PoseSample& pose : batch.poses) {
      rejected_poses_ += add([&] { session_.addPose(pose); }) ? 0 : 1;
      model_.addPose({pose.t_ns, pose.T_world_body}, source_.kind != PoseKind::kPose);
    }
    for (const auto& [camera, missing] : batch.missing) {
      session_.noteMissing(camera, missing);
      model_.noteMissing(camera, missing);
    }
    for (const QueuedPacket& packet : batch.packets) {
      if (packet.skipped_until_ns) {
        const MissingEvents missing{*packet.skipped_until_ns, DropReason::kPaused};
        session_.noteMissing(packet.camera, missing);
        model_.noteMissing(packet.camera, missing);
        continue;
      }
      taken_[std::size_t(packet.camera)] += packet.events.size();
      EventPacket copy = packet;
      add([&] { session_.addEvents(std::move(copy)); });
      model_.addEvents(packet);
    }
    if (batch.ended) {
      session_.finish();
      model_.finish();
    }
    if (phase.fault == kTooMuchWaits) limitHeld();
    while (mapNext(phase.fault)) {
    }
    if (predicts_) model_.wait();
    return !batch.packets.empty();
  }

  /// Sets the limit of held events to zero: all windows that newer events follow are dropped.
  void limitHeld() {
    messageOf([&] { session_.limitHeld(-1); });
    if (!predicts_) return;
    std::optional<Window> oldest = model_.oldestWindow();
    while (oldest && model_.eventsCompleteNs() >= 2 * oldest->t1_ns - oldest->t0_ns) {
      model_.map(*oldest, Model::Outcome::kTooMuch);
      oldest = model_.oldestWindow();
    }
    if (!oldest) model_.dropOlderHalf();
  }

  bool mapNext(int fault) {
    AlwaysFailingSink sink;
    using Outcome = Model::Outcome;
    const auto outcome = fault == kMappingFails   ? Outcome::kMappingFails
                         : fault == kStoringFails ? Outcome::kStoringFails
                                                  : Outcome::kMapped;
    bool expected = false;
    std::optional<Window> mapped;
    while (predicts_ && !expected) {
      mapped = model_.nextWindow();
      if (!mapped) break;
      expected = model_.map(*mapped, outcome);
    }
    try {
      const auto keyframe = session_.next(fault == kMappingFails ? &sink : nullptr, processSeconds,
                                          [&](const auto&, const auto&) {
                                            if (fault == kStoringFails)
                                              throw std::runtime_error("disk full");
                                          });
      RC_ASSERT(!predicts_ || keyframe.has_value() == expected);
      if (keyframe && mapped) RC_ASSERT(keyframe->window.t0_ns == mapped->t0_ns);
      keyframes_ += keyframe ? 1 : 0;
      return keyframe.has_value();
    } catch (const std::runtime_error&) {
      RC_ASSERT(!predicts_ || expected);
      RC_ASSERT(session_.dropFailedWindow());
      return true;
    }
  }

  void compare() {
    SessionStatus status = session_.status();
    status.live->rejected_poses += rejected_poses_;
    const Table table = tableOf(status);
    if (predicts_) {
      RC_ASSERT(differences(table, tableOf(model_.status)) == std::vector<std::string>{});
    }
    const EventCounts all = status.counts.total();
    RC_ASSERT(all.read == all.fates.total() + status.held_events);
    RC_ASSERT(status.counts.keyframes == keyframes_);
    RC_ASSERT(session_.T_odom_ref().size() == keyframes_);
    RC_ASSERT(session_.T_world_ref().size() == keyframes_);
    for (const auto& [what, count] : earlier_) {
      // The choice of options counts the windows without a scene again.
      RC_ASSERT(what == "given up: no_scene" || table.at(what) >= count);
    }
    earlier_ = table;
    for (const auto& [camera, counts] : queue_.counts()) {
      const auto index = static_cast<std::size_t>(camera);
      RC_ASSERT(counts.queued == 0U);
      RC_ASSERT(counts.taken == taken_[index]);
      const auto rejected = status.rejected_events.find(camera);
      const std::uint64_t rejected_events =
          rejected == status.rejected_events.end() ? 0 : rejected->second;
      const EventCounts& of = status.counts.cameras.at(index);
      RC_ASSERT(counts.taken == of.read + rejected_events);
      RC_ASSERT(status.live->cameras.at(camera).lost ==
                rejected_events + of[EventFate::kDropped] + of[EventFate::kWithoutPose]);
    }
  }

  EventFusionOptions options_;
  PoseSourceId source_;
  bool predicts_;
  const SyntheticRecording& recording_ = sharedRecording();
  InputQueue queue_{options_.live};
  SessionOfRig session_{options_};
  Model model_{options_};
  std::size_t tick_ = 0;
  std::array<std::size_t, kCameras> begin_{};
  std::array<std::vector<Event>, kCameras> late_;
  std::array<std::uint64_t, kCameras> received_{};
  std::array<std::uint64_t, kCameras> taken_{};
  std::int64_t shift_ns_ = 0;
  double away_m_ = 0;
  bool taking_ = true;
  std::uint64_t rejected_poses_ = 0;
  std::uint64_t keyframes_ = 0;
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

RC_GTEST_PROP(SessionModel, SaysWhatBecomesOfEachEventPoseAndWindow, ()) {
  const EventFusionOptions options = someOptions();
  Run(options, someSource(), true).play(somePhases(kMemoryFails));
}

RC_GTEST_PROP(SessionModel, CountsAddUpWithEveryPolicyAutomaticOptionsAndRefinement, ()) {
  EventFusionOptions options = someOptions();
  KeyframePolicyOptions& policy = options.mapper.policy;
  policy.policy = *rc::gen::element(KeyframePolicyKind::kPeriod, KeyframePolicyKind::kEvents,
                                    KeyframePolicyKind::kBaseline);
  policy.window_events = 200;
  policy.min_baseline_ratio = 0.05;
  options.automatic.window_s = options.automatic.min_depth_m = *rc::gen::arbitrary<bool>();
  options.live.max_event_rate = *rc::gen::element(0.0, 1000.0);
  options.refinement.enabled = *rc::gen::arbitrary<bool>();
  options.refinement.background = *rc::gen::arbitrary<bool>();
  Run(options, someSource(), false).play(somePhases(kNumTroubles));
}

}  // namespace
}  // namespace efm
