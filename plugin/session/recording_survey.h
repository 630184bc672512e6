// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mapping/base/text.h"
#include "mapping/survey/scene_depths.h"
#include "plugin/session/mapping_session.h"

namespace efm {

/// What a first look says of the poses.
struct PoseVerdict {
  std::vector<Warning> warnings;
  std::vector<std::string> doubts;  ///< Why a map rests on little evidence.
};

/// Events per second of all cameras together.
double eventRate(const WindowData& data);

/// What a first pass over a recording found: its cameras and some of its windows, evenly spread.
struct RecordingSurvey {
  Rig rig;
  std::vector<WindowSample> samples;
  /// The time from the first to the last event with a pose; nothing without such events.
  std::optional<double> duration_s;
  /// In the window with the most, of all cameras together.
  double most_events_per_s = 0;
  double lever_m = 0;  ///< The longest one from the tracked body to the rig.

  /// Whether the poses explain the events, and how much depends on them. An error is left to the
  /// pass that maps.
  /// @param options with the window of the map.
  PoseVerdict judgePoses(const FusionMapperOptions& options) const;
};

/// Surveys a recording in one pass, from the same calls as a MappingSession. Memory does not grow
/// with its length: of more than a million events per second and camera, some are chosen evenly.
class RecordingSurveyor {
 public:
  explicit RecordingSurveyor(const EventFusionOptions& options);

  /// @throws std::exception where a MappingSession does; then nothing more may be added.
  void add(const Sample& sample);
  void addEvents(const EventPacket& packet);
  /// @param T_body_rig that the pose was made with.
  void addPose(const StampedPose& pose, const PoseSourceId& source, const Rigid3& T_body_rig);
  /// Once: after the last data, or after an error.
  RecordingSurvey finish();

 private:
  void takeWindows();
  void take(const WindowData& data);

  MappingSession session_;
  SpreadSamples samples_;
  std::uint64_t received_ = 0;
  double lever_m_ = 0;
  double most_events_per_s_ = 0;  // of those that were chosen
};

}  // namespace efm
