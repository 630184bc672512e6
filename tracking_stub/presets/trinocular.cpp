// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/presets/presets.h"

#include <Eigen/Geometry>
#include <memory>

#include "tracking_stub/motion/smooth_motion.h"
#include "tracking_stub/presets/preset_rigs.h"
#include "tracking_stub/scenes/room_scene.h"

namespace efm {
namespace {

using Eigen::Vector3d;

CameraModel makeFisheye(double focal_px, const std::vector<double>& coefficients) {
  CameraModel model = makePinhole(640, 480, focal_px);
  model.distortion = DistortionModel::kEquidistant;
  model.coefficients = coefficients;
  return model;
}

/// A rotation about y (to the right), x (up) and z (clockwise), in this order. Degrees.
Eigen::Quaterniond rotationOf(double right, double up, double clockwise) {
  return Eigen::AngleAxisd(radians(right), Vector3d::UnitY()) *
         Eigen::AngleAxisd(radians(up), Vector3d::UnitX()) *
         Eigen::AngleAxisd(radians(clockwise), Vector3d::UnitZ());
}

Rig trinocularRig(double focal_px) {
  Rig rig;
  rig.cameras.resize(3);
  rig.cameras[0].model = makeFisheye(focal_px, {-0.045, 0.012, -0.02, 0.008});
  rig.cameras[1].model = makeFisheye(410, {-0.03, -0.01, 0.006, -0.002});
  rig.cameras[1].model.cx += 4.5;
  rig.cameras[1].T_rig_cam = {rotationOf(-5, 1.5, 3), {0.16, 0.01, 0.005}};
  rig.cameras[2].model = makeFisheye(405, {-0.05, 0.02, -0.03, 0.01});
  rig.cameras[2].model.cy -= 6.25;
  rig.cameras[2].T_rig_cam = {rotationOf(-2, -5, 90), {0.08, -0.14, 0.01}};
  return rig;
}

std::shared_ptr<const Motion> trinocularMotion() {
  SmoothMotionOptions options;
  options.start_ns = kPresetStartNs;
  options.T_world_center.rotation = lookingAlongY() * rotationOf(15, -12, 0);
  options.T_world_center.translation = {-0.5, 0.2, 1.35};
  options.translation[0] = {{0.14, 0.55, 0.0}, {0.008, 1.9, 0.9}};
  options.translation[1] = {{0.12, 0.60, 1.4}, {0.006, 1.7, 2.5}};
  options.translation[2] = {{0.11, 0.60, 1.9}, {0.006, 1.5, 0.4}};
  options.rotation[0] = {{radians(1.0), 0.8, 0.3}};
  options.rotation[1] = {{radians(0.8), 0.7, 2.0}};
  options.rotation[2] = {{radians(1.5), 0.6, 1.9}};
  return std::make_shared<SmoothMotion>(options);
}

}  // namespace

Simulation makeTrinocular(std::uint64_t seed) {
  RoomOptions room;
  room.size_m = {4.6, 4.4, 2.6};
  room.furniture_depth_m = 0.8;
  room.focal_px = 400;
  room.nearest_m = 0.9;
  room.seed = seed;
  Simulation simulation = emptyPreset(1, 0.21, seed);
  simulation.scene = makeRoom(room);
  simulation.rig = trinocularRig(room.focal_px);
  simulation.motion = trinocularMotion();
  return simulation;
}

}  // namespace efm
