// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/presets/presets.h"

#include <Eigen/Geometry>
#include <memory>

#include "tracking_stub/motion/smooth_motion.h"
#include "tracking_stub/presets/preset_rigs.h"
#include "tracking_stub/scenes/furnishing.h"
#include "tracking_stub/scenes/painting.h"

namespace efm {
namespace {

using Eigen::Vector3d;

void addDeskRoom(Scene& scene, Painting& painting) {
  const Vector3d x = Vector3d::UnitX();
  const Vector3d y = Vector3d::UnitY();
  const Vector3d z = Vector3d::UnitZ();
  // Floor, back wall, left wall, right wall, ceiling. The normals point into the room.
  scene.addRectangle({{-2.2, -0.5, -0.75}, x, y, 4.4, 4.8}, painting.clutter(1.3, 0.22));
  scene.addRectangle({{-2.2, 4.1, -0.75}, x, z, 4.4, 3.6}, painting.clutter(3.2, 0.36));
  scene.addRectangle({{-2.2, -0.5, -0.75}, y, z, 4.8, 3.6}, painting.clutter(2.0, 0.30));
  scene.addRectangle({{2.2, -0.5, -0.75}, z, y, 3.6, 4.8}, painting.clutter(2.0, 0.30));
  scene.addRectangle({{-2.2, -0.5, 2.85}, y, x, 4.8, 4.4}, painting.clutter(2.0, 0.40));
}

void addDeskFurniture(Scene& scene, Painting& painting) {
  addStandingBox(scene, {-1.35, 3.1, -0.75}, {0.7, 0.45, 1.75}, 18, painting.clutter(2.4, 0.22));
  addStandingBox(scene, {0.45, 3.3, -0.75}, {0.8, 0.4, 1.15}, -12, painting.clutter(2.4, 0.22));
  addStandingBox(scene, {1.45, 2.2, -0.75}, {0.5, 0.5, 0.95}, 35, painting.clutter(1.6, 0.18));
  // The desk: its top is at z = 0.
  addStandingBox(scene, {0, 0.72, -0.05}, {1.7, 1.6, 0.05}, 0, painting.clutter(0.6, 0.13));
}

void addDeskObjects(Scene& scene, Painting& painting) {
  addStandingBox(scene, {-0.42, 1.15, 0}, {0.26, 0.20, 0.32}, 24, painting.clutter(0.7, 0.10));
  addStandingBox(scene, {0.10, 1.30, 0}, {0.30, 0.08, 0.42}, -9, painting.clutter(0.8, 0.11));
  addStandingBox(scene, {0.55, 1.05, 0}, {0.18, 0.24, 0.22}, -33, painting.clutter(0.6, 0.09));
  addStandingBox(scene, {-0.16, 0.86, 0}, {0.14, 0.11, 0.16}, 41, painting.clutter(0.6, 0.07));
  addStandingBox(scene, {0.24, 0.83, 0}, {0.22, 0.15, 0.07}, 15, painting.clutter(0.6, 0.07));
  addStandingBox(scene, {0.22, 0.83, 0.07}, {0.18, 0.13, 0.05}, -20, painting.clutter(0.6, 0.07));
  addStandingBox(scene, {-0.62, 0.80, 0}, {0.12, 0.16, 0.10}, 12, painting.clutter(0.6, 0.07));
  // A leaning board: its planes and edges are neither level nor upright.
  Rigid3 T_world_board;
  T_world_board.rotation = Eigen::AngleAxisd(radians(-30), Vector3d::UnitZ()) *
                           Eigen::AngleAxisd(radians(25), Vector3d::UnitX()) *
                           Eigen::AngleAxisd(radians(14), Vector3d::UnitY());
  T_world_board.translation = {0.62, 1.42, 0.28};
  scene.addBox(T_world_board, {0.36, 0.03, 0.48}, painting.clutter(0.8, 0.11));
}

std::shared_ptr<const Motion> deskMotion() {
  SmoothMotionOptions options;
  options.start_ns = kPresetStartNs;
  // Looks along +y and 15 degrees down; camera x is world x.
  options.T_world_center.rotation =
      lookingAlongY() * Eigen::AngleAxisd(radians(-15), Vector3d::UnitX());
  options.T_world_center.translation = {-0.05, 0, 0.68};
  // A quarter of a period apart, x and y make a circle: the camera never rests, and edges of every
  // orientation have parallax.
  options.translation[0] = {{0.09, 0.43, 0.0}, {0.010, 1.7, 0.9}};
  options.translation[1] = {{0.12, 0.48, 1.3}, {0.010, 1.9, 2.5}};
  options.translation[2] = {{0.06, 0.60, 3.6}, {0.006, 1.5, 0.4}};
  options.rotation[0] = {{radians(0.9), 0.8, 0.3}, {radians(0.2), 2.1, 1.1}};
  options.rotation[1] = {{radians(1.0), 0.7, 2.0}, {radians(0.2), 1.8, 2.0}};
  options.rotation[2] = {{radians(2.5), 0.6, 1.9}, {radians(0.4), 1.6, 0.2}};
  return std::make_shared<SmoothMotion>(options);
}

}  // namespace

Simulation makeDeskStereo(std::uint64_t seed) {
  constexpr double kFocalPx = 226;
  Simulation simulation = emptyPreset(2, 0.21, seed);
  Painting painting(PaintingOptions{seed, kFocalPx});
  addDeskRoom(simulation.scene, painting);
  addDeskFurniture(simulation.scene, painting);
  addDeskObjects(simulation.scene, painting);
  simulation.rig = makeStereoRig(makePinhole(346, 260, kFocalPx), 0.10);
  simulation.motion = deskMotion();
  return simulation;
}

}  // namespace efm
