// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/motion/event_contrast.h"

#include <tbb/parallel_for.h>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "mapping/geometry/timestamp.h"

namespace efm {

Trajectory correctedTrajectory(const Trajectory& trajectory, const Window& window,
                               const VelocityCorrection& correction) {
  const std::int64_t from_ns = std::min(window.t0_ns, window.t_ref_ns);
  const std::int64_t to_ns = std::max(window.t1_ns, window.t_ref_ns);
  Trajectory corrected = trajectory.moved(from_ns, to_ns, [&](const StampedPose& pose) {
    const double since_s = secondsBetween(window.t_ref_ns, pose.t_ns);
    return pose.T_world_rig * correction.displacement(since_s);
  });
  // Between two moved poses, interpolation misses the tracker's pose by a term of second order.
  corrected.add({window.t_ref_ns, trajectory.poseAt(window.t_ref_ns).value()});
  return corrected;
}

NearestDepths::NearestDepths(const cv::Mat1f& depth, double radius_px)
    : empty_(cv::countNonZero(depth) == 0),
      inverse_(cv::Mat1f::zeros(depth.size())),
      distance_(cv::Mat1f::zeros(depth.size())) {
  if (empty_) return;
  cv::Mat1i nearest;  // label of the nearest pixel that has a depth
  cv::distanceTransform(depth == 0, distance_, nearest, cv::DIST_L2, cv::DIST_MASK_5,
                        cv::DIST_LABEL_PIXEL);
  std::vector<float> inverse_of(depth.total() + 1);
  depth.forEach([&](float metres, const int* at) {
    if (metres > 0) inverse_of[static_cast<std::size_t>(nearest(at[0], at[1]))] = 1 / metres;
  });
  inverse_.forEach([&](float& inverse, const int* at) {
    if (distance_(at[0], at[1]) > radius_px) return;
    inverse = inverse_of[static_cast<std::size_t>(nearest(at[0], at[1]))];
  });
}

namespace {

/// Returns the depth (to half a plane) at which the ray is nearest to a pixel with that depth.
std::optional<double> depthAlong(const Eigen::Vector3d& center_ref, const Eigen::Vector3d& ray_ref,
                                 const WarpTarget& target) {
  // The pixel of a ray is linear in inverse depth.
  const ReferenceView& view = target.view;
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
  for (const InversePlane& plane : target.planes) {
    if ((1 / plane.inverse_depth - center_ref.z()) * ray_ref.z() <= 0) continue;
    const float x = x_inf + plane.inverse_depth * x_gradient + 0.5F;
    const float y = y_inf + plane.inverse_depth * y_gradient + 0.5F;
    if (!(x >= 0 && x < width && y >= 0 && y < height)) continue;
    const cv::Point pixel(static_cast<int>(x), static_cast<int>(y));
    const float inverse_depth = target.depths->inverseDepth(pixel);
    if (std::abs(inverse_depth - plane.inverse_depth) > plane.half_step) continue;
    const float distance_px = target.depths->distancePx(pixel);
    if (distance_px >= nearest_px) continue;
    nearest_px = distance_px;
    found_m = 1 / double{inverse_depth};
  }
  return found_m;
}

/// Warps an event. @return std::nullopt if no pixel near its ray has a depth.
std::optional<WarpedEvent> warped(const CameraEvents& camera, const Event& event,
                                  const Rigid3& T_ref_rig, const WarpTarget& target) {
  const double since_s = secondsBetween(target.t_ref_ns, event.t_ns);
  const Eigen::Matrix3d R_ref_rig = T_ref_rig.rotation.toRotationMatrix();
  const Rigid3& T_rig_cam = camera.calibration->T_rig_cam;
  const Eigen::Vector3d ray_rig =
      T_rig_cam.rotation * camera.undistortion->ray(event.x, event.y).homogeneous();
  const Eigen::Vector3d center_ref = T_ref_rig * T_rig_cam.translation;
  const Eigen::Vector3d ray_ref = R_ref_rig * ray_rig;
  const std::optional<double> depth_m = depthAlong(center_ref, ray_ref, target);
  if (!depth_m) return std::nullopt;

  const double length = (*depth_m - center_ref.z()) / ray_ref.z();
  const Eigen::Vector3d p_ref = center_ref + length * ray_ref;
  const Eigen::Vector3d p_rig = T_rig_cam.translation + length * ray_rig;
  const ReferenceView& view = target.view;
  // A point fixed to the rig moves by v + w x p_rig; the moved ray then meets the plane again.
  Eigen::Matrix<double, 2, 3> pixel_by_point;
  pixel_by_point << view.fx, 0, -view.fx * ray_ref.x() / ray_ref.z(), 0, view.fy,
      -view.fy * ray_ref.y() / ray_ref.z();
  Eigen::Matrix<double, 3, 6> point_by_velocity;
  Eigen::Matrix3d cross;  // cross * w = p_rig x w
  cross << 0, -p_rig.z(), p_rig.y(), p_rig.z(), 0, -p_rig.x(), -p_rig.y(), p_rig.x(), 0;
  point_by_velocity << Eigen::Matrix3d::Identity(), -cross;
  WarpedEvent result;
  result.pixel = view.project(p_ref).cast<float>();
  result.by_velocity =
      (since_s / *depth_m * pixel_by_point * R_ref_rig * point_by_velocity).cast<float>();
  result.by_inverse_depth =
      Eigen::Vector2d(view.fx * (center_ref.x() - center_ref.z() * ray_ref.x() / ray_ref.z()),
                      view.fy * (center_ref.y() - center_ref.z() * ray_ref.y() / ray_ref.z()))
          .cast<float>();
  return result;
}

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
  std::vector<WarpedEvent> result;
  result.reserve(events.size() / every + 1);
  std::size_t cursor = 0;
  for (std::size_t i = every / 2; i < events.size(); i += every) {
    const Event& event = events[i];
    if (!camera.undistortion->hasRay(event.x, event.y)) continue;
    const auto segment = trajectory.segmentAt(event.t_ns, cursor);
    if (!segment) continue;
    const Rigid3 T_ref_rig = target.T_ref_world * segment->poseAt(event.t_ns);
    const auto found = warped(camera, event, T_ref_rig, target);
    if (found) result.push_back(*found);
  }
  return result;
}

namespace {

/// Returns the sum of the squares of the images' harmonic mean. Replaces the values of each image
/// by the derivatives of this sum by these values.
double fuse(std::vector<cv::Mat1f>& images) {
  constexpr float kMinValue = 1e-6F;  // events; the mean is 0 if a camera has fewer
  const auto cameras = static_cast<float>(images.size());
  double contrast = 0;
  for (int y = 0; y < images.front().rows; ++y) {
    for (int x = 0; x < images.front().cols; ++x) {
      float minimum = images.front()(y, x);
      for (const cv::Mat1f& image : images) minimum = std::min(minimum, image(y, x));
      if (minimum < kMinValue) {
        for (cv::Mat1f& image : images) image(y, x) = 0;
        continue;
      }
      float inverse_sum = 0;
      for (const cv::Mat1f& image : images) inverse_sum += 1 / image(y, x);
      const float mean = cameras / inverse_sum;
      contrast += double{mean} * double{mean};
      for (cv::Mat1f& image : images) {
        const float ratio = mean / image(y, x);
        image(y, x) = 2 * mean * ratio * ratio / cameras;
      }
    }
  }
  return contrast;
}

}  // namespace

/// The four pixels between which an event lies.
struct EventContrast::Cell {
  int x = 0;
  int y = 0;
  float right = 0;  // weight of the two right pixels
  float below = 0;  // weight of the two lower pixels
  bool inside = false;
};

EventContrast::EventContrast(const std::vector<std::vector<WarpedEvent>>& events, cv::Size view,
                             int patch_px)
    : events_(events), view_(view) {
  const int columns = (view.width - 1) / patch_px + 1;
  const int rows = (view.height - 1) / patch_px + 1;
  const auto patches = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  std::vector<int> variable_of(patches, -1);
  for (const auto& of_camera : events) {
    std::vector<int>& patch_of = patches_.emplace_back();
    for (const WarpedEvent& event : of_camera) {
      const auto column =
          std::clamp(static_cast<int>(event.pixel.x()), 0, view.width - 1) / patch_px;
      const auto row = std::clamp(static_cast<int>(event.pixel.y()), 0, view.height - 1) / patch_px;
      const int patch = row * columns + column;
      int& variable = variable_of[static_cast<std::size_t>(patch)];
      if (variable < 0) {
        variable = static_cast<int>(events_in_patch_.size());
        events_in_patch_.push_back(0);
      }
      ++events_in_patch_[static_cast<std::size_t>(variable)];
      patch_of.push_back(variable);
    }
  }
}

EventContrast::Cell EventContrast::cellOf(std::size_t camera, std::size_t event,
                                          const Change& change) const {
  const WarpedEvent& warped = events_[camera][event];
  const Eigen::Vector2f pixel = warped.pixel + warped.by_velocity * change.head<6>() +
                                warped.by_inverse_depth * change[6 + patches_[camera][event]];
  Cell cell;
  const float x = std::floor(pixel.x());
  const float y = std::floor(pixel.y());
  cell.inside = x >= 0 && y >= 0 && x < static_cast<float>(view_.width - 1) &&
                y < static_cast<float>(view_.height - 1);
  if (!cell.inside) return cell;
  cell.x = static_cast<int>(x);
  cell.y = static_cast<int>(y);
  cell.right = pixel.x() - x;
  cell.below = pixel.y() - y;
  return cell;
}

cv::Mat1f EventContrast::imageOf(std::size_t camera, const Change& change) const {
  cv::Mat1f image = cv::Mat1f::zeros(view_);
  for (std::size_t i = 0; i < events_[camera].size(); ++i) {
    const Cell cell = cellOf(camera, i, change);
    if (!cell.inside) continue;
    float* upper = image[cell.y] + cell.x;
    float* lower = image[cell.y + 1] + cell.x;
    upper[0] += (1 - cell.right) * (1 - cell.below);
    upper[1] += cell.right * (1 - cell.below);
    lower[0] += (1 - cell.right) * cell.below;
    lower[1] += cell.right * cell.below;
  }
  return image;
}

cv::Mat1f EventContrast::smoothed(const cv::Mat1f& image) const {
  cv::Mat1f result;
  const int side = 2 * static_cast<int>(std::ceil(3 * blur_px_)) + 1;
  // With a border of zeros, smoothing is its own transpose: the gradient needs this.
  cv::GaussianBlur(image, result, cv::Size(side, side), blur_px_, blur_px_, cv::BORDER_CONSTANT);
  return result;
}

Eigen::VectorXd EventContrast::gradientOf(std::size_t camera, const Change& change,
                                          const cv::Mat1f& by_pixel_value) const {
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(variables());
  for (std::size_t i = 0; i < events_[camera].size(); ++i) {
    const Cell cell = cellOf(camera, i, change);
    if (!cell.inside) continue;
    const float* upper = by_pixel_value[cell.y] + cell.x;
    const float* lower = by_pixel_value[cell.y + 1] + cell.x;
    const Eigen::RowVector2f by_pixel(
        (1 - cell.below) * (upper[1] - upper[0]) + cell.below * (lower[1] - lower[0]),
        (1 - cell.right) * (lower[0] - upper[0]) + cell.right * (lower[1] - upper[1]));
    const WarpedEvent& event = events_[camera][i];
    gradient.head<6>() += (by_pixel * event.by_velocity).transpose().cast<double>();
    gradient[6 + patches_[camera][i]] += static_cast<double>(by_pixel * event.by_inverse_depth);
  }
  return gradient;
}

double EventContrast::at(const Eigen::VectorXd& change, Eigen::VectorXd& gradient) const {
  const Change narrow = change.cast<float>();
  std::vector<cv::Mat1f> images(events_.size());
  tbb::parallel_for(std::size_t{0}, events_.size(), [&](std::size_t camera) {
    images[camera] = smoothed(imageOf(camera, narrow));
  });
  const double contrast = fuse(images);
  std::vector<Eigen::VectorXd> gradients(events_.size());
  tbb::parallel_for(std::size_t{0}, events_.size(), [&](std::size_t camera) {
    gradients[camera] = gradientOf(camera, narrow, smoothed(images[camera]));
  });
  gradient = Eigen::VectorXd::Zero(variables());
  for (const Eigen::VectorXd& of_camera : gradients) gradient += of_camera;
  return contrast;
}

}  // namespace efm
