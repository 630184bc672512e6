// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/pictures/map_layout.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "mapping/geometry/rigid3.h"
#include "plugin/results/pictures/upward.h"

namespace efm {
namespace {

// Pixels.
constexpr int kMaxWidth = 1500;
constexpr int kMaxHeight = 1500;
constexpr int kMinWidth = 800;  // of the legend
constexpr int kLabelHeight = 30;
constexpr int kLegendHeight = 64;
constexpr int kBorder = 8;
constexpr int kViewGap = 24;

constexpr double kViewMargin = 0.02;  // of an extent, at both ends

struct Extent {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  double middle() const { return 0.5 * (low + high); }
  double length() const { return high - low; }
};

/// The ends of the values without the lowest and the highest percent.
Extent robustExtent(std::vector<double>& values) {
  Extent extent;
  if (values.empty()) return extent;
  for (const double fraction : {0.01, 0.99}) {
    const auto at = values.begin() + std::lround(fraction * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    extent.add(*at);
  }
  return extent;
}

/// The positions that decide what is shown.
class ShownPositions {
 public:
  ShownPositions(const MapCloud& cloud, const std::vector<StampedPose>& trajectory)
      : trajectory_(trajectory) {
    constexpr std::size_t kSamples = 20'000;
    const std::size_t step = cloud.size() / kSamples + 1;
    for (std::size_t i = 0; i < cloud.size(); i += step) {
      samples_.push_back(positionIn(cloud, cloud[i]));
    };
  }

  Extent ofPoints(const Eigen::Vector3d& axis) const {
    std::vector<double> values(samples_.size());
    std::transform(samples_.begin(), samples_.end(), values.begin(),
                   [&](const Eigen::Vector3d& p) { return p.dot(axis); });
    return robustExtent(values);
  }

  Extent along(const Eigen::Vector3d& axis) const {
    Extent extent = ofPoints(axis);
    for (const StampedPose& pose : trajectory_) extent.add(pose.T_world_rig.translation.dot(axis));
    return extent;
  }

 private:
  const std::vector<StampedPose>& trajectory_;
  std::vector<Eigen::Vector3d> samples_;
};

/// The length of the trajectory's extent along an axis.
double travelled(const std::vector<StampedPose>& trajectory, const Eigen::Vector3d& axis) {
  Extent extent;
  for (const StampedPose& pose : trajectory) extent.add(pose.T_world_rig.translation.dot(axis));
  return extent.length();
}

/// Where the cameras look on average, without its part along `up`; short where they turn around.
Eigen::Vector3d levelLook(const std::vector<StampedPose>& trajectory, const Eigen::Vector3d& up) {
  Eigen::Vector3d look = Eigen::Vector3d::Zero();
  for (const StampedPose& pose : trajectory) {
    look += pose.T_world_rig.rotation * Eigen::Vector3d::UnitZ();
  }
  return look - look.dot(up) * up;
}

/// A direction across `up` such that a rectangle along it around the shown positions has the
/// smallest area: along the walls of a room. An axis of the world if it is nearly as good.
Eigen::Vector3d levelAxis(const ShownPositions& positions, const Eigen::Vector3d& up) {
  constexpr double kNearly = 1.05;
  constexpr int kStepDeg = 3;
  const Eigen::Vector3d world_axis =
      std::abs(up.x()) < 0.9 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  const Eigen::Vector3d start = (world_axis - world_axis.dot(up) * up).normalized();
  Eigen::Vector3d best = start;
  double smallest = std::numeric_limits<double>::infinity();
  for (int angle_deg = 0; angle_deg < 90; angle_deg += kStepDeg) {
    const Eigen::Vector3d axis = Eigen::AngleAxisd(angle_deg * kRadiansPerDegree, up) * start;
    const double area = positions.along(axis).length() * positions.along(up.cross(axis)).length();
    if ((angle_deg == 0 ? 1 : kNearly) * area >= smallest) continue;
    smallest = area;
    best = axis;
  }
  return best;
}

/// The views of a map along given axes.
struct Axes {
  Eigen::Vector3d right, away, up;  // `away`: upwards in the top view, into the side view
};

/// Both views side by side or one above the other, with the larger scale.
struct Arrangement {
  bool side_by_side = false;
  double pixels_per_m = 0;
  double width_m = 0, depth_m = 0, height_m = 0;
};

Arrangement arrange(const ShownPositions& positions, const Axes& axes) {
  Arrangement result;
  const auto lengthOf = [&](const Eigen::Vector3d& axis) {
    return (1 + 2 * kViewMargin) * positions.along(axis).length();
  };
  result.width_m = lengthOf(axes.right);
  result.depth_m = lengthOf(axes.away);
  result.height_m = lengthOf(axes.up);
  // Room for the trajectory of a map that is a line or a position.
  const double min_m =
      std::max({0.05 * result.width_m, 0.05 * result.depth_m, 0.05 * result.height_m, 0.1});
  for (double* length : {&result.width_m, &result.depth_m, &result.height_m}) {
    *length = std::max(*length, min_m);
  }
  const int width = kMaxWidth - 2 * kBorder;
  const int height = kMaxHeight - 2 * kBorder - kLabelHeight - kLegendHeight;
  const double below = std::min(width / result.width_m, (height - kLabelHeight - kViewGap) /
                                                            (result.depth_m + result.height_m));
  const double beside = std::min((width - kViewGap) / (2 * result.width_m),
                                 height / std::max(result.depth_m, result.height_m));
  result.side_by_side = beside > below;
  result.pixels_per_m = std::max(beside, below);
  return result;
}

}  // namespace

cv::Point2d MapView::pixelOf(const Eigen::Vector3d& p) const {
  const Eigen::Vector3d offset_m = p - p_world;
  return {area.x + 0.5 * (area.width - 1) + pixels_per_m * offset_m.dot(right),
          area.y + 0.5 * (area.height - 1) - pixels_per_m * offset_m.dot(upwards)};
}

MapLayout layOutMap(const MapCloud& cloud, const std::vector<StampedPose>& trajectory) {
  const ShownPositions positions(cloud, trajectory);
  const Eigen::Vector3d up = upwardOf(trajectory);
  const Eigen::Vector3d look = levelLook(trajectory, up);
  const bool looks_one_way = look.norm() > 0.5 * static_cast<double>(trajectory.size());
  Axes axes;
  Arrangement arrangement;
  double best = 0;
  // The side view looks as the cameras do, but not along a street: cameras that travel forwards
  // are seen from the side.
  constexpr double kLookBonus = 1.4;
  const Eigen::Vector3d axis = levelAxis(positions, up);
  for (Eigen::Vector3d right : {axis, Eigen::Vector3d(up.cross(axis))}) {
    const Eigen::Vector3d away = up.cross(right);
    const bool looks_away = std::abs(look.dot(away)) > std::abs(look.dot(right));
    if ((looks_away ? look.dot(away) : look.dot(right)) < 0) right = -right;
    const Axes turned = {right, up.cross(right), up};
    const Arrangement candidate = arrange(positions, turned);
    const bool bonus = looks_away && looks_one_way &&
                       travelled(trajectory, turned.away) <= travelled(trajectory, turned.right);
    const double quality = (bonus ? kLookBonus : 1) * candidate.pixels_per_m;
    if (quality <= best) continue;
    best = quality;
    axes = turned;
    arrangement = candidate;
  }

  const double scale = arrangement.pixels_per_m;
  const int width = cvRound(scale * arrangement.width_m);
  const cv::Size top(width, cvRound(scale * arrangement.depth_m));
  const cv::Size side(width, cvRound(scale * arrangement.height_m));
  const bool beside = arrangement.side_by_side;
  const int views_width = beside ? 2 * width + kViewGap : width;
  const int views_height = beside ? std::max(top.height, side.height)
                                  : top.height + side.height + kLabelHeight + kViewGap;
  MapLayout layout;
  layout.size = {std::max(kMinWidth, views_width + 2 * kBorder),
                 views_height + kLabelHeight + kLegendHeight + 2 * kBorder};
  const cv::Point first((layout.size.width - views_width) / 2, kBorder + kLabelHeight);
  const cv::Point second = first + (beside ? cv::Point(width + kViewGap, 0)
                                           : cv::Point(0, top.height + kViewGap + kLabelHeight));
  const Eigen::Vector3d p_world = positions.along(axes.right).middle() * axes.right +
                                  positions.along(axes.away).middle() * axes.away +
                                  positions.along(axes.up).middle() * axes.up;
  layout.top = {{first, top}, axes.right, axes.away, p_world, scale};
  layout.side = {{second, side}, axes.right, axes.up, p_world, scale};
  const int legend_width = std::max(views_width, kMinWidth - 2 * kBorder);
  layout.legend = {(layout.size.width - legend_width) / 2,
                   layout.size.height - kLegendHeight - kBorder, legend_width, kLegendHeight};
  if (!cloud.empty()) {
    const Extent heights = positions.ofPoints(up);
    const double least = std::max(heights.length(), 0.01);
    layout.heights_m = {heights.low, heights.low + least};
  }
  return layout;
}

}  // namespace efm
