// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>
#include <memory>

#include "tracking_stub/motion/smooth_motion.h"
#include "tracking_stub/presets/preset_rigs.h"
#include "tracking_stub/presets/presets.h"
#include "tracking_stub/scenes/painting.h"

namespace efm {
namespace {

using Eigen::Vector3d;

/// A board or box before the camera, its front rotated to the right by `right_deg`.
void addBoard(Scene& scene, const Vector3d& center, const Vector3d& size_m, double right_deg,
              const Scene::Painter& paint) {
  Rigid3 T_world_board;
  T_world_board.translation = center;
  T_world_board.rotation = Eigen::AngleAxisd(radians(right_deg), Vector3d::UnitY()) *
                           Eigen::AngleAxisd(radians(0.3 * right_deg), Vector3d::UnitZ());
  scene.addBox(T_world_board, size_m, paint);
}

Scene sliderScene(std::uint64_t seed, double focal_px) {
  Painting painting(PaintingOptions{seed, focal_px});
  Scene scene;
  // The wall: x right, y down. Its normal, x cross -y, points to the camera.
  scene.addRectangle({{-2, 1.5, 2.3}, Vector3d::UnitX(), -Vector3d::UnitY(), 4, 3},
                     painting.clutter(2.3, 0.2));
  addBoard(scene, {-0.62, 0.28, 1.9}, {0.42, 0.5, 0.1}, 20, painting.clutter(1.7, 0.14));
  addBoard(scene, {0.58, -0.22, 1.75}, {0.4, 0.34, 0.06}, -25, painting.clutter(1.6, 0.13));
  addBoard(scene, {0.02, -0.3, 1.5}, {0.3, 0.26, 0.2}, 30, painting.clutter(1.3, 0.11));
  addBoard(scene, {0.36, 0.32, 1.45}, {0.5, 0.3, 0.05}, 28, painting.clutter(1.3, 0.12));
  addBoard(scene, {-0.5, -0.36, 1.6}, {0.4, 0.3, 0.08}, -22, painting.clutter(1.4, 0.12));
  addBoard(scene, {-0.34, -0.1, 1.1}, {0.16, 0.3, 0.12}, 15, painting.clutter(0.95, 0.08));
  addBoard(scene, {0.3, 0.2, 0.95}, {0.2, 0.18, 0.1}, -18, painting.clutter(0.8, 0.07));
  addBoard(scene, {-0.06, 0.14, 0.68}, {0.1, 0.1, 0.04}, 12, painting.clutter(0.6, 0.045));
  addBoard(scene, {-0.2, 0.13, 0.62}, {0.06, 0.12, 0.05}, -30, painting.clutter(0.55, 0.04));
  return scene;
}

}  // namespace

Simulation makeSlider(std::uint64_t seed) {
  constexpr double kFocalPx = 335;
  constexpr double kSpeed = 0.32;  // m/s
  constexpr double kDurationS = 2;
  RigCamera camera;
  camera.model = makePinhole(240, 180, kFocalPx);
  camera.model.cx = 129.9;
  camera.model.cy = 99.2;
  camera.model.distortion = DistortionModel::kRadtan;
  camera.model.coefficients = {-0.1386, 0.0934, -0.0003, 0.0002};
  SmoothMotionOptions motion;
  motion.start_ns = kPresetStartNs;
  motion.T_world_center.translation = {-0.5 * kSpeed * kDurationS, 0, 0};
  motion.velocity = {kSpeed, 0, 0};
  Simulation simulation = emptyPreset(kDurationS, 0.21, seed);
  simulation.scene = sliderScene(seed, kFocalPx);
  simulation.rig.cameras = {camera};
  simulation.motion = std::make_shared<SmoothMotion>(motion);
  return simulation;
}

}  // namespace efm
