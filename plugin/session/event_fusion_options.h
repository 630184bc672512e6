// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "mapping/base/option.h"
#include "mapping/keyframes/fusion_mapper.h"
#include "mapping/survey/option_choice.h"
#include "maps/cloud/global_cloud.h"
#include "plugin/recordings/streams/recording_parts.h"
#include "plugin/session/map_refinement.h"

namespace efm {

/// Options of the rig that replace the recording's own.
struct RigOptions {
  std::filesystem::path calibration;          ///< Empty: from the recording.
  std::filesystem::path hand_eye;             ///< Empty: from the recording.
  std::vector<std::int64_t> time_offsets_ns;  ///< One per camera; empty: none.
  std::string pose_source;  ///< The label of the source's sensor; empty: the best source.
};

/// Live operation: mapping in a thread of its own beside a sensor that does not wait.
struct LiveOptions {
  /// false: playback. Each observation is mapped before the next one is taken, and the same
  /// observations make the same map.
  bool enabled = false;
  /// Highest event rate of a camera, events per second of sensor time; more are subsampled evenly.
  /// 0: no limit. Depends on the events only: the same input gives the same map on any machine.
  double max_event_rate = 1'000'000;
  /// Limits of the input that waits for the mapping: events of all cameras, and their memory. If
  /// one limit is exceeded, the oldest windows are dropped. At least 1000 events, 1 MB.
  std::int64_t max_queue_events = 5'000'000;
  double max_queue_mb = 256;
  /// Longest time that events wait for poses. Seconds, above 0, at most 3600.
  double max_pose_wait_s = 2;
  /// Number of newest keyframes that keep their own clouds, for MRPT's simplemaps and for the
  /// refinement to move. At least 1. The points of all keyframes stay in the map.
  int max_keyframes = 1000;
  /// Largest plausible speeds of the tracker, above 0. A faster step (after subtracting 5 sigma of
  /// its stated noise) is a tracker jump: no window uses poses from both sides of it.
  double max_speed_m_s = 50;
  double max_turn_deg_s = 1500;

  /// Returns the number of events that may wait, by both limits.
  double queueEvents() const;
  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("enabled", self.enabled);
    visit("max_event_rate", self.max_event_rate,
          Allowed::from(1000, 1e10, "0 (no limit), or 1000 to 1e10").orZero());
    visit("max_queue_events", self.max_queue_events, Allowed::atLeast(1000, "1000 or above"));
    visit("max_queue_mb", self.max_queue_mb, Allowed::from(1, 1e6, "1 to 1e6"));
    visit("max_pose_wait_s", self.max_pose_wait_s,
          Allowed::above(0, 3600, "above 0, at most 3600"));
    visit("max_keyframes", self.max_keyframes, Allowed::atLeast(1, "1 or above"));
    visit("max_speed_m_s", self.max_speed_m_s, Allowed::above(0, "above 0"));
    visit("max_turn_deg_s", self.max_turn_deg_s, Allowed::above(0, "above 0"));
  }
  void validate() const { requireFields(*this); }
};

/// Shortens an automatic window, and an automatic stride with it.
/// @param reason why windows are at most `max_s` long.
void limitWindow(double max_s, const std::string& reason, KeyframePolicyOptions& policy,
                 std::vector<ChosenOption>& chosen);
/// Shortens an automatic window until its events fill at most half of the queue of live operation.
/// The other half is for the events that arrive while the window is mapped.
/// @param events_per_s rate of all cameras together.
void fitIntoQueue(const LiveOptions& live, double events_per_s, KeyframePolicyOptions& policy,
                  std::vector<ChosenOption>& chosen);

/// All options of an option file.
struct EventFusionOptions {
  FusionMapperOptions mapper;
  /// The options of the mapper that are chosen from the data.
  AutomaticOptions automatic;
  /// True if the cloud of a keyframe is the concatenation of its single cameras' clouds: the naive
  /// baseline (Ghosh and Gallego 2022, Sec. 3.3.1). Depth maps stay fused.
  bool late_fusion = false;
  GlobalCloudOptions cloud;
  MapRefinementOptions refinement;
  RigOptions rig;
  LiveOptions live;
  bool checks =
      true;  ///< Judge poses, cameras and the map; data that are not used are told always.
  /// Keyframes whose predicted fraction of right depths is lower are left out of the map. 0 to 1.
  double min_keyframe_quality = 0;
  bool ply = false;     ///< `map` also writes map.ply, coloured by height.
  bool session = true;  ///< All keyframes are stored in a session file as they are made.
  /// The session file of a Mapper or a map builder. Empty: none. `map` has its own.
  std::filesystem::path session_file;

  /// Return the number of newest keyframes whose points are kept, and that the refinement may move.
  std::size_t keptKeyframes() const;
  std::size_t movableKeyframes() const { return refinement.enabled ? keptKeyframes() : 0; }
  void validate() const;
};

/// Length and stride of windows in live operation until the automatic options are chosen. They are
/// chosen from the first window.
inline constexpr double kFirstWindowS = 1;
inline constexpr double kFirstStrideS = 0.1;

/// Returns whether the recording has the camera's calibration. Without it, the focal length is 0.
bool isCalibrated(const CameraModel& model);

/// @throws std::invalid_argument naming the camera, if it has no calibration.
void requireCalibrated(int camera, const CameraModel& model);
/// @throws std::invalid_argument if a camera has no calibration, or the options name a camera that
/// the rig does not have.
void requireMappable(const Rig& rig, const EventFusionOptions& options);

/// Returns the mapper's options, adapted to live operation and late fusion.
FusionMapperOptions mapperOptions(const EventFusionOptions& options);

/// Returns the default options of programs: each option that can be automatic is automatic.
inline EventFusionOptions defaultOptions() {
  EventFusionOptions options;
  options.automatic = {true, true, true, true, true, false};
  options.mapper.keyframe.motion.correct_motion = MotionCorrectionUse::kAuto;
  return options;
}

}  // namespace efm
