// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/scenes/scenes.h"

#include <Eigen/Geometry>

#include <algorithm>

#include "mapping/base/named_choice.h"
#include "mapping/geometry/rigid3.h"
#include "tracking_stub/random/random_numbers.h"
#include "tracking_stub/scenes/furnishing.h"

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

Scene makePoles(const PolesOptions& options) {
  using Eigen::Vector3d;
  requireOption(options.nearest_m > 0, "nearest_m", options.nearest_m, "above 0");
  requireOption(options.farthest_m > options.nearest_m, "farthest_m", options.farthest_m,
                "above nearest_m");
  requireOption(options.wall_m > options.farthest_m, "wall_m", options.wall_m, "above farthest_m");
  Painting painting(PaintingOptions{options.seed, options.focal_px});
  RandomNumbers random(options.seed, 1);
  Scene scene;
  const double half_wall = 1.6 * options.half_view * options.wall_m + 0.5;
  addPanels(scene,
            {{-half_wall, options.wall_m, -half_wall},
             Vector3d::UnitX(),
             Vector3d::UnitZ(),
             2 * half_wall,
             2 * half_wall},
            1.5, painting.clutter(options.wall_m - 0.3, 0.1 * options.wall_m));
  for (int i = 0; i < options.poles; ++i) {
    // Even in inverse depth. Neighbours in depth are far apart to the side, so that no pole hides
    // another.
    const double fraction = (i + random.uniform(0.2, 0.8)) / options.poles;
    const double depth = 1 / ((1 - fraction) / options.nearest_m + fraction / options.farthest_m);
    const double side = (i * 5 % options.poles + random.uniform(0.2, 0.8)) / options.poles;
    Rigid3 T_world_pole;
    T_world_pole.translation = {(2 * side - 1) * 0.9 * options.half_view * depth, depth, 0};
    // The pole leans to the side: its depth is constant.
    T_world_pole.rotation = Eigen::AngleAxisd(random.uniform(-0.45, 0.45), Vector3d::UnitY());
    // 3 to 6 pixels wide.
    const double radius = random.uniform(1.5, 3) * depth / options.focal_px;
    const auto tone =
        static_cast<float>(i % 2 == 0 ? random.uniform(0.9, 1.3) : random.uniform(-1.3, -0.9));
    scene.addPole({T_world_pole, radius, 2.6 * options.half_view * depth},
                  painting.rings(depth, 0.12 * depth, tone, i % 2 == 0 ? 0.5F : -0.5F));
  }
  return scene;
}

}  // namespace efm
