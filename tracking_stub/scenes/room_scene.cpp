// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/scenes/room_scene.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "mapping/base/named_choice.h"
#include "mapping/geometry/rigid3.h"
#include "tracking_stub/random/random_numbers.h"
#include "tracking_stub/scenes/furnishing.h"
#include "tracking_stub/scenes/painting.h"

namespace efm {
namespace {

using Eigen::Vector3d;

constexpr double kRoomPanelM = 1.7;

/// One of the four walls. Its origin is at the left end, seen from inside.
FurnishedWall wallOf(const RoomOptions& options, int side) {
  const bool along_x = side % 2 == 0;
  const double length = along_x ? options.size_m.x() : options.size_m.y();
  const double distance = 0.5 * (along_x ? options.size_m.y() : options.size_m.x());
  // Wall 0 is at y = -width/2. Its axes are the axes of the room.
  const Eigen::Quaterniond R_world_wall(Eigen::AngleAxisd(0.5 * kPi * side, Vector3d::UnitZ()));
  FurnishedWall wall;
  wall.T_world_wall.rotation = R_world_wall;
  wall.T_world_wall.translation = R_world_wall * Vector3d(-0.5 * length, -distance, 0);
  wall.length_m = length;
  wall.height_m = options.size_m.z();
  wall.depth_m = options.furniture_depth_m;
  wall.nearest_m = options.nearest_m;
  return wall;
}

void addFloorAndCeiling(Scene& scene, const RoomOptions& options, Painting& painting) {
  const Vector3d x = Vector3d::UnitX();
  const Vector3d y = Vector3d::UnitY();
  const Vector3d half = 0.5 * options.size_m;
  addPanels(scene, {{-half.x(), -half.y(), 0}, x, y, 2 * half.x(), 2 * half.y()}, kRoomPanelM,
            painting.clutter(options.nearest_m, 0.24));
  addPanels(scene, {{-half.x(), -half.y(), 2 * half.z()}, y, x, 2 * half.y(), 2 * half.x()},
            kRoomPanelM, painting.clutter(options.nearest_m, 0.36));
}

}  // namespace

Scene makeRoom(const RoomOptions& options) {
  requireOption(options.size_m.x() >= 3 && options.size_m.y() >= 3 && options.size_m.z() >= 2,
                "room", options.size_m.transpose(), "at least 3 x 3 x 2 m");
  Painting painting(PaintingOptions{options.seed, options.focal_px});
  RandomNumbers random(options.seed, 1);
  Scene scene;
  addFloorAndCeiling(scene, options, painting);
  for (int side = 0; side < 4; ++side) {
    const FurnishedWall wall = wallOf(options, side);
    const Eigen::Quaterniond& R_world_wall = wall.T_world_wall.rotation;
    // The normal z x x is the wall's y: into the room.
    addPanels(scene,
              {wall.T_world_wall.translation, R_world_wall * Vector3d::UnitZ(),
               R_world_wall * Vector3d::UnitX(), wall.height_m, wall.length_m},
              kRoomPanelM,
              painting.clutter(options.nearest_m + 0.5 * options.furniture_depth_m, 0.32));
    furnishWall(scene, wall, painting, random);
  }
  return scene;
}

}  // namespace efm
