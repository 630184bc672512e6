// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "tracking_stub/scenes/scene.h"

namespace efm {

/// Bounds of the viewing rays (X/Z, Y/Z), frame `cam`.
struct RayBounds {
  Eigen::Vector2d min = {-1, -1};
  Eigen::Vector2d max = {1, 1};
};

/// The surface that a camera ray hits, and its inverse z-depth (1/m). -1 and 0 where there is none.
struct ViewHit {
  int surface = -1;
  double inverse_depth = 0;
};

/// A scene seen from one pose, for casting the rays of all pixels.
///
/// On a plane, the inverse depth and the plane's coordinates over depth are linear in the ray
/// (X/Z, Y/Z). So a rectangle is three linear functions, and a hit needs no division. The bounds
/// are divided into tiles. A tile lists the surfaces that are visible in it, nearest first. Rays
/// outside of the bounds are slower. Queries are thread-safe.
class SceneView {
 public:
  /// @param scene outlives the view.
  SceneView(const Scene& scene, const Rigid3& T_world_cam, const RayBounds& bounds = {});

  /// The first surface on the ray (X/Z, Y/Z). A ray that is not a number hits none.
  ViewHit cast(const Eigen::Vector2d& ray) const;

  /// The surface point of a hit of this ray.
  SurfacePoint surfacePointOf(const ViewHit& hit, const Eigen::Vector2d& ray) const;

  /// Log intensity of a hit of this ray, blurred with a standard deviation of half a pixel. 0 where
  /// the ray hits nothing.
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
  std::vector<Facet> facets_;  // the visible sides only
  std::vector<int> facet_of_;  // per surface; -1
  std::vector<std::vector<Candidate>>
      tiles_;  // row-major; the last one is for rays outside of the bounds
};

}  // namespace efm
