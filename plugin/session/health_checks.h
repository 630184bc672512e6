// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "mapping/base/text.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rig.h"
#include "mapping/keyframes/keyframe_depth_map.h"
#include "mapping/survey/option_choice.h"
#include "plugin/session/event_fusion_options.h"
#include "plugin/session/recording_statistics.h"
#include "plugin/session/session_status.h"

namespace efm {

/// What is compared with the options of a map; without a map, the defaults serve.
struct HealthLimits {
  double near_depth_m = 0.5;
  double far_depth_m = 5;
  double max_pose_gap_s = 0.25;
};

/// The nearest depth that the motion is compared with, metres: a chosen one may follow from wrong
/// poses.
double motionDepth(const DepthPlanesOptions& planes, const std::vector<ChosenOption>& chosen);

/// Checks the calibration, the clocks, the motion and the events of a recording.
std::vector<Warning> healthWarnings(const RecordingStatistics& recording,
                                    const HealthLimits& limits);

/// What a recording lacks for a map: events, calibration, poses.
std::vector<Warning> missingParts(const RecordingStatistics& recording);
/// @param cameras by their index.
std::vector<Warning> missingParts(const std::map<int, CameraModel>& cameras, bool has_events,
                                  bool has_poses);

/// Counts what became of the pixels of keyframes, and depths near the limits.
class DepthStatistics {
 public:
  /// @param chosen the options that were automatic: their limits are not the user's.
  explicit DepthStatistics(const DepthPlanesOptions& planes, std::vector<ChosenOption> chosen = {})
      : planes_(planes), chosen_(std::move(chosen)) {}

  void add(const KeyframeDepthMap& keyframe);
  std::vector<Warning> warnings() const;
  const PixelCounts& pixels() const { return pixels_; }
  /// Why the depths rest on little evidence; empty where they do not.
  std::vector<std::string> doubts() const;

 private:
  void compareWithLast(const KeyframeDepthMap& keyframe);

  DepthPlanesOptions planes_;
  std::vector<ChosenOption> chosen_;
  PixelCounts pixels_;
  KeyframeDepthMap last_;              // depths, view and pose
  std::uint64_t shared_ = 0;           // points that two keyframes in a row have
  std::uint64_t agreeing_ = 0;         // with the same depth
  std::vector<double> parallaxes_px_;  // of the median depth of each keyframe
  std::uint64_t depths_ = 0;
  std::uint64_t nearest_ = 0;   // near the nearest plane
  std::uint64_t farthest_ = 0;  // near the farthest plane
};

}  // namespace efm
