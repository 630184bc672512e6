// SPDX-License-Identifier: BSD-3-Clause
#include <memory>

#include "tracking_stub/motion/smooth_motion.h"
#include "tracking_stub/presets/preset_rigs.h"
#include "tracking_stub/presets/presets.h"
#include "tracking_stub/scenes/street_scene.h"

namespace efm {

Simulation makeDriveStereo(std::uint64_t seed) {
  constexpr double kBaselineM = 0.60;
  constexpr double kSpeed = 8;  // m/s
  constexpr double kDurationS = 1.2;
  StreetOptions street;
  for (double y = 0; y <= kSpeed * kDurationS; ++y) street.path.emplace_back(0, y);
  street.min_length_m = 49;
  street.focal_px = 550;
  street.seed = seed;

  CameraModel model = makePinhole(640, 480, street.focal_px);
  model.distortion = DistortionModel::kRadtan;
  model.coefficients = {-0.09, 0.18, 0.0001, 0.0006};

  SmoothMotionOptions motion;
  motion.start_ns = kPresetStartNs;
  motion.T_world_center.rotation = lookingAlongY();
  // The pair is in the middle of the car.
  motion.T_world_center.translation = {-0.5 * kBaselineM, 0, 1.9};
  motion.velocity = {0, 0, kSpeed};  // along the camera's axes: forwards
  // Within the lane, and up and down on the springs.
  motion.translation[0] = {{0.15, 0.35, 0.2}};
  motion.translation[1] = {{0.015, 1.5, 0.4}};
  motion.rotation[0] = {{radians(0.25), 1.5, 1.0}};
  motion.rotation[1] = {{radians(0.8), 0.35, 1.8}};
  motion.rotation[2] = {{radians(0.3), 1.1, 0.5}};

  Simulation simulation = emptyPreset(kDurationS, 0.25, seed);
  simulation.scene = makeStreet(street);
  simulation.rig = makeStereoRig(model, kBaselineM);
  simulation.motion = std::make_shared<SmoothMotion>(motion);
  // The road right before the car moves six times as fast as most of the image. Its edges are
  // softer: under a pixel's blur, a step of 1 misplaces an edge by 0.15 pixels.
  simulation.max_step_px = 1;
  simulation.truth_cell_m = 0.05;
  return simulation;
}

}  // namespace efm
