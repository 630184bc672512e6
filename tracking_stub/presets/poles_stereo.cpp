// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/presets/poles_stereo.h"

#include <memory>

#include "mapping/geometry/timestamp.h"
#include "tracking_stub/motion/smooth_motion.h"
#include "tracking_stub/presets/preset_rigs.h"
#include "tracking_stub/scenes/poles_scene.h"

namespace efm {
namespace {

constexpr double kFocalPx = 226;

std::shared_ptr<const Motion> makeMotion(std::int64_t start_ns) {
  SmoothMotionOptions options;
  options.start_ns = start_ns;
  options.T_world_center.rotation = lookingAlongY();
  options.translation[0] = {{0.16, 0.45, 0.0}, {0.010, 1.7, 0.9}};
  options.translation[1] = {{0.12, 0.55, 1.3}, {0.006, 1.9, 2.5}};
  options.translation[2] = {{0.10, 0.50, 2.0}, {0.004, 1.5, 0.4}};
  options.rotation[0] = {{radians(1.2), 0.8, 0.3}};
  options.rotation[1] = {{radians(1.2), 0.7, 2.0}};
  options.rotation[2] = {{radians(2.0), 0.6, 1.9}};
  return std::make_shared<SmoothMotion>(options);
}

}  // namespace

Simulation makePolesStereo(std::uint64_t seed) {
  PolesOptions poles;
  poles.nearest_m = 1.05;
  poles.farthest_m = 3;
  poles.wall_m = 4;
  poles.focal_px = kFocalPx;
  poles.seed = seed;

  Simulation simulation;
  simulation.scene = makePoles(poles);
  simulation.rig = makeStereoRig(makePinhole(346, 260, kFocalPx), 0.10);
  simulation.start_ns = kNanosecondsPerSecond;
  simulation.duration_ns = kNanosecondsPerSecond * 3 / 2;
  simulation.motion = makeMotion(simulation.start_ns);
  simulation.pixels.threshold_on = simulation.pixels.threshold_off = 0.21;
  simulation.seed = seed;
  return simulation;
}

}  // namespace efm
