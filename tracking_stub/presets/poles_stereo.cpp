// SPDX-License-Identifier: BSD-3-Clause
#include <memory>

#include "tracking_stub/motion/smooth_motion.h"
#include "tracking_stub/presets/preset_rigs.h"
#include "tracking_stub/presets/presets.h"
#include "tracking_stub/scenes/poles_scene.h"

namespace efm {

Simulation makePolesStereo(std::uint64_t seed) {
  PolesOptions poles;
  poles.nearest_m = 1.05;
  poles.farthest_m = 3;
  poles.wall_m = 4;
  poles.focal_px = 226;
  poles.seed = seed;

  SmoothMotionOptions motion;
  motion.start_ns = kPresetStartNs;
  motion.T_world_center.rotation = lookingAlongY();
  motion.translation[0] = {{0.16, 0.45, 0.0}, {0.010, 1.7, 0.9}};
  motion.translation[1] = {{0.12, 0.55, 1.3}, {0.006, 1.9, 2.5}};
  motion.translation[2] = {{0.10, 0.50, 2.0}, {0.004, 1.5, 0.4}};
  motion.rotation[0] = {{radians(1.2), 0.8, 0.3}};
  motion.rotation[1] = {{radians(1.2), 0.7, 2.0}};
  motion.rotation[2] = {{radians(2.0), 0.6, 1.9}};

  Simulation simulation = emptyPreset(1.5, 0.21, seed);
  simulation.scene = makePoles(poles);
  simulation.rig = makeStereoRig(makePinhole(346, 260, poles.focal_px), 0.10);
  simulation.motion = std::make_shared<SmoothMotion>(motion);
  return simulation;
}

}  // namespace efm
