// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/recordings/flying_room.h"

#include <cmath>

#include "mapping/geometry/timestamp.h"
#include "tracking_stub/presets/presets.h"

namespace efm::studies {
namespace {

constexpr double kNearM = 1.0;
constexpr double kFarM = 4.0;

}  // namespace

Simulation flyingRoom(double duration_s) {
  Simulation simulation = makeSimulation({"hd_stereo"});
  simulation.duration_ns = durationFromSeconds(duration_s);
  return withThreshold(withWidth(simulation, 640), 0.2);
}

Simulation withWidth(Simulation simulation, int width_px) {
  const int height_px = width_px * 3 / 4;
  CameraModel model = makePinhole(width_px, height_px, 0.625 * width_px);
  // The image is from -0.5 to width - 0.5: the field of view is the same at every size.
  model.cx = 0.5 * (width_px - 1);
  model.cy = 0.5 * (height_px - 1);
  simulation.rig = makeStereoRig(model, 0.20);
  return simulation;
}

Simulation withThreshold(Simulation simulation, double threshold) {
  simulation.pixels.threshold_on = simulation.pixels.threshold_off = threshold;
  return simulation;
}

Method flyingRoomStereo() { return {"two cameras (Alg. 1)", paperOptions(kNearM, kFarM)}; }

Method flyingRoomMono() { return oneCamera(kNearM, kFarM); }

}  // namespace efm::studies
