// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "mapping/geometry/reference_view.h"

namespace efm {

/// Rays from one camera centre that all run forward or all run backward along the reference view's
/// z axis: the events of a pose packet.
struct RayPacket {
  std::size_t begin = 0;                                 ///< Index of the first ray.
  std::size_t end = 0;                                   ///< One past the index of the last ray.
  Eigen::Vector3d center_ref = Eigen::Vector3d::Zero();  ///< Camera centre C, frame `ref`, metres.
  bool forward = true;                                   ///< The rays run towards larger z.
};

/// Where a packet's rays meet one plane: x = scale * x_inf + offset_x, likewise y. (x_inf, y_inf)
/// is the pixel where a ray meets the plane at infinity.
struct PlaneTransfer {
  double scale = 0;
  double offset_x = 0;
  double offset_y = 0;
  bool in_front = false;  ///< The plane lies before the event camera, along its rays.
};

/// The transfer of a packet's rays to the plane at depth `depth_m`: the second step of Rebecq et
/// al. (IJCV 2018, Eq. 15) with the plane at infinity as Z0, x(Z) = (1 - C_z/Z) x_inf + (f C_x + c
/// C_z) / Z.
PlaneTransfer transferToPlane(const RayPacket& packet, const ReferenceView& view, double depth_m);

}  // namespace efm
