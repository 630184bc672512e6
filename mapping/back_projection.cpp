// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/back_projection.h"

namespace efm {
namespace {

/// The events of one packet as rays of the reference view.
class PacketProjector {
 public:
  PacketProjector(const PosePacket& packet, const ReferenceView& view)
      : R_ref_cam_(packet.T_ref_cam.rotation.toRotationMatrix()), view_(view) {}

  Eigen::Vector3d direction(const Eigen::Vector2d& ray_cam) const {
    return R_ref_cam_ * ray_cam.homogeneous();
  }

  void append(const Eigen::Vector3d& direction_ref, RayBundle& bundle) const {
    bundle.x_inf.push_back(
        static_cast<float>(view_.fx * direction_ref.x() / direction_ref.z() + view_.cx));
    bundle.y_inf.push_back(
        static_cast<float>(view_.fy * direction_ref.y() / direction_ref.z() + view_.cy));
  }

 private:
  Eigen::Matrix3d R_ref_cam_;
  ReferenceView view_;
};

}  // namespace

RayBundle backProject(EventSpan events, const PosePackets& packets,
                      const UndistortionTable& undistortion, const ReferenceView& view) {
  RayBundle bundle;
  bundle.x_inf.reserve(events.size());
  bundle.y_inf.reserve(events.size());
  std::vector<Eigen::Vector3d> backward;
  for (const PosePacket& packet : packets.packets) {
    const PacketProjector projector(packet, view);
    const auto close_packet = [&](bool forward) {
      const std::size_t begin = bundle.packets.empty() ? 0 : bundle.packets.back().end;
      if (bundle.size() == begin) return;
      bundle.packets.push_back({begin, bundle.size(), packet.T_ref_cam.translation, forward});
    };
    backward.clear();
    for (std::size_t i = packet.begin; i < packet.end; ++i) {
      const Eigen::Vector3d direction_ref =
          projector.direction(undistortion.ray(events[i].x, events[i].y));
      if (direction_ref.z() < 0) {
        backward.push_back(direction_ref);
      } else {
        projector.append(direction_ref, bundle);
      }
    }
    close_packet(true);
    for (const Eigen::Vector3d& direction_ref : backward) projector.append(direction_ref, bundle);
    close_packet(false);
  }
  return bundle;
}

PlaneTransfer transferToPlane(const RayPacket& packet, const ReferenceView& view, double depth_m) {
  const Eigen::Vector3d& center_ref = packet.center_ref;
  const double nearer = center_ref.z() / depth_m;  // C_z / Z
  return {1.0 - nearer, (view.fx * center_ref.x() + view.cx * center_ref.z()) / depth_m,
          (view.fy * center_ref.y() + view.cy * center_ref.z()) / depth_m,
          packet.forward ? nearer < 1.0 : nearer > 1.0};
}

}  // namespace efm
