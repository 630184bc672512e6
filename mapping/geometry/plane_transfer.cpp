// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/plane_transfer.h"

namespace efm {

PlaneTransfer transferToPlane(const RayPacket& packet, const ReferenceView& view, double depth_m) {
  const Eigen::Vector3d& center_ref = packet.center_ref;
  const double nearer = center_ref.z() / depth_m;  // C_z / Z
  return {1.0 - nearer, (view.fx * center_ref.x() + view.cx * center_ref.z()) / depth_m,
          (view.fy * center_ref.y() + view.cy * center_ref.z()) / depth_m,
          packet.forward ? nearer < 1.0 : nearer > 1.0};
}

}  // namespace efm
