// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "tracking_stub/random/random_numbers.h"
#include "tracking_stub/scenes/painting.h"
#include "tracking_stub/scenes/scene.h"

namespace efm {

/// Parts of rooms and streets. Frame `world`: z up.

/// Adds a box on the ground, rotated about the vertical.
void addStandingBox(Scene& scene, const Eigen::Vector3d& foot, const Eigen::Vector3d& size_m,
                    double yaw_deg, const Scene::Painter& paint);

/// Adds an upright pole on the ground.
void addStandingPole(Scene& scene, const Eigen::Vector3d& foot, double radius_m, double length_m,
                     const Scene::Painter& paint);

/// Adds a rectangle in equal panels with sides of at most `max_side_m`. Each panel has its own
/// painting, which limits the memory of a painting.
void addPanels(Scene& scene, const Rectangle& rectangle, double max_side_m,
               const Scene::Painter& paint);

/// A wall of a room with space for furniture before it: x along the wall, y into the room, z up.
struct FurnishedWall {
  Rigid3 T_world_wall;  ///< Origin: on the floor, at the left end of the wall, seen from inside.
  double length_m = 5;
  double height_m = 2.6;
  double depth_m = 0.6;  ///< Max depth of the furniture, at least 0.4.
  double nearest_m = 1;  ///< The shortest distance of the furniture to a camera.
};

/// Adds random furniture along a wall: cupboards, tables, shelves with objects, lamps and pictures.
void furnishWall(Scene& scene, const FurnishedWall& wall, Painting& painting,
                 RandomNumbers& random);

}  // namespace efm
