// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/refinement/wall_thickness.h"

#include <algorithm>
#include <cmath>

#include "maps/metrics/sample_statistics.h"

namespace efm::studies {
namespace {

constexpr double kMaxBehindM = 0.01;  // of surfaces behind a wall
constexpr double kMaxDistanceM = 0.3;
constexpr double kBorderM = 0.3;

std::vector<Eigen::Vector3d> cornersOf(const Rectangle& rectangle) {
  return {rectangle.pointAt(0, 0), rectangle.pointAt(rectangle.width_m, 0),
          rectangle.pointAt(0, rectangle.height_m),
          rectangle.pointAt(rectangle.width_m, rectangle.height_m)};
}

double heightAbove(const Rectangle& plane, const Eigen::Vector3d& p_world) {
  return plane.normal().dot(p_world - plane.corner);
}

bool isBehindAll(const Rectangle& plane, const Scene& scene) {
  for (int surface = 0; surface < scene.size(); ++surface) {
    for (const Eigen::Vector3d& corner : cornersOf(scene.rectangle(surface))) {
      if (heightAbove(plane, corner) < -kMaxBehindM) return false;
    }
  }
  return true;
}

bool isSamePlane(const Rectangle& a, const Rectangle& b) {
  constexpr double kSameM = 1e-6;
  constexpr double kSameDirection = 1 - 1e-9;
  return a.normal().dot(b.normal()) > kSameDirection && std::abs(heightAbove(a, b.corner)) < kSameM;
}

/// Extends the rectangle around another one in its plane.
void extend(Rectangle& whole, const Rectangle& panel) {
  double u0 = 0, u1 = whole.width_m, v0 = 0, v1 = whole.height_m;
  for (const Eigen::Vector3d& corner : cornersOf(panel)) {
    const Eigen::Vector3d from_corner = corner - whole.corner;
    u0 = std::min(u0, from_corner.dot(whole.axis_u));
    u1 = std::max(u1, from_corner.dot(whole.axis_u));
    v0 = std::min(v0, from_corner.dot(whole.axis_v));
    v1 = std::max(v1, from_corner.dot(whole.axis_v));
  }
  whole.corner = whole.pointAt(u0, v0);
  whole.width_m = u1 - u0;
  whole.height_m = v1 - v0;
}

bool isInside(const Rectangle& whole, const Eigen::Vector3d& p_world) {
  const Eigen::Vector3d from_corner = p_world - whole.corner;
  const double u = from_corner.dot(whole.axis_u);
  const double v = from_corner.dot(whole.axis_v);
  return u >= kBorderM && u <= whole.width_m - kBorderM && v >= kBorderM &&
         v <= whole.height_m - kBorderM;
}

}  // namespace

std::vector<Wall> wallsOf(const Scene& scene) {
  std::vector<Wall> walls;
  for (int surface = 0; surface < scene.size(); ++surface) {
    const Rectangle& rectangle = scene.rectangle(surface);
    const auto same = std::find_if(walls.begin(), walls.end(), [&](const Wall& wall) {
      return isSamePlane(wall.whole, rectangle);
    });
    if (same != walls.end()) {
      extend(same->whole, rectangle);
      same->surfaces.push_back(surface);
    } else if (isBehindAll(rectangle, scene)) {
      walls.push_back({rectangle, {surface}});
    }
  }
  return walls;
}

WallThickness thicknessOf(const Wall& wall, const std::vector<NearPoint>& points) {
  std::vector<double> heights_m;
  for (const NearPoint& point : points) {
    if (point.nearest.distance_m > kMaxDistanceM || !isInside(wall.whole, point.p_world)) continue;
    if (std::find(wall.surfaces.begin(), wall.surfaces.end(), point.nearest.surface) !=
        wall.surfaces.end()) {
      heights_m.push_back(heightAbove(wall.whole, point.p_world));
    }
  }
  if (heights_m.empty()) return {};
  return {0.5 * (quantileOf(heights_m, 0.84) - quantileOf(heights_m, 0.16)), heights_m.size()};
}

WallThickness meanThickness(const std::vector<Wall>& walls, const std::vector<NearPoint>& points) {
  WallThickness mean;
  for (const Wall& wall : walls) {
    const WallThickness one = thicknessOf(wall, points);
    mean.thickness_m += one.thickness_m * static_cast<double>(one.points);
    mean.points += one.points;
  }
  if (mean.points > 0) mean.thickness_m /= static_cast<double>(mean.points);
  return mean;
}

}  // namespace efm::studies
