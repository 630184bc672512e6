// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "mapping/geometry/camera.h"
#include "mapping/geometry/rigid3.h"

namespace efm {

/// One camera of the rig. In imported recordings the rig's frame is that of camera 0.
struct RigCamera {
  CameraModel model;
  Rigid3 T_rig_cam;                 ///< Extrinsic calibration.
  std::int64_t time_offset_ns = 0;  ///< Added to the camera's stamps: t = t_event + offset.

  /// @throws std::invalid_argument naming the value and what was expected: a valid model, finite
  /// extrinsics with a unit quaternion, an offset that no event's time overflows with.
  void validate() const;
};

/// Whether both have the same lens, pose on the rig and clock, to the last bit.
inline bool isSame(const RigCamera& a, const RigCamera& b) {
  return a.model == b.model && isSame(a.T_rig_cam, b.T_rig_cam) &&
         a.time_offset_ns == b.time_offset_ns;
}

/// Calibrated and synchronised cameras, rigidly attached to each other.
struct Rig {
  std::vector<RigCamera> cameras;
};

/// Whether a camera is one of those that are chosen by their indices; empty: all are.
bool isSelected(int camera, const std::vector<int>& selection);
/// The indices of the cameras that are chosen, in the order of the selection; empty: all of the
/// rig.
std::vector<int> selectedCameras(const Rig& rig, const std::vector<int>& selection);

}  // namespace efm
