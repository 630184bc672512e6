// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "tracking_stub/scenes/scene.h"

namespace efm {

/// The viewing rays (X/Z, Y/Z) that will be cast, frame `cam`.
struct RayBounds {
  Eigen::Vector2d min = {-1, -1};
  Eigen::Vector2d max = {1, 1};
};

/// What a camera ray met: the surface and its inverse z-depth (1/m), -1 and 0 where nothing.
struct ViewHit {
  int surface = -1;
  double inverse_depth = 0;
};

/// A scene as seen from one pose, for casting every pixel's ray.
///
/// On a plane the inverse depth and the plane's coordinates over depth are linear in the ray
/// (X/Z, Y/Z), so a rectangle is three linear functions and a hit needs no division. The rays
/// within the bounds are sorted into tiles; a tile knows the surfaces that can be seen in it,
/// nearest first. Rays beyond the bounds are slower, not wrong. Queries are thread-safe.
class SceneView {
 public:
  /// @param scene outlives the view.
  SceneView(const Scene& scene, const Rigid3& T_world_cam, const RayBounds& bounds = {});

  /// The first surface on the ray (X/Z, Y/Z).
  ViewHit cast(const Eigen::Vector2d& ray) const;

  /// The place of a hit of this ray.
  SurfacePoint placeOf(const ViewHit& hit, const Eigen::Vector2d& ray) const;

  /// Log intensity of a hit of this ray, blurred with a standard deviation of half a pixel;
  /// 0 where nothing was met.
  /// @param pixel_pitch size of a pixel in units of the ray: about 1/f.
  float logIntensity(const ViewHit& hit, const Eigen::Vector2d& ray, double pixel_pitch) const;

 private:
  // Coefficients of X/Z, Y/Z and 1.
  struct Facet {
    int surface;
    Eigen::Vector3d inverse_depth;
    Eigen::Vector3d u_over_depth;
    Eigen::Vector3d v_over_depth;
    double width_m, height_m;
  };
  struct Candidate {
    int facet;
    double max_inverse_depth;  // in its tile
  };

  void fillTile(const Eigen::Vector2d& center, const Eigen::Vector2d& half_size,
                std::vector<Candidate>& tile) const;
  const std::vector<Candidate>& tileOf(const Eigen::Vector2d& ray) const;

  const Scene* scene_;
  RayBounds bounds_;
  Eigen::Vector2d tiles_per_ray_;
  std::vector<Facet> facets_;                  // those that face the camera
  std::vector<int> facet_of_;                  // per surface; -1
  std::vector<std::vector<Candidate>> tiles_;  // row-major; the last one serves all other rays
};

}  // namespace efm
