// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "mapping/geometry/rig.h"
#include "mapping/keyframes/fusion_mapper.h"
#include "mapping/survey/option_choice.h"
#include "plugin/session/map_refinement.h"
#include "plugin/session/pose_source_selector.h"
#include "plugin/session/stage_timer.h"

namespace efm {

/// First and last time of a stream, on the trajectory's clock.
struct TimeSpan {
  std::int64_t first_ns = 0;
  std::int64_t last_ns = 0;
};

/// What became of one camera's events before the mapping, in live operation:
/// received = thinned + held + queued + dropped + paused + refused + after_end + taken.
struct QueueCounts {
  std::uint64_t received = 0;
  std::uint64_t thinned = 0;  ///< By the budget in sensor time.
  std::uint64_t held = 0;     ///< Until the end of their 10 ms, or the next event confirms them.
  std::uint64_t queued = 0;
  std::uint64_t dropped = 0;  ///< The queue was full.
  std::uint64_t paused = 0;   ///< Map updating was disabled.
  /// In a packet that contradicts its camera, or over a second ahead of those before and after.
  std::uint64_t refused = 0;
  std::uint64_t after_end = 0;  ///< Came after the end.
  std::uint64_t taken = 0;      ///< By the mapping: `EventCounts::read`, or `refused_events`.
  /// Of those taken: refused, dropped or without a pose. Not counted for a camera that takes no
  /// part.
  std::uint64_t lost = 0;
};

/// "3 windows given up: 2 for overload, 1 without poses".
std::string asText(const WindowsGivenUp& windows);

struct LiveStatus {
  std::map<int, QueueCounts> cameras;
  std::uint64_t pose_jumps = 0;   ///< New stretches of poses.
  std::uint64_t clock_steps = 0;  ///< The clock went back, and the mapping started anew.
  /// Over a second older than the newest, or ahead of those before and after; not valid; after the
  /// end.
  std::uint64_t refused_poses = 0;
  std::uint64_t errors = 0;  ///< Of the mapping and callbacks; see `RefinementState`, too.
  std::string last_error;    ///< Of these and of refused observations; empty: none.
  std::string too_large;     ///< Why the queue holds no window; empty: it does.
  bool failing = false;      ///< The last keyframe could not be made.

  /// The part of the received events that is lost, 0 to 1: thinned, dropped, refused, after the
  /// end, without a pose, or in windows that were given up. Events that the options leave out, and
  /// those that came while map updating was disabled, are not lost.
  double dropRatio() const;
};

/// The input of a session and its work so far.
struct SessionStatus {
  MapperCounts counts;  ///< Complete after `finish`.
  StageTimes times;     ///< Of the stages within the session; the caller fills in the rest.
  /// Live operation: events of packets that were refused, by camera. In playback an error.
  std::map<int, std::uint64_t> refused_events;
  /// Playback: events that came while map updating was disabled, by camera.
  std::map<int, std::uint64_t> paused_events;
  std::optional<TimeSpan> events;
  std::optional<TimeSpan> poses;
  std::optional<PoseSourceId> pose_source;            ///< The source whose poses are used.
  std::map<PoseSourceId, std::uint64_t> other_poses;  ///< Poses of other sources: not used.
  std::vector<std::uint64_t> silent_keyframes;        ///< Per camera: keyframes without its events.
  Rig rig;                                    ///< The cameras so far, with the options' overrides.
  std::size_t recalibrated_cameras = 0;       ///< Cameras whose recorded calibration differs.
  std::vector<ChosenOption> chosen;           ///< Automatic options, and from what.
  std::uint64_t choices = 0;                  ///< How often they were chosen.
  bool scene_unknown = false;                 ///< The last choice found no scene: it is a guess.
  std::optional<RefinementState> refinement;  ///< Where poses are refined.
  std::optional<LiveStatus> live{};           ///< In live operation.
};

/// The automatic options and why, for a log.
std::string choiceText(const SessionStatus& status);

}  // namespace efm
