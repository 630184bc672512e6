// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/rendering/frame_renderer.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "mapping/base/option.h"
#include "mapping/geometry/lens.h"

namespace efm {
namespace {

constexpr int kTileColumns = 24;
constexpr int kTileRows = 18;

std::size_t tileIndex(int column, int row) {
  return static_cast<std::size_t>(row) * kTileColumns + static_cast<std::size_t>(column);
}

double at(const Eigen::Vector3d& linear, const Eigen::Vector2d& ray) {
  return linear.x() * ray.x() + linear.y() * ray.y() + linear.z();
}

/// Returns the maximum of a linear function on a tile.
double maximum(const Eigen::Vector3d& linear, const Eigen::Vector2d& center,
               const Eigen::Vector2d& half_size) {
  return at(linear, center) + std::abs(linear.x()) * half_size.x() +
         std::abs(linear.y()) * half_size.y();
}

}  // namespace

SceneView::SceneView(const Scene& scene, const Rigid3& T_world_cam, const RayBounds& bounds)
    : scene_(&scene),
      bounds_(bounds),
      tiles_per_ray_(Eigen::Array2d(kTileColumns, kTileRows) / (bounds.max - bounds.min).array()),
      facet_of_(static_cast<std::size_t>(scene.size()), -1) {
  const Eigen::Quaterniond R_cam_world = T_world_cam.rotation.conjugate();
  for (int surface = 0; surface < scene.size(); ++surface) {
    const Rectangle& r = scene.rectangle(surface);
    const Eigen::Vector3d center_from_corner = T_world_cam.translation - r.corner;
    const double height = r.normal().dot(center_from_corner);
    if (!(height > 0)) continue;  // the camera is behind the surface
    Facet facet;
    facet.surface = surface;
    facet.inverse_depth = R_cam_world * r.normal() / -height;
    facet.u_over_depth =
        R_cam_world * r.axis_u + r.axis_u.dot(center_from_corner) * facet.inverse_depth;
    facet.v_over_depth =
        R_cam_world * r.axis_v + r.axis_v.dot(center_from_corner) * facet.inverse_depth;
    facet.width_m = r.width_m;
    facet.height_m = r.height_m;
    facet_of_[static_cast<std::size_t>(surface)] = static_cast<int>(facets_.size());
    facets_.push_back(facet);
  }

  tiles_.resize(kTileColumns * kTileRows + 1);
  const Eigen::Vector2d tile_size = tiles_per_ray_.cwiseInverse();
  for (int row = 0; row < kTileRows; ++row) {
    for (int column = 0; column < kTileColumns; ++column) {
      const Eigen::Vector2d center =
          bounds.min + tile_size.cwiseProduct(Eigen::Vector2d(column + 0.5, row + 0.5));
      // Slightly enlarged: in spite of rounding errors, a ray's tile must list the ray's surface.
      fillTile(center, 0.5001 * tile_size, tiles_[tileIndex(column, row)]);
    }
  }
  for (std::size_t i = 0; i < facets_.size(); ++i) {
    tiles_.back().push_back({static_cast<int>(i), std::numeric_limits<double>::infinity()});
  }
}

void SceneView::fillTile(const Eigen::Vector2d& center, const Eigen::Vector2d& half_size,
                         std::vector<Candidate>& tile) const {
  for (std::size_t i = 0; i < facets_.size(); ++i) {
    const Facet& f = facets_[i];
    const double nearest = maximum(f.inverse_depth, center, half_size);
    const bool visible =
        nearest > 0 && maximum(f.u_over_depth, center, half_size) >= 0 &&
        maximum(f.v_over_depth, center, half_size) >= 0 &&
        maximum(f.width_m * f.inverse_depth - f.u_over_depth, center, half_size) >= 0 &&
        maximum(f.height_m * f.inverse_depth - f.v_over_depth, center, half_size) >= 0;
    if (visible) tile.push_back({static_cast<int>(i), nearest});
  }
  std::stable_sort(tile.begin(), tile.end(), [](const Candidate& a, const Candidate& b) {
    return a.max_inverse_depth > b.max_inverse_depth;
  });
}

const std::vector<SceneView::Candidate>& SceneView::tileOf(const Eigen::Vector2d& ray) const {
  const double x = (ray.x() - bounds_.min.x()) * tiles_per_ray_.x();
  const double y = (ray.y() - bounds_.min.y()) * tiles_per_ray_.y();
  if (!(x >= 0 && x < kTileColumns && y >= 0 && y < kTileRows)) return tiles_.back();
  return tiles_[tileIndex(static_cast<int>(x), static_cast<int>(y))];
}

ViewHit SceneView::cast(const Eigen::Vector2d& ray) const {
  ViewHit hit;
  for (const Candidate& candidate : tileOf(ray)) {
    if (candidate.max_inverse_depth <= hit.inverse_depth) break;  // the rest is farther away
    const Facet& f = facets_[static_cast<std::size_t>(candidate.facet)];
    const double inverse_depth = at(f.inverse_depth, ray);
    if (!(inverse_depth > hit.inverse_depth)) continue;
    const double u_over_depth = at(f.u_over_depth, ray);
    if (u_over_depth < 0 || u_over_depth > f.width_m * inverse_depth) continue;
    const double v_over_depth = at(f.v_over_depth, ray);
    if (v_over_depth < 0 || v_over_depth > f.height_m * inverse_depth) continue;
    hit = {f.surface, inverse_depth};
  }
  return hit;
}

SurfacePoint SceneView::surfacePointOf(const ViewHit& hit, const Eigen::Vector2d& ray) const {
  if (hit.surface < 0) return {};
  const Facet& f = facetOf(hit);
  return {hit.surface, static_cast<float>(at(f.u_over_depth, ray) / hit.inverse_depth),
          static_cast<float>(at(f.v_over_depth, ray) / hit.inverse_depth)};
}

float SceneView::logIntensity(const ViewHit& hit, const Eigen::Vector2d& ray,
                              double pixel_pitch) const {
  if (hit.surface < 0) return 0;
  const Facet& f = facetOf(hit);
  const double depth = 1 / hit.inverse_depth;
  const double u = at(f.u_over_depth, ray) * depth;
  const double v = at(f.v_over_depth, ray) * depth;
  // The derivative of the surface point by the ray. A pixel on an oblique surface is long in one
  // direction: the blur is the root mean square of both directions.
  const Eigen::Vector2d du = (f.u_over_depth - u * f.inverse_depth).head<2>() * depth;
  const Eigen::Vector2d dv = (f.v_over_depth - v * f.inverse_depth).head<2>() * depth;
  const double metres_per_ray = std::sqrt(0.5 * (du.squaredNorm() + dv.squaredNorm()));
  return scene_->texture(hit.surface).sample(u, v, 0.5 * pixel_pitch * metres_per_ray);
}

PixelRays::PixelRays(const CameraModel& model) : width_(model.width), height_(model.height) {
  requireOption(width_ >= 2, "width", width_, "at least 2 pixels to be simulated");
  requireOption(height_ >= 2, "height", height_, "at least 2 pixels to be simulated");
  model.validate();
  // The mapping's table is not used: it has floats, whose rounding would be an error of the truth.
  const LensInverse lens(model);
  std::vector<Eigen::Vector2d> table;
  table.reserve(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) table.push_back(lens.rayThrough(x, y));
  }
  const auto at = [&](int x, int y) -> const Eigen::Vector2d& {
    return table[static_cast<std::size_t>(y * width_ + x)];
  };
  const auto has_ray = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < width_ && y < height_ && !std::isnan(at(x, y).x());
  };
  rays_.reserve(table.size());
  bounds_.min.setConstant(std::numeric_limits<double>::infinity());
  bounds_.max = -bounds_.min;
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      PixelRay& pixel = rays_.emplace_back();
      if (!has_ray(x, y)) continue;
      // Differences use only neighbours that have a ray, inside the border of sensor and lens.
      const int left = has_ray(x - 1, y) ? x - 1 : x;
      const int right = has_ray(x + 1, y) ? x + 1 : x;
      const int up = has_ray(x, y - 1) ? y - 1 : y;
      const int down = has_ray(x, y + 1) ? y + 1 : y;
      if (left == right || up == down) continue;
      pixel.ray = at(x, y);
      pixel.per_x = (at(right, y) - at(left, y)) / (right - left);
      pixel.per_y = (at(x, down) - at(x, up)) / (down - up);
      pixel.pitch = std::sqrt(0.5 * (pixel.per_x.squaredNorm() + pixel.per_y.squaredNorm()));
      const Eigen::Vector2d half_pixel = 0.5 * (pixel.per_x.cwiseAbs() + pixel.per_y.cwiseAbs());
      bounds_.min = bounds_.min.cwiseMin(pixel.ray - half_pixel);
      bounds_.max = bounds_.max.cwiseMax(pixel.ray + half_pixel);
    }
  }
  requireOption((bounds_.min.array() < bounds_.max.array()).all(), "pixels with a viewing ray", 0,
                "some: the lens projects no ray to the sensor");
}

namespace {

constexpr int kSamples = 16;

/// Returns Hammersley's points. No two points have the same row or column, so an edge of any
/// orientation covers a pixel in steps of 1/16.
std::array<Eigen::Vector2d, kSamples> makeSampleOffsets() {
  std::array<Eigen::Vector2d, kSamples> offsets;
  for (int i = 0; i < kSamples; ++i) {
    const int reversed = ((i & 1) << 3) | ((i & 2) << 1) | ((i & 4) >> 1) | ((i & 8) >> 3);
    offsets[static_cast<std::size_t>(i)] = {(i + 0.5) / kSamples - 0.5,
                                            (reversed + 0.5) / kSamples - 0.5};
  }
  return offsets;
}

const std::array<Eigen::Vector2d, kSamples> kSampleOffsets = makeSampleOffsets();

bool isSilhouette(const cv::Mat1i& surface, int x, int y) {
  const int left = std::max(x - 1, 0);
  const int right = std::min(x + 1, surface.cols - 1);
  const int down = std::min(y + 1, surface.rows - 1);
  const int center = surface(y, x);
  for (int row = std::max(y - 1, 0); row <= down; ++row) {
    const int* pixels = surface.ptr<int>(row);
    for (int column = left; column <= right; ++column) {
      if (pixels[column] != center) return true;
    }
  }
  return false;
}

template <typename RowTask>
void forEachRow(int rows, const RowTask& task) {
  tbb::parallel_for(tbb::blocked_range<int>(0, rows, 8),
                    [&task](const tbb::blocked_range<int>& range) {
                      for (int y = range.begin(); y < range.end(); ++y) task(y);
                    });
}

}  // namespace

void FrameRenderer::render(const SceneView& view, Frame& frame) const {
  frame.log_intensity.create(rays_.height(), rays_.width());
  frame.surface.create(rays_.height(), rays_.width());
  forEachRow(rays_.height(), [&](int y) { castRow(view, y, frame); });
  forEachRow(rays_.height(), [&](int y) { averageSilhouettes(view, y, frame); });
}

void FrameRenderer::castRow(const SceneView& view, int y, Frame& frame) const {
  float* log_intensity = frame.log_intensity.ptr<float>(y);
  int* surface = frame.surface.ptr<int>(y);
  for (int x = 0; x < rays_.width(); ++x) {
    const PixelRay& pixel = rays_(x, y);
    const ViewHit hit = view.cast(pixel.ray);
    surface[x] = hit.surface;
    log_intensity[x] = view.logIntensity(hit, pixel.ray, pixel.pitch);
  }
}

void FrameRenderer::averageSilhouettes(const SceneView& view, int y, Frame& frame) const {
  float* log_intensity = frame.log_intensity.ptr<float>(y);
  for (int x = 0; x < rays_.width(); ++x) {
    if (!isSilhouette(frame.surface, x, y)) continue;
    const PixelRay& pixel = rays_(x, y);
    float sum = 0;
    for (const Eigen::Vector2d& offset : kSampleOffsets) {
      const Eigen::Vector2d ray = pixel.at(offset.x(), offset.y());
      sum += view.logIntensity(view.cast(ray), ray, pixel.pitch);
    }
    log_intensity[x] = sum / kSamples;
  }
}

SurfacePoint FrameRenderer::sourceOf(const SceneView& view, const Frame& frame, int x,
                                     int y) const {
  const PixelRay& pixel = rays_(x, y);
  Eigen::Vector2d nearest_ray = pixel.ray;
  ViewHit nearest = view.cast(nearest_ray);
  if (isSilhouette(frame.surface, x, y)) {
    for (const Eigen::Vector2d& offset : kSampleOffsets) {
      const Eigen::Vector2d ray = pixel.at(offset.x(), offset.y());
      const ViewHit hit = view.cast(ray);
      if (hit.inverse_depth <= nearest.inverse_depth) continue;
      nearest = hit;
      nearest_ray = ray;
    }
  }
  return view.surfacePointOf(nearest, nearest_ray);
}

cv::Mat1f renderDepth(const Scene& scene, const Rigid3& T_world_cam, const ReferenceView& view) {
  const RayBounds bounds = {view.pointAt(-0.5, -0.5, 1).head<2>(),
                            view.pointAt(view.width - 0.5, view.height - 0.5, 1).head<2>()};
  const SceneView scene_view(scene, T_world_cam, bounds);
  cv::Mat1f depth(view.height, view.width, 0.0F);
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      const ViewHit hit = scene_view.cast(view.pointAt(x, y, 1).head<2>());
      if (hit.surface >= 0) depth(y, x) = static_cast<float>(1 / hit.inverse_depth);
    }
  }
  return depth;
}

}  // namespace efm
