// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/registration_cloud.h"

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_types.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <utility>

#include "mapping/depth/median.h"
#include "mapping/options/option_check.h"

namespace efm {
namespace {

/// How far inverse depths of neighbours may differ, in standard deviations, and still be of one
/// edge.
constexpr double kSameEdgeSigmas = 3;
/// Points around one are an edge where they vary so many times as much in one direction as across.
constexpr double kEdgeElongation = 4;
/// What a point's place along its edge errs by, pixels: anything.
constexpr double kAlongEdgePx = 100;
/// How far beyond its nearest and farthest point a keyframe sees: a wall that faces it has one
/// depth.
constexpr double kDepthMarginSigmas = 3;

/// A point errs along its ray at most so many times as much as across: as floats hold a covariance.
constexpr double kLongest = 1000;

struct CertainPixel {
  int x = 0;
  int y = 0;
  float inverse_depth = 0;   // 1/m
  float sigma = 0;           // of inverse depth, 1/m
  float relative_sigma = 0;  // of depth
};

/// Whether a pixel holds a depth that errs by something known.
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

/// The most certain of each cell of a grid, then the second of each, and so on, as many as asked
/// for.
std::vector<CertainPixel> spreadOver(const std::vector<CertainPixel>& pixels, cv::Size size,
                                     int count) {
  // Cells for a quarter of the points: semi-dense maps leave most of them empty.
  const double cell_px = std::max(2.0, std::sqrt(4.0 * size.area() / count));
  const auto columns = static_cast<std::size_t>(size.width / cell_px) + 1;
  const auto rows = static_cast<std::size_t>(size.height / cell_px) + 1;
  std::vector<std::vector<CertainPixel>> cells(columns * rows);
  for (const CertainPixel& pixel : pixels) {
    const auto row = static_cast<std::size_t>(pixel.y / cell_px);
    cells[row * columns + static_cast<std::size_t>(pixel.x / cell_px)].push_back(pixel);
  }
  const auto surer = [](const CertainPixel& a, const CertainPixel& b) {
    return a.relative_sigma < b.relative_sigma;
  };
  std::vector<std::pair<std::size_t, CertainPixel>> ranked;
  for (std::vector<CertainPixel>& cell : cells) {
    std::stable_sort(cell.begin(), cell.end(), surer);
    for (std::size_t i = 0; i < cell.size(); ++i) ranked.emplace_back(i, cell[i]);
  }
  std::stable_sort(ranked.begin(), ranked.end(), [&](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first : surer(a.second, b.second);
  });
  ranked.resize(std::min(ranked.size(), static_cast<std::size_t>(count)));
  std::vector<CertainPixel> spread;
  spread.reserve(ranked.size());
  for (const auto& [rank, pixel] : ranked) spread.push_back(pixel);
  return spread;
}

/// The points around one, which is among them.
struct Neighbourhood {
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< m^2, frame `ref`.
  Eigen::Matrix2d in_image = Eigen::Matrix2d::Zero();    ///< Of their pixels, px^2.
};

Neighbourhood neighbourhoodOf(const KeyframeDepthMap& keyframe, const CertainPixel& pixel,
                              const Eigen::Vector3d& p_ref, int reach) {
  using Offset = Eigen::Matrix<double, 5, 1>;  // in space, in the image
  const DepthMap& map = keyframe.map;
  int count = 0;
  Offset sum = Offset::Zero();  // from the point: squares lose nothing
  Eigen::Matrix<double, 5, 5> squares = Eigen::Matrix<double, 5, 5>::Zero();
  const cv::Rect window = cv::Rect(pixel.x - reach, pixel.y - reach, 2 * reach + 1, 2 * reach + 1) &
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

/// Where along an edge a point lies is no measurement: its neighbour there is just the next one of
/// the same edge.
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
      std::max(options.pixel_sigma * depth / keyframe.view.fx, along_ray.norm() / kLongest);
  Eigen::Matrix3d covariance = along_ray * along_ray.transpose() + around.covariance +
                               alongEdge(around, keyframe.view, depth);
  covariance.diagonal().array() += across_m * across_m;
  return {p_ref.cast<float>(), covariance.cast<float>()};
}

/// Not where a depth is so large or small that floats do not hold its square.
bool isUsable(const RegistrationPoint& point) {
  const Eigen::LLT<Eigen::Matrix3d> llt(point.covariance.cast<double>());
  return point.p_ref.allFinite() && point.covariance.allFinite() && llt.info() == Eigen::Success;
}

float typicalSigma(std::vector<CertainPixel> pixels) {
  const auto less = [](const CertainPixel& a, const CertainPixel& b) { return a.sigma < b.sigma; };
  return upperMedian(pixels, less).sigma;
}

}  // namespace

void RegistrationCloudOptions::validate() const {
  requireOption(max_points >= 10 && max_points <= 100000, "max_points", max_points,
                "from 10 to 100000");
  requireOption(max_map_points >= max_points && max_map_points <= 1000000, "max_map_points",
                max_map_points, "from max_points to 1000000");
  requireOption(pixel_sigma > 0 && pixel_sigma <= 100, "pixel_sigma", pixel_sigma,
                "above 0, at most 100 (pixels)");
  requireOption(depth_sigmas >= 1 && depth_sigmas <= 1000, "depth_sigmas", depth_sigmas,
                "from 1 to 1000");
  requireOption(neighbourhood_px >= 1 && neighbourhood_px <= 20, "neighbourhood_px",
                neighbourhood_px, "from 1 to 20 (pixels)");
}

struct RegistrationCloud::Tree {
  pcl::KdTreeFLANN<pcl::PointXYZ> flann;
};

RegistrationCloud::RegistrationCloud(const KeyframeDepthMap& keyframe,
                                     const RegistrationCloudOptions& options)
    : view_(keyframe.view) {
  options.validate();
  const std::vector<CertainPixel> pixels =
      spreadOver(certainPixels(keyframe.map), keyframe.map.depth.size(), options.max_map_points);
  if (pixels.empty()) return;
  points_.reserve(pixels.size());
  farthest_ = std::numeric_limits<double>::infinity();
  for (const CertainPixel& pixel : pixels) {
    const RegistrationPoint point = pointOf(keyframe, pixel, options);
    if (!isUsable(point)) continue;
    points_.push_back(point);
    nearest_ = std::max<double>(nearest_, pixel.inverse_depth);
    farthest_ = std::min<double>(farthest_, pixel.inverse_depth);
  }
  if (points_.empty()) farthest_ = 0;
  num_chosen_ = std::min(points_.size(), static_cast<std::size_t>(options.max_points));
  constexpr float kLeastSigma = 1e-9F;  // 1/m: a variance may be given as 0
  px_per_inverse_depth_ = 1 / std::max(typicalSigma(pixels), kLeastSigma);
}

RegistrationCloud::~RegistrationCloud() = default;
RegistrationCloud::RegistrationCloud(RegistrationCloud&&) noexcept = default;
RegistrationCloud& RegistrationCloud::operator=(RegistrationCloud&&) noexcept = default;

Eigen::Vector3f RegistrationCloud::seenAt(const Eigen::Vector3d& p_ref) const {
  const Eigen::Vector2d pixel = view_.project(p_ref);
  return Eigen::Vector3d(pixel.x(), pixel.y(), px_per_inverse_depth_ / p_ref.z()).cast<float>();
}

bool RegistrationCloud::sees(const Eigen::Vector3d& p_ref) const {
  if (points_.empty() || !(p_ref.z() > 0)) return false;
  const double margin = kDepthMarginSigmas / px_per_inverse_depth_;
  const double inverse_depth = 1 / p_ref.z();
  if (inverse_depth > nearest_ + margin || inverse_depth < farthest_ - margin) return false;
  const Eigen::Vector2d pixel = view_.project(p_ref);
  return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() <= view_.width - 1 &&
         pixel.y() <= view_.height - 1;
}

void RegistrationCloud::makeTree() const {
  pcl::PointCloud<pcl::PointXYZ>::Ptr seen(new pcl::PointCloud<pcl::PointXYZ>);
  seen->reserve(points_.size());
  for (const RegistrationPoint& point : points_) {
    const Eigen::Vector3f at = seenAt(point.p_ref.cast<double>());
    seen->push_back({at.x(), at.y(), at.z()});
  }
  tree_ = std::make_unique<Tree>();
  tree_->flann.setInputCloud(seen);
}

std::optional<std::size_t> RegistrationCloud::nearest(const Eigen::Vector3d& p_ref,
                                                      double max_distance_px) const {
  if (points_.empty() || !(p_ref.z() > 0)) return std::nullopt;
  const Eigen::Vector3f seen = seenAt(p_ref);
  const auto margin = static_cast<float>(max_distance_px);
  const auto within = [&](float at, int size) {
    return at >= -margin && at <= static_cast<float>(size - 1) + margin;
  };
  if (!within(seen.x(), view_.width) || !within(seen.y(), view_.height)) return std::nullopt;
  if (!tree_) makeTree();
  pcl::Indices index(1);
  std::vector<float> squared_distance(1);
  tree_->flann.nearestKSearch({seen.x(), seen.y(), seen.z()}, 1, index, squared_distance);
  if (!(squared_distance.front() <= margin * margin)) return std::nullopt;
  return static_cast<std::size_t>(index.front());
}

void RegistrationCloud::releaseTree() const { tree_.reset(); }

}  // namespace efm
