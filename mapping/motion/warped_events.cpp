// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/motion/warped_events.h"

#include <cmath>
#include <limits>
#include <optional>

#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

/// The rays of one event camera at one time, in the reference view.
class EventRays {
 public:
  EventRays(const Rigid3& T_ref_rig, const Rigid3& T_rig_cam, const WarpTarget& target)
      : R_ref_rig_(T_ref_rig.rotation.toRotationMatrix()),
        T_ref_rig_(T_ref_rig),
        T_rig_cam_(T_rig_cam),
        target_(target) {}

  /// @param since_s from the reference time to the event.
  std::optional<WarpedEvent> warp(const Eigen::Vector2d& ray_cam, double since_s) const {
    const Eigen::Vector3d ray_rig = T_rig_cam_.rotation * ray_cam.homogeneous();
    const Eigen::Vector3d center_ref = T_ref_rig_ * T_rig_cam_.translation;
    const Eigen::Vector3d ray_ref = R_ref_rig_ * ray_rig;
    const std::optional<double> depth_m = depthAlong(center_ref, ray_ref);
    if (!depth_m) return std::nullopt;

    const double length = (*depth_m - center_ref.z()) / ray_ref.z();
    const Eigen::Vector3d p_ref = center_ref + length * ray_ref;
    const Eigen::Vector3d p_rig = T_rig_cam_.translation + length * ray_rig;
    const ReferenceView& view = target_.view;
    // A point fixed to the rig moves by v + w x p_rig; the moved ray then meets the plane again.
    Eigen::Matrix<double, 2, 3> pixel_by_point;
    pixel_by_point << view.fx, 0, -view.fx * ray_ref.x() / ray_ref.z(), 0, view.fy,
        -view.fy * ray_ref.y() / ray_ref.z();
    Eigen::Matrix<double, 3, 6> point_by_velocity;
    point_by_velocity << Eigen::Matrix3d::Identity(), -crossMatrix(p_rig);
    WarpedEvent event;
    event.pixel = view.project(p_ref).cast<float>();
    event.by_velocity =
        (since_s / *depth_m * pixel_by_point * R_ref_rig_ * point_by_velocity).cast<float>();
    event.by_inverse_depth =
        Eigen::Vector2d(view.fx * (center_ref.x() - center_ref.z() * ray_ref.x() / ray_ref.z()),
                        view.fy * (center_ref.y() - center_ref.z() * ray_ref.y() / ray_ref.z()))
            .cast<float>();
    return event;
  }

 private:
  static Eigen::Matrix3d crossMatrix(const Eigen::Vector3d& v) {
    Eigen::Matrix3d cross;
    cross << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return cross;
  }

  /// Depth at which the ray is nearest to a pixel of the same depth, to half a plane.
  std::optional<double> depthAlong(const Eigen::Vector3d& center_ref,
                                   const Eigen::Vector3d& ray_ref) const {
    // The pixel of a ray is linear in inverse depth.
    const ReferenceView& view = target_.view;
    const double right = ray_ref.x() / ray_ref.z();
    const double down = ray_ref.y() / ray_ref.z();
    const auto x_inf = static_cast<float>(view.fx * right + view.cx);
    const auto y_inf = static_cast<float>(view.fy * down + view.cy);
    const auto x_gradient = static_cast<float>(view.fx * (center_ref.x() - center_ref.z() * right));
    const auto y_gradient = static_cast<float>(view.fy * (center_ref.y() - center_ref.z() * down));
    const auto width = static_cast<float>(view.width);
    const auto height = static_cast<float>(view.height);
    float nearest_px = std::numeric_limits<float>::infinity();
    std::optional<double> found_m;
    for (const InversePlane& plane : target_.planes) {
      if ((1 / plane.inverse_depth - center_ref.z()) * ray_ref.z() <= 0) continue;
      const float x = x_inf + plane.inverse_depth * x_gradient + 0.5F;
      const float y = y_inf + plane.inverse_depth * y_gradient + 0.5F;
      if (!(x >= 0 && x < width && y >= 0 && y < height)) continue;
      const cv::Point pixel(static_cast<int>(x), static_cast<int>(y));
      const float inverse_depth = target_.depths->inverseDepth(pixel);
      if (std::abs(inverse_depth - plane.inverse_depth) > plane.half_step) continue;
      const float distance_px = target_.depths->distancePx(pixel);
      if (distance_px >= nearest_px) continue;
      nearest_px = distance_px;
      found_m = 1 / double{inverse_depth};
    }
    return found_m;
  }

  Eigen::Matrix3d R_ref_rig_;
  Rigid3 T_ref_rig_;
  Rigid3 T_rig_cam_;
  const WarpTarget& target_;
};

}  // namespace

std::vector<InversePlane> inversePlanes(const DepthPlanes& planes) {
  std::vector<InversePlane> result;
  result.reserve(static_cast<std::size_t>(planes.size()));
  for (int plane = 0; plane < planes.size(); ++plane) {
    result.push_back({static_cast<float>(1 / planes.depth(plane)),
                      static_cast<float>(0.5 * planes.inverseDepthStepAt(plane))});
  }
  return result;
}

std::vector<WarpedEvent> warpEvents(const CameraEvents& camera, std::size_t every,
                                    const Trajectory& trajectory, const WarpTarget& target) {
  const EventSpan events = camera.events;
  std::vector<WarpedEvent> warped;
  warped.reserve(events.size() / every + 1);
  std::size_t cursor = 0;
  for (std::size_t i = every / 2; i < events.size(); i += every) {
    const Event& event = events[i];
    if (!camera.undistortion->hasRay(event.x, event.y)) continue;
    const auto segment = trajectory.segmentAt(event.t_ns, cursor);
    if (!segment) continue;
    const Rigid3 T_ref_rig = target.T_ref_world * segment->poseAt(event.t_ns);
    const EventRays rays(T_ref_rig, camera.calibration->T_rig_cam, target);
    const auto found = rays.warp(camera.undistortion->ray(event.x, event.y),
                                 secondsBetween(target.t_ref_ns, event.t_ns));
    if (found) warped.push_back(*found);
  }
  return warped;
}

}  // namespace efm
