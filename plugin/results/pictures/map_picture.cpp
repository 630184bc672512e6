// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/pictures/map_picture.h"

#include <fmt/format.h>
#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "mapping/depth/peak_fit.h"
#include "mapping/geometry/rigid3.h"
#include "plugin/results/pictures/depth_picture.h"
#include "plugin/results/pictures/picture.h"

namespace efm {
namespace {

// Sizes in pixels.
constexpr int kMaxWidth = 1500;
constexpr int kMaxHeight = 1500;
constexpr int kMinWidth = 800;  // the legend needs this width
constexpr int kLabelHeight = 30;
constexpr int kLegendHeight = 64;
constexpr int kBorder = 8;
constexpr int kViewGap = 24;

constexpr double kViewMargin = 0.02;  // fraction of an extent, at both ends

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

/// The positions that must be visible in the views.
class ShownPositions {
 public:
  ShownPositions(const MapCloud& cloud, const std::vector<StampedPose>& trajectory)
      : trajectory_(trajectory) {
    constexpr std::size_t kSamples = 20'000;
    const std::size_t step = cloud.size() / kSamples + 1;
    for (std::size_t i = 0; i < cloud.size(); i += step) {
      samples_.push_back(positionIn(cloud, cloud[i]));
    }
  }

  /// Returns the extent of the points. The lowest and the highest percent of them count as far as
  /// they lie at most a fraction of the extent of the others beyond it.
  Extent ofPoints(const Eigen::Vector3d& axis, double beyond) const {
    std::vector<double> values(samples_.size());
    std::transform(samples_.begin(), samples_.end(), values.begin(),
                   [&](const Eigen::Vector3d& p) { return p.dot(axis); });
    Extent extent;
    if (values.empty()) return extent;
    const double last = static_cast<double>(values.size() - 1);
    for (const double fraction : {0.01, 0.99}) {
      const auto nth = values.begin() + std::lround(fraction * last);
      std::nth_element(values.begin(), nth, values.end());
      extent.add(*nth);
    }
    const double margin = beyond * extent.length();
    const Extent wide = {extent.low - margin, extent.high + margin};
    for (const double value : values) {
      if (value >= wide.low && value <= wide.high) extent.add(value);
    }
    return extent;
  }

  /// Returns the extent of a view: points and trajectory. A trajectory that lies far from the
  /// points is left out, or it would have most of the picture.
  Extent along(const Eigen::Vector3d& axis) const {
    constexpr double kOutliers = 0.1;
    constexpr double kMaxGap = 0.5;
    constexpr std::size_t kMinPoints = 100;
    const Extent points = ofPoints(axis, kOutliers);
    Extent path;
    for (const StampedPose& pose : trajectory_) path.add(pose.T_world_rig.translation.dot(axis));
    const double gap_m = std::max(points.low - path.high, path.low - points.high);
    const bool is_far = gap_m > kMaxGap * points.length() + path.length();
    if (is_far && samples_.size() >= kMinPoints) return points;
    return {std::min(points.low, path.low), std::max(points.high, path.high)};
  }

 private:
  const std::vector<StampedPose>& trajectory_;
  std::vector<Eigen::Vector3d> samples_;
};

/// Returns the length of the trajectory's extent along an axis.
double travelled(const std::vector<StampedPose>& trajectory, const Eigen::Vector3d& axis) {
  Extent extent;
  for (const StampedPose& pose : trajectory) extent.add(pose.T_world_rig.translation.dot(axis));
  return extent.length();
}

/// Returns the sum of the cameras' level viewing directions; it is short if they look everywhere.
Eigen::Vector3d levelLook(const std::vector<StampedPose>& trajectory, const Eigen::Vector3d& up) {
  Eigen::Vector3d look = Eigen::Vector3d::Zero();
  for (const StampedPose& pose : trajectory) {
    look += pose.T_world_rig.rotation * Eigen::Vector3d::UnitZ();
  }
  return look - look.dot(up) * up;
}

/// Returns the horizontal direction of the smallest rectangle around the positions: along the walls
/// of a room. An axis of the world is preferred if it is nearly as good.
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

/// The axes of a map's views.
struct Axes {
  Eigen::Vector3d right, away, up;  // `away`: upwards in the top view, forwards in the side view
};

/// Both views, side by side or one above the other: the arrangement with the larger scale.
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
  // Space for the trajectory of a map that is a line or a single position.
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
  // The side view has the cameras' viewing direction, with one exception: cameras that travel
  // forwards, as in a street, are seen from the side.
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
    const Extent heights = positions.ofPoints(up, 0);
    const double least = std::max(heights.length(), 0.01);
    layout.heights_m = {heights.low, heights.low + least};
  }
  return layout;
}

namespace {

constexpr double kLabelScale = 0.55;
constexpr Palette kHeightPalette = Palette::kRainbow;
const cv::Scalar kMapGrey = cv::Scalar::all(210);

/// An image of points. Each point adds a weight of 1, distributed over the four nearest pixels.
class Splats {
 public:
  explicit Splats(cv::Size size) : weights_(size, 0.0F), heights_(size, 0.0F) {}

  void add(const cv::Point2d& at, float height) {
    const int x = cvFloor(at.x), y = cvFloor(at.y);
    if (x < 0 || y < 0 || x + 1 >= weights_.cols || y + 1 >= weights_.rows) return;
    const auto u = static_cast<float>(at.x - x), v = static_cast<float>(at.y - y);
    addTo(x, y, (1 - u) * (1 - v), height);
    addTo(x + 1, y, u * (1 - v), height);
    addTo(x, y + 1, (1 - u) * v, height);
    addTo(x + 1, y + 1, u * v, height);
  }

  /// Returns the colours of the mean height, on white. Pixels with more points are more opaque.
  cv::Mat3b picture(double sigma) {
    cv::GaussianBlur(weights_, weights_, {}, sigma);
    cv::GaussianBlur(heights_, heights_, {}, sigma);
    const double lone = 1 / (2 * kPi * sigma * sigma);  // the weight at a point without neighbours
    weights_ *= 1 / lone;
    heights_ *= 1 / lone;
    const float typical = typicalWeight();
    cv::Mat1b levels(weights_.size(), uchar{0});
    for (int y = 0; y < levels.rows; ++y) {
      for (int x = 0; x < levels.cols; ++x) {
        const float weight = weights_(y, x);
        if (weight > 1e-3F) levels(y, x) = cv::saturate_cast<uchar>(255 * heights_(y, x) / weight);
      }
    }
    cv::Mat3b picture = coloured(levels, kHeightPalette);
    for (int y = 0; y < levels.rows; ++y) {
      for (int x = 0; x < levels.cols; ++x) {
        const float opacity = 1 - std::exp(-weights_(y, x) / typical);
        cv::Vec3b& pixel = picture(y, x);
        for (int k = 0; k < 3; ++k) {
          pixel[k] = cv::saturate_cast<uchar>(255 - opacity * static_cast<float>(255 - pixel[k]));
        }
      }
    }
    return picture;
  }

 private:
  void addTo(int x, int y, float weight, float height) {
    weights_(y, x) += weight;
    heights_(y, x) += weight * height;
  }

  float typicalWeight() const {
    std::vector<float> weights;
    for (const float weight : weights_) {
      if (weight > 0.08F) weights.push_back(weight);
    }
    if (weights.empty()) return 1;
    return std::max(0.6F, upperMedian(weights));
  }

  cv::Mat1f weights_;
  cv::Mat1f heights_;  // weighted sums
};

void drawPoints(cv::Mat3b& picture, const MapView& view, const MapCloud& cloud,
                const MapLayout& layout, double sigma) {
  const Eigen::Vector3d& up = layout.side.upwards;
  Splats splats(view.area.size());
  const cv::Point2d corner = view.area.tl();
  for (const MapPoint& point : cloud) {
    const Eigen::Vector3d p_world = positionIn(cloud, point);
    const double level = std::clamp(layout.heights_m.fractionAlong(p_world.dot(up)), 0.0, 1.0);
    splats.add(view.pixelOf(p_world) - corner, static_cast<float>(level));
  }
  splats.picture(sigma).copyTo(picture(view.area));
}

/// Draws a path with a dot at its start and a ring at its end.
/// @param pixels see `subpixel`.
/// @param covers true if the path covers points; then it gets a white border.
void drawPath(cv::Mat3b& picture, const std::vector<cv::Point>& pixels, bool covers) {
  const cv::Scalar white = cv::Scalar::all(255);
  const auto line = [&](int width, const cv::Scalar& colour) {
    cv::polylines(picture, pixels, false, colour, width, cv::LINE_AA, kSubpixelBits);
  };
  const auto dot = [&](const cv::Point& at, int radius, const cv::Scalar& colour) {
    cv::circle(picture, at, radius << kSubpixelBits, colour, cv::FILLED, cv::LINE_AA,
               kSubpixelBits);
  };
  if (covers) line(6, white);
  line(2, kPlotInk);
  for (const cv::Point& end : {pixels.front(), pixels.back()}) {
    if (covers) dot(end, 8, white);
    dot(end, 6, kPlotInk);
  }
  dot(pixels.back(), 4, white);
}

void drawTrajectory(cv::Mat3b& picture, const MapView& view,
                    const std::vector<StampedPose>& trajectory) {
  cv::Mat3b area = picture(view.area);
  const cv::Point2d corner = view.area.tl();
  std::vector<cv::Point> pixels;
  for (const StampedPose& pose : trajectory) {
    pixels.push_back(subpixel(view.pixelOf(pose.T_world_rig.translation) - corner));
  }
  if (!pixels.empty()) drawPath(area, pixels, true);
}

/// Returns where the trajectory lies if a view does not show it: ", the cameras 0.7 m below".
std::string placeOfPath(const MapView& view, const std::vector<StampedPose>& trajectory) {
  Extent x, y;
  for (const StampedPose& pose : trajectory) {
    const cv::Point2d at = view.pixelOf(pose.T_world_rig.translation);
    x.add(at.x);
    y.add(at.y);
  }
  const cv::Rect& area = view.area;
  const std::pair<double, const char*> sides[] = {{y.low - area.br().y, "below"},
                                                  {area.y - y.high, "above"},
                                                  {x.low - area.br().x, "right"},
                                                  {area.x - x.high, "left"}};
  const auto farthest = *std::max_element(std::begin(sides), std::end(sides));
  if (!(farthest.first > 0)) return "";
  return fmt::format(", the cameras {:.2g} m {}", farthest.first / view.pixels_per_m,
                     farthest.second);
}

/// Returns the largest of 1, 2 or 5 times a power of ten that is at most `max_m`.
double roundLength(double max_m) {
  const double power = std::pow(10.0, std::floor(std::log10(max_m)));
  for (const double factor : {5.0, 2.0}) {
    if (factor * power <= max_m) return factor * power;
  }
  return power;
}

void drawLegend(cv::Mat3b& picture, const MapLayout& layout, bool has_points) {
  const cv::Rect& area = layout.legend;
  const double scale = layout.top.pixels_per_m;
  const double length_m = roundLength(220 / scale);
  const int length = cvRound(length_m * scale);
  cv::rectangle(picture, cv::Rect(area.x, area.y + 14, length, 6), kPlotInk, cv::FILLED);
  const int baseline = area.y + 23;
  writeText(picture, fmt::format("{:g} m", length_m), {area.x + length + 10, baseline},
            kLabelScale);
  const cv::Point sample(area.x, area.y + 47);
  drawPath(picture, {subpixel(sample + cv::Point(6, 0)), subpixel(sample + cv::Point(66, 0))},
           false);
  writeText(picture, "start to end", {sample.x + 82, sample.y + 6}, kLabelScale);
  if (!has_points) return;
  const int width = std::min(600, area.width - 460);
  const cv::Mat3b bar = drawBar(layout.heights_m, kHeightPalette, "height (m)", width);
  bar.copyTo(picture(cv::Rect({area.br().x - width, area.y + 6}, bar.size())));
}

}  // namespace

cv::Mat3b drawMap(const MapCloud& cloud, const std::vector<StampedPose>& trajectory,
                  double voxel_size_m) {
  if (cloud.empty() && trajectory.empty()) {
    throw std::invalid_argument("a map without points and keyframes has no picture");
  }
  const MapLayout layout = layOutMap(cloud, trajectory);
  // If there are few points in a large area, they are drawn larger.
  const double pixels_per_point =
      layout.top.area.area() / (1.0 + static_cast<double>(cloud.size()));
  const double sigma = std::clamp(
      std::max(0.6 * voxel_size_m * layout.top.pixels_per_m, 0.1 * std::sqrt(pixels_per_point)),
      0.8, 3.0);
  cv::Mat3b picture(layout.size, cv::Vec3b(255, 255, 255));
  for (const auto& [view, name] :
       {std::pair{layout.top, std::string("top view")}, {layout.side, "side view"}}) {
    drawPoints(picture, view, cloud, layout, sigma);
    drawTrajectory(picture, view, trajectory);
    cv::rectangle(picture, view.area, kMapGrey);
    writeText(picture, name + placeOfPath(view, trajectory), view.area.tl() - cv::Point(0, 8),
              kLabelScale);
  }
  drawLegend(picture, layout, !cloud.empty());
  return picture;
}

}  // namespace efm
