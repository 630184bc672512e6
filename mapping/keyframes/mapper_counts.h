// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <vector>

#include "mapping/events/event_fate.h"

namespace efm {

/// The reason why a window was dropped.
enum class DropReason {
  kOverload,    ///< Too much input waited, or input was dropped.
  kTooLarge,    ///< The window has more events than the live queue holds.
  kJump,        ///< The tracker jumped within the window.
  kNoPose,      ///< The poses of the window did not come in time.
  kNoScene,     ///< The window showed no scene, which automatic options need.
  kError,       ///< The window could not be mapped.
  kPaused,      ///< Map updating was disabled.
  kClockReset,  ///< The window was waiting at a clock reset.
};

struct DropReasonRow {
  DropReason reason;
  const char* key;   ///< The key in report.json.
  const char* text;  ///< The words after "3 windows".
};
inline constexpr DropReasonRow kDropReasons[] = {
    {DropReason::kOverload, "overload", "for overload"},
    {DropReason::kTooLarge, "too_large", "larger than the queue"},
    {DropReason::kJump, "jump", "across a jump of the tracker"},
    {DropReason::kNoPose, "no_pose", "without poses"},
    {DropReason::kNoScene, "no_scene", "without a scene"},
    {DropReason::kError, "error", "for errors"},
    {DropReason::kPaused, "paused", "while map updating was disabled"},
    {DropReason::kClockReset, "clock_reset", "at a clock reset"},
};
using DroppedWindows = CountsBy<DropReason, std::size(kDropReasons)>;

/// Keyframes by what is known of the motion in their windows.
struct MotionCounts {
  std::uint64_t known = 0;      ///< Keyframes with a known blur by poses.
  std::uint64_t corrected = 0;  ///< Keyframes with a corrected motion.
  double blur_px = 0;           ///< Sum over the known ones.
  double log_gain = 0;          ///< Sum over the corrected ones: of the sharpness.

  double meanBlurPx() const { return known > 0 ? blur_px / static_cast<double>(known) : 0; }
  /// Returns how many times as sharp the corrected keyframes are.
  double meanGain() const {
    return corrected > 0 ? std::exp(log_gain / static_cast<double>(corrected)) : 1;
  }
  MotionCounts& operator+=(const MotionCounts& other) {
    known += other.known;
    corrected += other.corrected;
    blur_px += other.blur_px;
    log_gain += other.log_gain;
    return *this;
  }
};

struct MapperCounts {
  std::vector<EventCounts> cameras;
  std::uint64_t event_uses = 0;  ///< Events that voted, summed over keyframes, which may overlap.
  VoteCounts votes;
  std::uint64_t keyframes = 0;
  std::uint64_t keyframes_without_pose = 0;  ///< Windows whose reference time had no pose.
  std::uint64_t windows_without_events = 0;  ///< Skipped: no selected camera has events.
  DroppedWindows dropped_windows;            ///< Dropped by `dropWindow` and `dropWindowsBefore`.
  std::uint64_t silent_subintervals = 0;     ///< Summed over keyframes; without silent cameras.
  std::uint64_t sorted_events = 0;  ///< Events that came after a newer event of their camera.
  std::uint64_t duplicate_poses = 0;
  MotionCounts motion;

  EventCounts total() const {
    EventCounts sum;
    for (const EventCounts& camera : cameras) sum += camera;
    return sum;
  }
  MapperCounts& operator+=(const MapperCounts& other) {
    cameras.resize(std::max(cameras.size(), other.cameras.size()));
    for (std::size_t i = 0; i < other.cameras.size(); ++i) cameras[i] += other.cameras[i];
    event_uses += other.event_uses;
    votes += other.votes;
    keyframes += other.keyframes;
    keyframes_without_pose += other.keyframes_without_pose;
    windows_without_events += other.windows_without_events;
    dropped_windows += other.dropped_windows;
    silent_subintervals += other.silent_subintervals;
    sorted_events += other.sorted_events;
    duplicate_poses += other.duplicate_poses;
    motion += other.motion;
    return *this;
  }
};

}  // namespace efm
