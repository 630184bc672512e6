// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/presets/room_stereo.h"

#include <memory>

#include "mapping/geometry/timestamp.h"
#include "tracking_stub/motion/loop_motion.h"
#include "tracking_stub/motion/smooth_motion.h"
#include "tracking_stub/presets/preset_rigs.h"
#include "tracking_stub/scenes/room_scene.h"

namespace efm {
namespace {

constexpr double kFocalPx = 226;
constexpr double kDurationS = 8;

/// A hand's unrest; whole periods fit the loop, so that it closes.
std::shared_ptr<const Motion> makeSway(std::int64_t start_ns) {
  SmoothMotionOptions options;
  options.start_ns = start_ns;
  const double once = 1 / kDurationS;
  options.translation[0] = {{0.02, 7 * once, 0.4}};
  options.translation[1] = {{0.08, 5 * once, 1.1}};
  options.translation[2] = {{0.06, 6 * once, 2.0}};
  options.rotation[0] = {{radians(5), 3 * once, 0.3}, {radians(0.2), 11 * once, 1.1}};
  options.rotation[1] = {{radians(2), 4 * once, 2.0}};
  options.rotation[2] = {{radians(2), 5 * once, 1.9}};
  return std::make_shared<SmoothMotion>(options);
}

}  // namespace

Simulation makeRoomStereo(std::uint64_t seed) {
  RoomOptions room;
  room.size_m = {7.2, 5.8, 2.8};
  room.nearest_m = 1.0;
  room.focal_px = kFocalPx;
  room.seed = seed;

  LoopMotionOptions loop;
  loop.start_ns = kNanosecondsPerSecond;
  loop.period_s = kDurationS;
  loop.radius_x_m = 1.0;
  loop.radius_y_m = 0.65;
  loop.height_m = 1.25;
  loop.heading_rad = radians(35);
  loop.sway = makeSway(loop.start_ns);

  Simulation simulation;
  simulation.scene = makeRoom(room);
  simulation.rig = makeStereoRig(makePinhole(346, 260, kFocalPx), 0.10);
  simulation.start_ns = loop.start_ns;
  simulation.duration_ns = durationFromSeconds(kDurationS);
  simulation.motion = std::make_shared<LoopMotion>(loop);
  simulation.pixels.threshold_on = simulation.pixels.threshold_off = 0.42;
  // In the corners, where turning moves the image fastest; 0.8 in the middle. Misplaces an edge by
  // 0.25 and 0.1 pixels at most, forwards as often as back.
  simulation.max_step_px = 1.25;
  simulation.seed = seed;
  return simulation;
}

}  // namespace efm
