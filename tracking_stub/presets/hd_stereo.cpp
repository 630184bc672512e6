// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/presets/hd_stereo.h"

#include <Eigen/Geometry>
#include <memory>

#include "mapping/geometry/timestamp.h"
#include "tracking_stub/motion/smooth_motion.h"
#include "tracking_stub/presets/preset_rigs.h"
#include "tracking_stub/scenes/room_scene.h"

namespace efm {
namespace {

constexpr double kFocalPx = 900;

Rig makeRig() {
  CameraModel model = makePinhole(1280, 720, kFocalPx);
  model.distortion = DistortionModel::kRadtan;
  model.coefficients = {-0.10, 0.06, 0.0004, -0.0006};
  Rig rig = makeStereoRig(model, 0.12);
  rig.cameras[1].model.fx = rig.cameras[1].model.fy = 904;
  rig.cameras[1].model.coefficients = {-0.11, 0.07, -0.0003, 0.0005};
  return rig;
}

std::shared_ptr<const Motion> makeMotion(std::int64_t start_ns) {
  SmoothMotionOptions options;
  options.start_ns = start_ns;
  options.T_world_center.rotation =
      lookingAlongY() * Eigen::AngleAxisd(radians(-8), Eigen::Vector3d::UnitX());
  options.T_world_center.translation = {0.3, 0.1, 1.3};
  options.velocity = {0.2, 0, 0.05};
  options.translation[1] = {{0.04, 0.8, 0.5}};
  options.rotation[2] = {{radians(1.0), 0.7, 1.9}};
  return std::make_shared<SmoothMotion>(options);
}

}  // namespace

Simulation makeHdStereo(std::uint64_t seed) {
  RoomOptions room;
  room.size_m = {4.8, 4.2, 2.6};
  room.furniture_depth_m = 0.7;
  room.nearest_m = 1.8;  // edges are a little softer where something is nearer
  room.focal_px = kFocalPx;
  room.seed = seed;

  Simulation simulation;
  simulation.scene = makeRoom(room);
  simulation.rig = makeRig();
  simulation.start_ns = kNanosecondsPerSecond;
  simulation.duration_ns = kNanosecondsPerSecond * 4 / 5;
  simulation.motion = makeMotion(simulation.start_ns);
  simulation.pixels.threshold_on = simulation.pixels.threshold_off = 0.16;
  simulation.max_step_px = 0.5;  // misplaces an edge by 0.04 pixels at most
  simulation.seed = seed;
  return simulation;
}

}  // namespace efm
