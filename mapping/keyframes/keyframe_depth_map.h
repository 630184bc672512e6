// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "mapping/depth/depth_extraction.h"
#include "mapping/dsi/vote_counts.h"
#include "mapping/events/window.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/motion/velocity_correction.h"

namespace efm {

/// What one camera alone would have seen of a keyframe, in the keyframe's view.
struct CameraDepthMap {
  int camera = 0;  ///< Index in the rig.
  DepthMap map;
};

/// One camera's events of a window, counted where they fired: of the size of its sensor.
struct EventImage {
  int camera = 0;              ///< Index in the rig.
  cv::Mat_<cv::Vec2i> counts;  ///< Per raw pixel: events that became darker, brighter.
};

/// What one window of events became.
struct KeyframeDepthMap {
  Window window;
  Rigid3 T_world_ref;  ///< Pose of the reference view.
  ReferenceView view;
  DepthMap map;
  double largest_confidence = 0;  ///< Of all pixels, kept or not.
  /// By which the tracker's motion in the window was corrected; none where it stood as it was.
  std::optional<VelocityCorrection> motion_correction;

  /// Events that voted, per camera of the rig (0: not selected).
  std::vector<std::uint64_t> events;
  std::uint64_t without_pose = 0;   ///< Events of the window that had no pose.
  VoteCounts votes;                 ///< Summed over cameras.
  std::vector<int> silent_cameras;  ///< Selected, but without an event to vote.
  /// Sub-intervals (of all slices of time) without an event to vote, summed over the cameras that
  /// are not silent.
  std::uint64_t silent_subintervals = 0;

  std::vector<CameraDepthMap> camera_maps;  ///< Of the cameras that were fused, where asked for.
  std::vector<EventImage> event_images;     ///< Of the selected cameras, where asked for.
};

}  // namespace efm
