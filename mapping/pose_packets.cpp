// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/pose_packets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "mapping/option_check.h"

namespace efm {
namespace {

constexpr std::size_t kGridSide = 3;

/// Viewing rays spread over the sensor, corners included.
std::array<Eigen::Vector3d, kGridSide * kGridSide> gridRays(const UndistortionTable& table) {
  std::array<Eigen::Vector3d, kGridSide * kGridSide> rays;
  const auto spread = [](std::size_t i, int side) {
    return static_cast<int>(i) * (side - 1) / static_cast<int>(kGridSide - 1);
  };
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const int x = spread(i % kGridSide, table.width());
    const int y = spread(i / kGridSide, table.height());
    rays[i] = table.ray(x, y).homogeneous();
  }
  return rays;
}

class PacketSplitter {
 public:
  PacketSplitter(EventSpan events, const RigCamera& camera, const UndistortionTable& undistortion,
                 const PacketGeometry& geometry, double error_px)
      : events_(events),
        T_rig_cam_(camera.T_rig_cam),
        rays_(gridRays(undistortion)),
        geometry_(geometry),
        error_px_(error_px) {}

  /// Splits events [begin, end), which lie in one segment, at the middle of their time until each
  /// part is good enough.
  void split(const TrajectorySegment& segment, std::size_t begin, std::size_t end,
             std::vector<PosePacket>& packets) const {
    const std::int64_t first_ns = events_[begin].t_ns;
    const std::int64_t last_ns = events_[end - 1].t_ns;
    const std::int64_t middle_ns = first_ns + (last_ns - first_ns) / 2;
    const Rigid3 T_ref_cam = pose(segment, middle_ns);
    if (first_ns == last_ns || (error(T_ref_cam, pose(segment, first_ns)) <= error_px_ &&
                                error(T_ref_cam, pose(segment, last_ns)) <= error_px_)) {
      packets.push_back({begin, end, T_ref_cam});
      return;
    }
    const Event* middle =
        std::upper_bound(events_.begin() + begin, events_.begin() + end, middle_ns,
                         [](std::int64_t t_ns, const Event& event) { return t_ns < event.t_ns; });
    const auto second_half = static_cast<std::size_t>(middle - events_.begin());
    split(segment, begin, second_half, packets);
    split(segment, second_half, end, packets);
  }

 private:
  Rigid3 pose(const TrajectorySegment& segment, std::int64_t t_ns) const {
    return geometry_.T_ref_world * segment.poseAt(t_ns) * T_rig_cam_;
  }

  /// Where a ray of frame `cam` meets the plane, in pixels; nothing where that is behind the
  /// camera.
  std::optional<Eigen::Vector2d> meet(const Rigid3& T_ref_cam, const Eigen::Vector3d& ray,
                                      double depth_m) const {
    const Eigen::Vector3d direction = T_ref_cam.rotation * ray;
    const double along = (depth_m - T_ref_cam.translation.z()) / direction.z();
    if (!(along > 0) || !std::isfinite(along)) return std::nullopt;
    return geometry_.view.project(T_ref_cam.translation + along * direction);
  }

  /// Inside the view or at most its own size away from it.
  bool isNearView(const Eigen::Vector2d& pixel) const {
    const ReferenceView& view = geometry_.view;
    return pixel.x() >= -view.width && pixel.x() <= 2 * view.width && pixel.y() >= -view.height &&
           pixel.y() <= 2 * view.height;
  }

  /// The largest distance between the votes of two poses, in pixels.
  double error(const Rigid3& T_ref_cam0, const Rigid3& T_ref_cam1) const {
    double near_view = 0;
    double anywhere = 0;
    bool any_near_view = false;
    for (const double depth_m : {geometry_.nearest_depth_m, geometry_.farthest_depth_m}) {
      for (const Eigen::Vector3d& ray : rays_) {
        const auto pixel0 = meet(T_ref_cam0, ray, depth_m);
        const auto pixel1 = meet(T_ref_cam1, ray, depth_m);
        if (pixel0.has_value() != pixel1.has_value()) {
          return std::numeric_limits<double>::infinity();
        }
        if (!pixel0) continue;
        const double distance = (*pixel0 - *pixel1).norm();
        anywhere = std::max(anywhere, distance);
        if (!isNearView(*pixel0)) continue;
        near_view = std::max(near_view, distance);
        any_near_view = true;
      }
    }
    return any_near_view ? near_view : anywhere;
  }

  EventSpan events_;
  Rigid3 T_rig_cam_;
  std::array<Eigen::Vector3d, kGridSide * kGridSide> rays_;
  PacketGeometry geometry_;
  double error_px_;
};

}  // namespace

void PosePacketsOptions::validate() const {
  requireOption(packet_error_px >= 0 && packet_error_px <= 10, "packet_error_px", packet_error_px,
                "0 to 10");
}

PosePackets splitIntoPosePackets(EventSpan events, const RigCamera& camera,
                                 const UndistortionTable& undistortion,
                                 const Trajectory& trajectory, const PacketGeometry& geometry,
                                 const PosePacketsOptions& options) {
  const PacketSplitter splitter(events, camera, undistortion, geometry, options.packet_error_px);
  PosePackets result;
  std::size_t cursor = 0;
  std::size_t begin = 0;
  while (begin < events.size()) {
    const auto segment = trajectory.segmentAt(events[begin].t_ns, cursor);
    if (!segment) {
      ++result.without_pose;
      ++begin;
      continue;
    }
    // At its end a segment gives way to the next one, except where the poses end.
    const std::int64_t last_ns = segment->last.t_ns;
    std::size_t end = begin + 1;
    while (end < events.size() &&
           (events[end].t_ns < last_ns || events[end].t_ns == events[begin].t_ns)) {
      ++end;
    }
    splitter.split(*segment, begin, end, result.packets);
    begin = end;
  }
  return result;
}

}  // namespace efm
