// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mapping/depth/depth_map.h"
#include "mapping/events/event_fate.h"
#include "mapping/events/window.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/motion/motion_correction.h"

namespace efm {

/// A keyframe's depth map from one camera alone, in the keyframe's view.
struct CameraDepthMap {
  int camera = 0;  ///< Index in the rig.
  DepthMap map;
};

/// One camera's events of a window, counted per pixel of its sensor.
struct EventImage {
  int camera = 0;              ///< Index in the rig.
  cv::Mat_<cv::Vec2i> counts;  ///< Per raw pixel: negative, positive events.
};

/// Counts events per pixel. All lie inside the sensor: `KeyframeMapper` rejects other events.
EventImage eventImageOf(const CameraEvents& camera);

/// Returns the reference camera's events as an image that fits on the depth map: undistorted, and
/// only the events nearest to the reference time. One event per 8 pixels draws sharp edges; all
/// events of a window would blur the edges by its motion. Events outside the view are left out.
/// @param camera the reference camera of `view`.
/// @return per pixel of the view, the numbers of negative and positive events.
cv::Mat_<cv::Vec2i> viewEventsOf(const CameraEvents& camera, const ReferenceView& view,
                                 std::int64_t t_ref_ns);

/// The depth map of one window of events.
struct KeyframeDepthMap {
  Window window;
  Rigid3 T_world_ref;  ///< Pose of the reference view; a map builder refines it by option.
  Rigid3 T_odom_ref;   ///< The same by the tracker.
  Rigid3 T_rig_ref;    ///< The same, on the rig.
  ReferenceView view;
  DepthPlanesOptions planes;  ///< The keyframe was made with them.
  DepthMap map;
  /// The parallax of a unit of inverse depth, pixels per 1/m: see `ViewMotion`.
  double parallax_px_m = 0;
  double max_confidence = 0;  ///< Maximum over all pixels, with depth or without.
  /// Correction of the tracker's motion in the window, if one was found.
  std::optional<MotionCorrection> motion_correction;
  /// By how much the poses blur the events, pixels; std::nullopt: not looked at, or not known.
  std::optional<double> blur_px;
  double sharpness_gain = 1;            ///< By the correction.
  BlurWatch blur_watch;                 ///< After this window.
  std::optional<PoseNoise> pose_noise;  ///< What the tracker states for the pose.
  /// It was made after the run was stopped: the rest of the input may make another one.
  bool after_stop = false;
  std::string kernel;  ///< The kernel that made it: kernels may round differently.

  /// Events that voted, per camera of the rig (0: not selected).
  std::vector<std::uint64_t> events;
  std::uint64_t without_pose = 0;   ///< Events of the window that had no pose.
  std::uint64_t outside_lens = 0;   ///< Events whose pixel has no viewing ray.
  std::uint64_t over_budget = 0;    ///< Events of the window that were not chosen.
  VoteCounts votes;                 ///< Summed over cameras.
  std::vector<int> silent_cameras;  ///< Selected cameras without an event that voted.
  /// Sub-intervals (of all time slices) without a voting event, summed over cameras with votes.
  std::uint64_t silent_subintervals = 0;

  std::vector<CameraDepthMap> camera_maps;  ///< One per fused camera, if the options ask for them.
  std::vector<EventImage> event_images;     ///< One per selected camera, if asked for.
  /// `viewEventsOf` the reference camera. Empty if not asked for, or if the camera is not selected.
  cv::Mat_<cv::Vec2i> view_events;
};

}  // namespace efm
