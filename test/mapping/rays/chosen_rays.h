// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mapping/geometry/reference_view.h"
#include "mapping/rays/rays.h"

namespace efm::test {

/// Where the rays of a packet come from, and the plane on which a test chooses where they are.
struct RaySource {
  Eigen::Vector3d center_ref = Eigen::Vector3d::Zero();
  bool forward = true;
  double depth_m = 1;
};

/// Appends a packet of rays that meet the source's plane at the points, in pixels of the view.
inline void appendPacket(const RaySource& source, const ReferenceView& view,
                         const std::vector<Eigen::Vector2d>& points, RayBundle& bundle) {
  const RayPacket packet{bundle.size(), bundle.size() + points.size(), source.center_ref,
                         source.forward};
  const PlaneTransfer transfer = transferToPlane(packet, view, source.depth_m);
  for (const Eigen::Vector2d& point : points) {
    bundle.x_inf.push_back(static_cast<float>((point.x() - transfer.offset_x) / transfer.scale));
    bundle.y_inf.push_back(static_cast<float>((point.y() - transfer.offset_y) / transfer.scale));
  }
  bundle.packets.push_back(packet);
}

/// Rays from the view's own centre: at the same pixels on every plane, and exactly there.
inline RayBundle raysFromOrigin(const std::vector<Eigen::Vector2d>& points) {
  RayBundle bundle;
  appendPacket({}, ReferenceView{1, 1, 1, 1, 0, 0}, points, bundle);
  return bundle;
}

}  // namespace efm::test
