// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "tracking_stub/random/random_numbers.h"
#include "tracking_stub/scenes/painting.h"
#include "tracking_stub/scenes/scene.h"

namespace efm {

/// What rooms and streets are put together from. Frame `world`: z up.

/// A box that stands on a ground, turned around the vertical.
void addStandingBox(Scene& scene, const Eigen::Vector3d& foot, const Eigen::Vector3d& size_m,
                    double yaw_deg, const Scene::Painter& paint);

/// A pole that stands on a ground, upright.
void addStandingPole(Scene& scene, const Eigen::Vector3d& foot, double radius_m, double length_m,
                     const Scene::Painter& paint);

/// A rectangle in equal parts of at most `max_side_m`, each painted on its own: as panels or
/// posters, and so that no single painting grows beyond memory.
void addPanels(Scene& scene, const Rectangle& rectangle, double max_side_m,
               const Scene::Painter& paint);

/// A wall of a room with room for furniture before it: x along the wall, y into the room, z up.
struct FurnishedWall {
  Rigid3 T_world_wall;  ///< Origin: on the floor, at the end of the wall that is left from inside.
  double length_m = 5;
  double height_m = 2.6;
  double depth_m = 0.6;  ///< Nothing stands out farther into the room. At least 0.4.
  double nearest_m = 1;  ///< The nearest that the furniture is seen from.
};

/// Cupboards, tables, shelves with things on them, lamps and pictures along a wall; at random.
void furnishWall(Scene& scene, const FurnishedWall& wall, Painting& painting,
                 RandomNumbers& random);

}  // namespace efm
