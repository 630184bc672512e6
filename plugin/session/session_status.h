// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "mapping/base/option.h"
#include "mapping/base/stage_times.h"
#include "mapping/events/window.h"
#include "mapping/geometry/rig.h"
#include "mapping/keyframes/mapper_counts.h"
#include "maps/refinement/refinement_state.h"
#include "plugin/session/map_quality.h"
#include "plugin/session/pose_source_selector.h"

namespace efm {

/// Returns a time for the user, exact, and its distance from the recording's start, rounded to
/// milliseconds: "1468939802.345678901 s (+3.2 s)".
/// @param start_ns the recording's first event; std::nullopt: the text has the time only.
std::string timeText(std::int64_t t_ns, std::optional<std::int64_t> start_ns);

/// Returns the text of an interval: "10.100000000 to 10.300000000 s (+0.1 to +0.3 s)".
std::string timeText(std::int64_t first_ns, std::int64_t last_ns,
                     std::optional<std::int64_t> start_ns);

/// Returns time limits as options: "from --t0 2.000000000 s until --t1 3.000000000 s".
std::string limitsText(const TimeLimits& limits);

/// Returns a duration: "42 s", "3:05 min" or, from an hour on, "01:23 h" (HH:MM).
std::string durationText(double seconds);

/// First and last time of a stream, on the trajectory's clock.
struct TimeSpan {
  std::int64_t first_ns = 0;
  std::int64_t last_ns = 0;
};

/// Extends a span to a time.
inline void extend(std::optional<TimeSpan>& span, std::int64_t t_ns) {
  if (!span) span = TimeSpan{t_ns, t_ns};
  span->first_ns = std::min(span->first_ns, t_ns);
  span->last_ns = std::max(span->last_ns, t_ns);
}

/// The fate of an event before the mapping, in live operation.
enum class QueueFate {
  kSubsampled,  ///< Over the limit of events per second of sensor time.
  kQueueFull,   ///< Dropped because the queue was full.
  kRejected,    ///< Late, with a wrong time (`EventChecker`), or in a packet that is not possible.
  kPaused,      ///< Arrived while map updating was disabled.
  kAfterEnd,    ///< Arrived after the end of the input.
};
inline constexpr FateRow<QueueFate> kQueueFates[] = {
    {QueueFate::kSubsampled, "subsampled", "subsampled"},
    {QueueFate::kQueueFull, "dropped", "dropped"},
    {QueueFate::kRejected, "rejected", "rejected"},
    {QueueFate::kPaused, "paused", "paused", false},
    {QueueFate::kAfterEnd, "after_end", "after the end"},
};
using QueueFates = FateCounts<kQueueFates>;

/// Counts of one camera's events before the mapping, in live operation: received = held + queued +
/// taken + the sum of the fates.
struct QueueCounts {
  std::uint64_t received = 0;
  std::uint64_t held = 0;  ///< Waiting for the end of their 10 ms, or until their time is certain.
  std::uint64_t queued = 0;
  std::uint64_t taken = 0;  ///< Taken by the mapping: `EventCounts::read`, or `rejected_events`.
  /// Part of `taken`: rejected, or lost by fate. Not counted for a camera that takes no part.
  std::uint64_t lost = 0;
  QueueFates fates;

  /// Returns the number of events that are lost in the queue or in the mapping.
  std::uint64_t losses() const { return fates.losses() + lost; }
};

/// Returns "3 windows dropped: 2 for overload, 1 without poses".
std::string asText(const DroppedWindows& windows);

struct LiveStatus {
  std::map<int, QueueCounts> cameras;
  std::uint64_t late_events = 0;   ///< Rejected: over 10 ms older than their camera's newest one.
  std::uint64_t pose_jumps = 0;    ///< Tracker jumps; each begins a new segment of poses.
  std::uint64_t clock_resets = 0;  ///< Clock resets; each starts the mapping again.
  /// Rejected poses: over a second older than the newest one; with a time or place far from the
  /// poses before and after; not valid; or after the end.
  std::uint64_t rejected_poses = 0;
  std::uint64_t errors = 0;  ///< Errors of the mapping and callbacks; see `RefinementState`, too.
  std::string last_error;    ///< Last error, also of rejected samples; empty: none.
  std::string too_large;     ///< Reason why the queue cannot hold a window; empty: it can.

  /// Returns the fraction of the received events that are lost (`FateRow::is_loss`), 0 to 1.
  double dropRatio() const;
};

/// Input of a session and its results so far.
struct SessionStatus {
  MapperCounts counts;  ///< Complete after `finish`.
  StageTimes times;     ///< Stages within the session; the caller fills in the others.
  /// Events of rejected packets in live operation, by camera. In playback a rejection is an error.
  std::map<int, std::uint64_t> rejected_events;
  /// Events that came while map updating was disabled, in playback, by camera.
  std::map<int, std::uint64_t> paused_events;
  std::uint64_t held_events = 0;  ///< Events that windows may still need.
  std::optional<TimeSpan> events;
  std::optional<TimeSpan> poses;
  std::optional<PoseSourceId> pose_source;            ///< The source whose poses are used.
  std::map<PoseSourceId, std::uint64_t> other_poses;  ///< Unused poses of other sources.
  std::vector<std::uint64_t> silent_keyframes;        ///< Keyframes without events, per camera.
  Rig rig;                           ///< The cameras so far, with the options' overrides.
  std::vector<ChosenOption> chosen;  ///< Automatic options, with their reasons.
  std::uint64_t choices = 0;         ///< Number of times that options were chosen.
  bool scene_unknown = false;        ///< True if the last choice found no scene: it is a guess.
  /// Playback with automatic options: the poses do not explain the events of the first look.
  std::vector<Warning> pose_warnings;
  std::vector<Warning> pose_notes;  ///< What the first look could not check.
  /// How good the map so far is. Until the last keyframe it may lack up to a twentieth of them.
  MapQuality quality;
  std::optional<RefinementState> refinement;  ///< Set if poses are refined.
  std::optional<LiveStatus> live{};           ///< In live operation (a session sets it always).
};

/// Returns the automatic options and their reasons, for a log.
std::string choiceText(const SessionStatus& status);

}  // namespace efm
