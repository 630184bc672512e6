// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <vector>

#include "mapping/base/named_choice.h"
#include "mapping/geometry/rigid3.h"

namespace efm {

/// Distortion of the lens. Coefficients are OpenCV's, in OpenCV's order.
enum class DistortionModel {
  kNone,         ///< No coefficients.
  kRadtan,       ///< Brown-Conrady: k1 k2 p1 p2 [k3], 4 or 5 coefficients.
  kEquidistant,  ///< Kannala-Brandt fisheye: k1 k2 k3 k4.
};

template <>
inline constexpr NamedChoice<DistortionModel> kNamesOf<DistortionModel>[] = {
    {DistortionModel::kNone, "none"},
    {DistortionModel::kRadtan, "radtan"},
    {DistortionModel::kEquidistant, "equidistant"},
};

/// Intrinsic calibration of one camera: frame `cam` has x right, y down, z forward; integer pixel
/// coordinates are pixel centres.
struct CameraModel {
  int width = 0;          ///< Pixels, 1 to 65,535.
  int height = 0;         ///< Pixels, 1 to 65,535.
  double fx = 0, fy = 0;  ///< Focal lengths in pixels, above 0.
  double cx = 0, cy = 0;  ///< Principal point in pixels.
  DistortionModel distortion = DistortionModel::kNone;
  std::vector<double> coefficients;

  void validate() const;

  /// Returns the raw (distorted) pixel of a point of frame `cam` with z > 0.
  Eigen::Vector2d project(const Eigen::Vector3d& p_cam) const;

  friend bool operator==(const CameraModel& a, const CameraModel& b);
  friend bool operator!=(const CameraModel& a, const CameraModel& b) { return !(a == b); }
};

/// The part of a sensor that a driver gives: CameraInfo's binning and region of interest, pixels of
/// the whole sensor. 0: no binning; the whole width or height.
struct SensorArea {
  double binning_x = 0, binning_y = 0;
  double x = 0, y = 0, width = 0, height = 0;
};

/// Returns the model of the area's own pixels. @param model of the whole sensor.
/// @throws std::runtime_error for an area that is not in it.
CameraModel cutTo(const SensorArea& area, CameraModel model);

/// One camera of the rig. In imported recordings, frame `rig` is the frame of camera 0.
struct RigCamera {
  CameraModel model;
  Rigid3 T_rig_cam;                 ///< Extrinsic calibration.
  std::int64_t time_offset_ns = 0;  ///< Added to the event's time: t = t_event + offset.

  /// @throws std::invalid_argument naming the value and what was expected: a valid model, finite
  /// extrinsics with a unit quaternion, and an offset with which no event's time overflows.
  void validate() const;
};

/// Returns whether both have the same lens, pose on the rig and time offset, to the last bit.
inline bool isSame(const RigCamera& a, const RigCamera& b) {
  return a.model == b.model && isSame(a.T_rig_cam, b.T_rig_cam) &&
         a.time_offset_ns == b.time_offset_ns;
}

/// Calibrated and synchronised cameras, rigidly attached to each other.
struct Rig {
  std::vector<RigCamera> cameras;
};

/// Returns whether a camera is in the selection. An empty selection has all cameras.
bool isSelected(int camera, const std::vector<int>& selection);
/// Returns the indices of the selected cameras in the order of the selection. An empty selection
/// has all cameras of the rig.
std::vector<int> selectedCameras(const Rig& rig, const std::vector<int>& selection);

}  // namespace efm
