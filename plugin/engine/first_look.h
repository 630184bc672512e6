// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "mapping/base/text.h"
#include "mapping/survey/option_choice.h"
#include "mapping/survey/scene_depths.h"
#include "plugin/recordings/streams/sample.h"
#include "plugin/session/choice.h"
#include "plugin/session/event_fusion_options.h"
#include "plugin/session/pose_source_selector.h"
#include "plugin/session/session_status.h"

namespace efm {

/// Chooses the automatic options, and judges whether the poses explain the events and how much the
/// depths depend on the poses, if the options have checks. Where they show that the calibration is
/// wrong, the motion is not corrected. Errors are left to the pass that maps.
Chosen chooseAndJudge(const RecordingSurvey& survey, const EventFusionOptions& options);

/// First pass over a recording: takes some of its windows, evenly spread, without mapping them.
/// Memory does not grow with the recording's length: above a million events per second and camera,
/// events are subsampled evenly.
class FirstLook {
 public:
  explicit FirstLook(const EventFusionOptions& options);

  /// Adds all cameras, before the first events. @return false if a MappingSession rejects them.
  bool take(const Rig& rig);
  /// @throws std::exception if a MappingSession rejects the input, too.
  void addEvents(const EventPacket& packet);
  void addPose(const PoseSample& pose);
  /// Adds a sample, unless a MappingSession rejects it or rejected an earlier one.
  /// @return true if all samples so far were added.
  bool take(const Sample& sample);
  std::uint64_t receivedEvents() const { return received_; }
  /// Returns the result. Call it once: after the last data, or after an error.
  RecordingSurvey finish();

 private:
  void addPeriods(int camera, std::int64_t complete_ns);
  void usePoses(const std::vector<StampedPose>& poses);
  void takeWindows();
  void keep(const WindowData& data);

  EventFusionOptions options_;
  /// The events of a camera whose period may not be complete.
  struct Waiting {
    std::vector<Event> events;
    std::int64_t newest_ns = -kEndOfTimeNs;
  };
  std::map<int, Waiting> waiting_;  // by camera
  PoseSourceSelector pose_source_;
  FusionMapper mapper_;
  SpreadSamples samples_;
  std::optional<TimeSpan> begins_;          // of the packets
  std::optional<TimeSpan> events_, poses_;  // of the data that the mapper took
  bool takes_ = true;
  std::uint64_t received_ = 0;
  double lever_m_ = 0;
  double most_events_per_s_ = 0;  // of the subsampled events
};

}  // namespace efm
