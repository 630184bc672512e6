// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <limits>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "mapping/keyframes/fusion_mapper.h"
#include "mapping/survey/scene_depths.h"

namespace efm {

/// What is wrong between two cameras.
enum class CameraFault {
  kNone,
  kAcross,       ///< Rotation about the baseline: points move across the epipolar lines.
  kAlong,        ///< Rotation about the axis across baseline and view: along the epipolar lines.
  kRoll,         ///< Rotation about the optical axis.
  kClock,        ///< The camera's clock.
  kFocalLength,  ///< The camera's focal length.
  kUnknown,      ///< The maps differ, but the poses blur them: it is not known what is wrong.
};

/// The map of a camera alone, compared with the map of another camera alone. Wrong poses move both
/// maps alike; a wrong calibration moves one of them.
struct CameraComparison {
  int camera = 0;
  int other = 0;  ///< The reference camera.
  CameraFault fault = CameraFault::kNone;
  bool blurred = false;    ///< True: the poses blur the maps.
  double correlation = 0;  ///< Of the two maps after the fit, at most 1. Right: 0.7 or more.
  // With these changes of the camera's calibration, the two maps fit.
  double angle_rad = 0;  ///< `kAcross`, `kAlong`, `kRoll`: its size.
  Eigen::Quaterniond R_cam_fitted = Eigen::Quaterniond::Identity();  ///< Rotation of the camera.
  double clock_s = 0;  ///< `kClock`: seconds to add to the times of the camera's events.
  double zoom = 1;     ///< `kFocalLength`: factor of the focal length.
  /// Factor of the poses' positions. Not 1: it, and no fault of the camera, explains the maps.
  double scale = 1;
  /// Depths beyond it change by more than 10 % with the rotation along the epipolar lines that the
  /// maps show, reported or not. Metres.
  double sure_depth_m = std::numeric_limits<double>::infinity();
  double shift_px = 0;      ///< Root mean square of the distances between the maps, raw pixels.
  double depth_change = 0;  ///< `kAlong`: of a fused depth, relative, at the median depth.
};

/// Compares the selected cameras with the reference camera, or with the first selected camera if
/// the reference camera is not selected. From at least three windows, in which both cameras see
/// parallax: poses mislead single windows. Measured with exact poses: rotations are right to 0.06
/// degrees, clocks to 1.5 ms.
/// @param options have the depth limits of the map.
/// @return one comparison per camera for which it was possible.
std::vector<CameraComparison> compareCameras(const Rig& rig,
                                             const std::vector<WindowSample>& samples,
                                             const FusionMapperOptions& options);

/// Returns the rig with the calibration that a comparison found; without a clock.
Rig fittedRig(const CameraComparison& found, Rig rig);

/// Returns how many times as sharp the events are with the calibration that a comparison found.
/// @param travel factor of the poses' positions.
double sharpnessGain(const CameraComparison& found, double travel, const Rig& rig,
                     const std::vector<WindowSample>& samples, const FusionMapperOptions& options);

}  // namespace efm
