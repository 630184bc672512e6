// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/registration_points.h"

#include <Eigen/Eigenvalues>
#include <opencv2/core.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "mapping/base/option.h"
#include "mapping/depth/peak_fit.h"
#include "maps/refinement/pose_refinement.h"

namespace efm {
namespace {

/// Maximum difference between the inverse depths of an edge, in standard deviations.
constexpr double kSameEdgeSigmas = 3;
/// A neighbourhood is an edge if the ratio of its variances along and across is larger.
constexpr double kEdgeElongation = 4;
/// Standard deviation of a point along its edge, pixels: it is not measured.
constexpr double kAlongEdgePx = 100;
/// Maximum ratio of the standard deviations along and across a ray: the limit of a float
/// covariance.
constexpr double kMaxElongation = 1000;

struct CertainPixel {
  int x = 0;
  int y = 0;
  float inverse_depth = 0;   // 1/m
  float sigma = 0;           // of inverse depth, 1/m
  float relative_sigma = 0;  // of depth
};

/// Returns whether a pixel has a depth with a known variance.
bool isMeasured(float depth, float variance) {
  return depth > 0 && std::isfinite(depth) && variance >= 0 && std::isfinite(variance);
}

std::vector<CertainPixel> certainPixels(const DepthMap& map) {
  std::vector<CertainPixel> pixels;
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      const float depth = map.depth(y, x);
      const float variance = map.variance(y, x);
      if (!isMeasured(depth, variance)) continue;
      const float sigma = std::sqrt(variance);
      pixels.push_back({x, y, 1 / depth, sigma, sigma * depth});
    }
  }
  return pixels;
}

/// Returns the most certain pixel of each cell of a grid, then the second ones, up to `count`.
std::vector<CertainPixel> spreadOver(const std::vector<CertainPixel>& pixels, cv::Size size,
                                     int count) {
  // One cell for four points, because most cells of a semi-dense map are empty.
  const double cell_px = std::max(2.0, std::sqrt(4.0 * size.area() / count));
  const auto columns = static_cast<std::size_t>(size.width / cell_px) + 1;
  const auto rows = static_cast<std::size_t>(size.height / cell_px) + 1;
  std::vector<std::vector<CertainPixel>> cells(columns * rows);
  for (const CertainPixel& pixel : pixels) {
    const auto row = static_cast<std::size_t>(pixel.y / cell_px);
    cells[row * columns + static_cast<std::size_t>(pixel.x / cell_px)].push_back(pixel);
  }
  const auto more_certain = [](const CertainPixel& a, const CertainPixel& b) {
    return a.relative_sigma < b.relative_sigma;
  };
  std::vector<std::pair<std::size_t, CertainPixel>> ranked;
  for (std::vector<CertainPixel>& cell : cells) {
    std::stable_sort(cell.begin(), cell.end(), more_certain);
    for (std::size_t i = 0; i < cell.size(); ++i) ranked.emplace_back(i, cell[i]);
  }
  std::stable_sort(ranked.begin(), ranked.end(), [&](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first : more_certain(a.second, b.second);
  });
  ranked.resize(std::min(ranked.size(), static_cast<std::size_t>(count)));
  std::vector<CertainPixel> spread;
  spread.reserve(ranked.size());
  for (const auto& [rank, pixel] : ranked) spread.push_back(pixel);
  return spread;
}

/// The covariances of the points around a point.
struct Neighbourhood {
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< m^2, frame `ref`.
  Eigen::Matrix2d in_image = Eigen::Matrix2d::Zero();    ///< px^2.
};

Neighbourhood neighbourhoodOf(const KeyframeDepthMap& keyframe, const CertainPixel& pixel,
                              const Eigen::Vector3d& p_ref, int radius_px) {
  using Offset = Eigen::Matrix<double, 5, 1>;  // in space, in the image
  const DepthMap& map = keyframe.map;
  int count = 0;
  Offset sum = Offset::Zero();  // relative to the point, for precision
  Eigen::Matrix<double, 5, 5> squares = Eigen::Matrix<double, 5, 5>::Zero();
  const cv::Rect window =
      cv::Rect(pixel.x - radius_px, pixel.y - radius_px, 2 * radius_px + 1, 2 * radius_px + 1) &
      cv::Rect({0, 0}, map.depth.size());
  for (int y = window.y; y < window.br().y; ++y) {
    for (int x = window.x; x < window.br().x; ++x) {
      const float depth = map.depth(y, x);
      const float variance = map.variance(y, x);
      if (!isMeasured(depth, variance)) continue;
      const float sigma = std::max(pixel.sigma, std::sqrt(variance));
      if (std::abs(1 / depth - pixel.inverse_depth) > kSameEdgeSigmas * sigma) continue;
      Offset offset;
      offset << keyframe.view.pointAt(x, y, depth) - p_ref, x - pixel.x, y - pixel.y;
      ++count;
      sum += offset;
      squares += offset * offset.transpose();
    }
  }
  if (count == 0) return {};
  const Eigen::Matrix<double, 5, 5> covariance =
      squares / count - (sum / count) * (sum / count).transpose();
  return {covariance.topLeftCorner<3, 3>(), covariance.bottomRightCorner<2, 2>()};
}

/// Returns the covariance along an edge: the position along the edge is not measured.
Eigen::Matrix3d alongEdge(const Neighbourhood& around, const ReferenceView& view, double depth) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen;
  eigen.computeDirect(around.in_image);
  const Eigen::Vector2d variances = eigen.eigenvalues();  // ascending
  if (!(variances[1] > kEdgeElongation * variances[0])) return Eigen::Matrix3d::Zero();
  const Eigen::Vector2d edge = eigen.eigenvectors().col(1);
  const Eigen::Vector3d along =
      kAlongEdgePx * depth * Eigen::Vector3d(edge.x() / view.fx, edge.y() / view.fy, 0);
  return along * along.transpose();
}

RegistrationPoint pointOf(const KeyframeDepthMap& keyframe, const CertainPixel& pixel,
                          const RegistrationCloudOptions& options) {
  const double depth = keyframe.map.depth(pixel.y, pixel.x);
  const Eigen::Vector3d p_ref = keyframe.view.pointAt(pixel.x, pixel.y, depth);
  const Neighbourhood around = neighbourhoodOf(keyframe, pixel, p_ref, options.neighbourhood_px);
  const Eigen::Vector3d along_ray = p_ref * (options.depth_sigmas * pixel.relative_sigma);
  const double across_m =
      std::max(options.pixel_sigma * depth / keyframe.view.fx, along_ray.norm() / kMaxElongation);
  Eigen::Matrix3d covariance = along_ray * along_ray.transpose() + around.covariance +
                               alongEdge(around, keyframe.view, depth);
  covariance.diagonal().array() += across_m * across_m;
  return {p_ref.cast<float>(), covariance.cast<float>()};
}

/// Returns false if a depth is so large or small that floats do not hold its square.
bool isUsable(const RegistrationPoint& point) {
  return point.p_ref.allFinite() && point.covariance.allFinite() &&
         isPositiveDefinite(point.covariance.cast<double>());
}

}  // namespace

void RegistrationCloudOptions::validate() const {
  requireFields(*this);
  requireOption(max_map_points >= max_points && max_map_points <= 1000000, "max_map_points",
                max_map_points, "from max_points to 1000000", {"max_points"});
}

RegistrationCloud::RegistrationCloud(const KeyframeDepthMap& keyframe,
                                     const RegistrationCloudOptions& options)
    : view_(keyframe.view) {
  options.validate();
  std::vector<CertainPixel> pixels =
      spreadOver(certainPixels(keyframe.map), keyframe.map.depth.size(), options.max_map_points);
  points_.reserve(pixels.size());
  min_inverse_depth_ = std::numeric_limits<double>::infinity();
  for (const CertainPixel& pixel : pixels) {
    const RegistrationPoint point = pointOf(keyframe, pixel, options);
    if (!isUsable(point)) continue;
    points_.push_back(point);
    max_inverse_depth_ = std::max<double>(max_inverse_depth_, pixel.inverse_depth);
    min_inverse_depth_ = std::min<double>(min_inverse_depth_, pixel.inverse_depth);
  }
  if (points_.empty()) min_inverse_depth_ = 0;
  num_query_points_ = std::min(points_.size(), static_cast<std::size_t>(options.max_points));
  constexpr float kMinSigma = 1e-9F;  // 1/m: a variance may be 0
  const auto more_certain = [](const CertainPixel& a, const CertainPixel& b) {
    return a.sigma < b.sigma;
  };
  const float sigma = pixels.empty() ? 0 : upperMedian(pixels, more_certain).sigma;
  px_per_inverse_depth_ = 1 / std::max(sigma, kMinSigma);
}

Eigen::Vector3f RegistrationCloud::viewCoordinates(const Eigen::Vector3d& p_ref) const {
  const Eigen::Vector2d pixel = view_.project(p_ref);
  return Eigen::Vector3d(pixel.x(), pixel.y(), px_per_inverse_depth_ / p_ref.z()).cast<float>();
}

bool RegistrationCloud::isInView(const Eigen::Vector3d& p_ref) const {
  if (points_.empty() || !(p_ref.z() > 0)) return false;
  // Margin of the range of depths in view, because a wall that faces the view has one depth.
  constexpr double kMarginSigmas = 3;
  const double margin = kMarginSigmas / px_per_inverse_depth_;
  const double inverse_depth = 1 / p_ref.z();
  if (inverse_depth > max_inverse_depth_ + margin || inverse_depth < min_inverse_depth_ - margin) {
    return false;
  }
  const Eigen::Vector2d pixel = view_.project(p_ref);
  return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() <= view_.width - 1 &&
         pixel.y() <= view_.height - 1;
}

std::optional<std::size_t> RegistrationCloud::nearest(const Eigen::Vector3d& p_ref,
                                                      double max_distance_px) const {
  if (points_.empty() || !(p_ref.z() > 0)) return std::nullopt;
  const Eigen::Vector3f at = viewCoordinates(p_ref);
  const auto margin = static_cast<float>(max_distance_px);
  const auto within = [&](float value, int size) {
    return value >= -margin && value <= static_cast<float>(size - 1) + margin;
  };
  if (!within(at.x(), view_.width) || !within(at.y(), view_.height)) return std::nullopt;
  if (!tree_) {
    std::vector<Eigen::Vector3f> coordinates;
    coordinates.reserve(points_.size());
    for (const RegistrationPoint& point : points_) {
      coordinates.push_back(viewCoordinates(point.p_ref.cast<double>()));
    }
    tree_ = std::make_unique<PointTree>(coordinates);
  }
  const PointTree::Neighbor neighbor = tree_->nearest(at);
  if (!(neighbor.squared_distance <= margin * margin)) return std::nullopt;
  return neighbor.index;
}

void RegistrationCloud::clear() noexcept {
  std::vector<RegistrationPoint>().swap(points_);
  num_query_points_ = 0;
  max_inverse_depth_ = 0;
  min_inverse_depth_ = 0;
  tree_.reset();
}

}  // namespace efm
