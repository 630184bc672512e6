// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/undistortion.h"
#include "mapping/rays/pose_packets.h"

namespace efm {

/// Rays from one camera centre: the events of a pose packet that look the same way along the
/// reference view's z axis.
struct RayPacket {
  std::size_t begin = 0;                                 ///< Index of the first ray.
  std::size_t end = 0;                                   ///< One past the index of the last ray.
  Eigen::Vector3d center_ref = Eigen::Vector3d::Zero();  ///< Camera centre C, frame `ref`, metres.
  bool forward = true;                                   ///< The rays run towards larger z.
};

/// Where a packet's rays meet one plane: x = scale * x_inf + offset_x, likewise y.
struct PlaneTransfer {
  double scale = 0;
  double offset_x = 0;
  double offset_y = 0;
  bool in_front = false;  ///< The plane lies before the event camera, along its rays.
};

/// One camera's events carried into the reference view as rays: each by the pixel where it meets
/// the plane at infinity, from which every other plane is a scale and an offset away.
///
/// This is the two-step transfer of Rebecq et al. (IJCV 2018, Eq. 15) with the plane at infinity
/// for Z0, the one choice of Z0 that no camera centre can lie on: x(Z) = (1 - C_z/Z) x_inf + (f C_x
/// + c C_z) / Z in pixels. Rays parallel to the planes get non-finite coordinates and are never
/// inside a view.
struct RayBundle {
  std::vector<float> x_inf;  ///< Pixels of the reference view.
  std::vector<float> y_inf;
  std::vector<RayPacket> packets;

  std::size_t size() const { return x_inf.size(); }
};

/// Carries the events of the packets into the reference view; events between packets are left out.
RayBundle backProject(EventSpan events, const PosePackets& packets,
                      const UndistortionTable& undistortion, const ReferenceView& view);

/// The transfer of a packet's rays to the plane at depth `depth_m`.
PlaneTransfer transferToPlane(const RayPacket& packet, const ReferenceView& view, double depth_m);

}  // namespace efm
