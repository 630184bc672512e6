// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/rendering/scene_view.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

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

/// The max of a linear function on a tile.
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
    if (!(height > 0)) continue;  // visible from behind only
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
      // Slightly enlarged: with rounding errors, too, the tile of a ray must list its surface.
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
    if (candidate.max_inverse_depth <= hit.inverse_depth) break;  // all others are farther
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
  const Facet& f =
      facets_[static_cast<std::size_t>(facet_of_[static_cast<std::size_t>(hit.surface)])];
  return {hit.surface, static_cast<float>(at(f.u_over_depth, ray) / hit.inverse_depth),
          static_cast<float>(at(f.v_over_depth, ray) / hit.inverse_depth)};
}

float SceneView::logIntensity(const ViewHit& hit, const Eigen::Vector2d& ray,
                              double pixel_pitch) const {
  if (hit.surface < 0) return 0;
  const Facet& f =
      facets_[static_cast<std::size_t>(facet_of_[static_cast<std::size_t>(hit.surface)])];
  const double depth = 1 / hit.inverse_depth;
  const double u = at(f.u_over_depth, ray) * depth;
  const double v = at(f.v_over_depth, ray) * depth;
  // The derivative of the surface point by the ray. An oblique pixel is long in one direction: the
  // blur is the root mean square of both directions.
  const Eigen::Vector2d du = (f.u_over_depth - u * f.inverse_depth).head<2>() * depth;
  const Eigen::Vector2d dv = (f.v_over_depth - v * f.inverse_depth).head<2>() * depth;
  const double metres_per_ray = std::sqrt(0.5 * (du.squaredNorm() + dv.squaredNorm()));
  return scene_->texture(hit.surface).sample(u, v, 0.5 * pixel_pitch * metres_per_ray);
}

}  // namespace efm
