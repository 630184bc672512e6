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
  /// How far sharing a pose may move an event's vote, in pixels of the reference view. 0 gives
  /// every event its own pose. Range: 0 to 10. The default keeps the L1 error of the DSI near 2e-3
  /// of its mass.
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

/// What a packet's error is measured against.
struct PacketGeometry {
  Rigid3 T_ref_world;
  ReferenceView view;
  double nearest_depth_m = 0;
  double farthest_depth_m = 0;
};

/// Splits events (time order, already shifted by the camera's time offset) into packets. A packet
/// ends where its pose, taken at the middle of its time, would misplace a vote by more than the
/// bound; no event is dropped because a packet is not full.
///
/// The error is measured on a grid of viewing rays over the whole sensor, at both ends of the
/// packet, on the nearest and on the farthest plane: a camera that turns around a near point moves
/// nothing there and everything behind it. Within a stretch of even motion it follows from how fast
/// votes move there, to a percent and rather too large. Packets do not cross a recorded pose, so
/// that the motion within one is a single smooth piece and its ends are its extremes. Rays that end
/// far outside the view are left out where others do not.
PosePackets splitIntoPosePackets(EventSpan events, const RigCamera& camera,
                                 const UndistortionTable& undistortion,
                                 const Trajectory& trajectory, const PacketGeometry& geometry,
                                 const PosePacketsOptions& options);

}  // namespace efm
