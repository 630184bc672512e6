// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/presets/drive_stereo.h"

#include <memory>

#include "mapping/geometry/timestamp.h"
#include "tracking_stub/motion/smooth_motion.h"
#include "tracking_stub/presets/preset_rigs.h"
#include "tracking_stub/scenes/street_scene.h"

namespace efm {
namespace {

constexpr double kFocalPx = 550;
constexpr double kBaselineM = 0.60;
constexpr double kSpeed = 8;  // m/s
constexpr double kDurationS = 1.2;

Rig makeRig() {
  CameraModel model = makePinhole(640, 480, kFocalPx);
  model.distortion = DistortionModel::kRadtan;
  model.coefficients = {-0.09, 0.18, 0.0001, 0.0006};
  return makeStereoRig(model, kBaselineM);
}

std::shared_ptr<const Motion> makeMotion(std::int64_t start_ns) {
  SmoothMotionOptions options;
  options.start_ns = start_ns;
  options.T_world_center.rotation = lookingAlongY();
  // The pair stands in the middle of the car.
  options.T_world_center.translation = {-0.5 * kBaselineM, 0, 1.9};
  options.velocity = {0, 0, kSpeed};  // along the camera's axes: forwards
  // Within the lane; the springs' up and down.
  options.translation[0] = {{0.15, 0.35, 0.2}};
  options.translation[1] = {{0.015, 1.5, 0.4}};
  options.rotation[0] = {{radians(0.25), 1.5, 1.0}};
  options.rotation[1] = {{radians(0.8), 0.35, 1.8}};
  options.rotation[2] = {{radians(0.3), 1.1, 0.5}};
  return std::make_shared<SmoothMotion>(options);
}

}  // namespace

Simulation makeDriveStereo(std::uint64_t seed) {
  StreetOptions street;
  for (double y = 0; y <= kSpeed * kDurationS; ++y) street.path.emplace_back(0, y);
  street.reach_m = 49;
  street.focal_px = kFocalPx;
  street.seed = seed;

  Simulation simulation;
  simulation.scene = makeStreet(street);
  simulation.rig = makeRig();
  simulation.start_ns = kNanosecondsPerSecond;
  simulation.duration_ns = durationFromSeconds(kDurationS);
  simulation.motion = makeMotion(simulation.start_ns);
  simulation.pixels.threshold_on = simulation.pixels.threshold_off = 0.25;
  // It is the road right before the car that moves fastest, six times as fast as most of the image,
  // and its edges are softer: under a pixel's blur, a step of 1 misplaces an edge by 0.15 pixels.
  simulation.max_step_px = 1;
  simulation.truth_cell_m = 0.05;
  simulation.seed = seed;
  return simulation;
}

}  // namespace efm
