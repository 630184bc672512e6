// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>
#include <memory>

#include "tracking_stub/motion/smooth_motion.h"
#include "tracking_stub/presets/preset_rigs.h"
#include "tracking_stub/presets/presets.h"
#include "tracking_stub/scenes/room_scene.h"

namespace efm {

Simulation makeHdStereo(std::uint64_t seed) {
  RoomOptions room;
  room.size_m = {4.8, 4.2, 2.6};
  room.furniture_depth_m = 0.7;
  room.nearest_m = 1.8;  // edges are a little softer on nearer surfaces
  room.focal_px = 900;
  room.seed = seed;

  CameraModel model = makePinhole(1280, 720, room.focal_px);
  model.distortion = DistortionModel::kRadtan;
  model.coefficients = {-0.10, 0.06, 0.0004, -0.0006};

  SmoothMotionOptions motion;
  motion.start_ns = kPresetStartNs;
  motion.T_world_center.rotation =
      lookingAlongY() * Eigen::AngleAxisd(radians(-8), Eigen::Vector3d::UnitX());
  motion.T_world_center.translation = {0.3, 0.1, 1.3};
  motion.velocity = {0.2, 0, 0.05};
  motion.translation[1] = {{0.04, 0.8, 0.5}};
  motion.rotation[2] = {{radians(1.0), 0.7, 1.9}};

  Simulation simulation = emptyPreset(0.8, 0.16, seed);
  simulation.scene = makeRoom(room);
  simulation.rig = makeStereoRig(model, 0.12);
  simulation.rig.cameras[1].model.fx = simulation.rig.cameras[1].model.fy = 904;
  simulation.rig.cameras[1].model.coefficients = {-0.11, 0.07, -0.0003, 0.0005};
  simulation.motion = std::make_shared<SmoothMotion>(motion);
  simulation.max_step_px = 0.5;  // misplaces an edge by 0.04 pixels at most
  return simulation;
}

}  // namespace efm
