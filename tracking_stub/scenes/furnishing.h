// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <cstdint>

#include "tracking_stub/random/random_numbers.h"
#include "tracking_stub/scenes/scene.h"

namespace efm {

struct PaintingOptions {
  std::uint64_t seed = 0;
  double focal_px = 226;   ///< Longest focal length of the cameras: a pixel covers depth / focal.
  double coverage = 0.28;  ///< Number of clutter's shapes per feature x feature.
  /// Minimum size of a texel, metres. It limits the memory of large surfaces. Edges are softer if
  /// the distance is below 2 x texel x focal.
  double min_texel_m = 0;
};

/// Paints the surfaces of a scene, each with its own seed: the n-th surface depends only on n and
/// the seed. This object must outlive the painters that it returns.
class Painting {
 public:
  explicit Painting(const PaintingOptions& options)
      : options_(options), seed_(options.seed * 1000) {}

  /// Paints clutter: sharp blocks, triangles, polygons and bars of all orientations and many
  /// contrasts on an even ground. Most edges are farther apart than the blur of a pixel, so events
  /// concentrate on edges.
  /// @param nearest_m the shortest distance to a camera. A texel is half a pixel at this distance:
  /// then the blur of the finest texture level is half a pixel.
  /// @param feature_m mean size of a shape, and mean distance of shapes.
  /// @param contrast maximum difference in log intensity between a shape and the ground.
  Scene::Painter clutter(double nearest_m, double feature_m, double contrast = 0.9);

  /// Paints rings around a pole, in two tones. All facets are equal.
  /// @param tone log intensity of the first ring; the second ring is darker by `contrast`.
  Scene::Painter rings(double nearest_m, double band_m, float tone, float contrast) const;

 private:
  double texelFor(double nearest_m) const;

  PaintingOptions options_;
  std::uint64_t seed_;
};

/// Parts of rooms and streets. Frame `world`: z up.

/// Adds a box on the ground, rotated about the vertical by `yaw_deg`.
void addStandingBox(Scene& scene, const Eigen::Vector3d& foot, const Eigen::Vector3d& size_m,
                    double yaw_deg, const Scene::Painter& paint);

/// Adds an upright pole on the ground.
void addStandingPole(Scene& scene, const Eigen::Vector3d& foot, double radius_m, double length_m,
                     const Scene::Painter& paint);

/// Adds a rectangle as equal panels with sides of at most `max_side_m`. Each panel has its own
/// painting, which limits the memory per painting.
void addPanels(Scene& scene, const Rectangle& rectangle, double max_side_m,
               const Scene::Painter& paint);

/// A wall of a room with space for furniture before it: x along the wall, y into the room, z up.
struct FurnishedWall {
  Rigid3 T_world_wall;  ///< Origin: on the floor, at the wall's left end (seen from inside).
  double length_m = 5;
  double height_m = 2.6;
  double depth_m = 0.6;  ///< Maximum depth of the furniture, at least 0.4.
  double nearest_m = 1;  ///< The shortest distance of the furniture to a camera.
};

/// Adds random furniture along a wall: cupboards, tables, shelves with objects, lamps and pictures.
void furnishWall(Scene& scene, const FurnishedWall& wall, Painting& painting,
                 RandomNumbers& random);

}  // namespace efm
