// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mapping/base/text.h"
#include "mapping/survey/scene_depths.h"
#include "plugin/session/event_fusion_options.h"
#include "plugin/session/pose_source_selector.h"
#include "plugin/session/rig_assembly.h"
#include "plugin/session/sample.h"
#include "plugin/session/session_status.h"

namespace efm {

/// What a first look says of the poses.
struct PoseVerdict {
  std::vector<Warning> warnings;
  std::vector<std::string> doubts;  ///< Why a map rests on little evidence.
};

/// Events per second of all cameras together.
double eventRate(const WindowData& data);

/// What a first look at a recording found: its cameras and some of its windows, evenly spread.
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

/// A first pass over a recording: takes some of its windows, evenly spread, without mapping them.
/// Memory does not grow with the recording's length: of more than a million events per second and
/// camera, some are chosen evenly.
class FirstLook {
 public:
  explicit FirstLook(const EventFusionOptions& options);

  /// @throws std::exception for a sample that a MappingSession rejects, too.
  void addEvents(const EventPacket& packet);
  void addPose(const PoseSample& pose);
  /// Adds a sample, unless a MappingSession rejects it or rejected an earlier one.
  /// @return whether all samples so far were added.
  bool take(const Sample& sample);
  /// To be called once: after the last data, or after an error.
  RecordingSurvey finish();

 private:
  void feed(EventPacket packet);
  void usePoses(const std::vector<StampedPose>& poses);
  void completeRig();
  void takeWindows();
  void keep(const WindowData& data);

  RigAssembly rig_;
  PoseSourceSelector pose_source_;
  FusionMapper mapper_;
  SpreadSamples samples_;
  std::optional<TimeSpan> events_, poses_;  // that the mapper took
  bool takes_ = true;
  std::uint64_t received_ = 0;
  double lever_m_ = 0;
  double most_events_per_s_ = 0;  // of those that were chosen
};

}  // namespace efm
