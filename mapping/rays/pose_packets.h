// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/geometry/camera.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/geometry/undistortion.h"

namespace efm {

struct PosePacketsOptions {
  /// The maximum error of a vote because its event shares a pose, in pixels of the reference view.
  /// 0 gives every event its own pose. Range: 0 to 10. The default keeps the L1 error of the DSI
  /// near 2e-3 of its mass. A larger value saves at most 3 % of a keyframe's processor time: on the
  /// simulated scenes 0.25 has the same depth errors, but on the real slider the paper's extraction
  /// has 23.5 instead of 22.7 % wrong points already with 0.05.
  double packet_error_px = 0.02;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// Consecutive events that share one pose.
struct PosePacket {
  std::size_t begin = 0;  ///< Index of the first event.
  std::size_t end = 0;    ///< One past the index of the last event.
  Rigid3 T_ref_cam;       ///< Pose of the event camera in the reference view.
};

/// The packets of one camera's events, in time order. Events between the packets have no pose.
struct PosePackets {
  std::vector<PosePacket> packets;
  std::uint64_t without_pose = 0;
};

/// The reference view and the depth range that a packet's error is measured on.
struct PacketGeometry {
  Rigid3 T_ref_world;
  ReferenceView view;
  double nearest_depth_m = 0;
  double farthest_depth_m = 0;
};

/// Splits events (time order, already shifted by the camera's time offset) into packets. A packet
/// has the pose at the middle of its time; it ends where that pose would misplace a vote by more
/// than the bound. No event is dropped because a packet is not full.
///
/// The error is measured on a grid of rays over the whole sensor, at both ends of the packet, on
/// the nearest and the farthest plane: a camera that rotates around a near point moves votes only
/// on the planes behind it. In an interval of even motion the error is computed from the speed of
/// the votes; this is exact to one percent, and more often too large than too small. A packet does
/// not cross a recorded pose: the motion within it is one smooth piece, with its extremes at the
/// ends. Rays far outside the view count only if no ray is near the view.
PosePackets splitIntoPosePackets(EventSpan events, const RigCamera& camera,
                                 const UndistortionTable& undistortion,
                                 const Trajectory& trajectory, const PacketGeometry& geometry,
                                 const PosePacketsOptions& options);

}  // namespace efm
