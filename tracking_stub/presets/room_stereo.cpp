// SPDX-License-Identifier: BSD-3-Clause
#include <memory>

#include "tracking_stub/motion/loop_motion.h"
#include "tracking_stub/motion/smooth_motion.h"
#include "tracking_stub/presets/preset_rigs.h"
#include "tracking_stub/presets/presets.h"
#include "tracking_stub/scenes/room_scene.h"

namespace efm {

Simulation makeRoomStereo(std::uint64_t seed) {
  constexpr double kDurationS = 8;
  RoomOptions room;
  room.size_m = {7.2, 5.8, 2.8};
  room.nearest_m = 1.0;
  room.focal_px = 226;
  room.seed = seed;

  // A hand's sway. Whole periods fit the loop, so that it closes.
  SmoothMotionOptions sway;
  sway.start_ns = kPresetStartNs;
  const double loop_hz = 1 / kDurationS;
  sway.translation[0] = {{0.02, 7 * loop_hz, 0.4}};
  sway.translation[1] = {{0.08, 5 * loop_hz, 1.1}};
  sway.translation[2] = {{0.06, 6 * loop_hz, 2.0}};
  sway.rotation[0] = {{radians(5), 3 * loop_hz, 0.3}, {radians(0.2), 11 * loop_hz, 1.1}};
  sway.rotation[1] = {{radians(2), 4 * loop_hz, 2.0}};
  sway.rotation[2] = {{radians(2), 5 * loop_hz, 1.9}};

  LoopMotionOptions loop;
  loop.start_ns = kPresetStartNs;
  loop.period_s = kDurationS;
  loop.radius_x_m = 1.0;
  loop.radius_y_m = 0.65;
  loop.height_m = 1.25;
  loop.heading_rad = radians(35);
  loop.sway = std::make_shared<SmoothMotion>(sway);

  Simulation simulation = emptyPreset(kDurationS, 0.42, seed);
  simulation.scene = makeRoom(room);
  simulation.rig = makeStereoRig(makePinhole(346, 260, room.focal_px), 0.10);
  simulation.motion = std::make_shared<LoopMotion>(loop);
  // The rotation moves the image 1.25 pixels in the corners and 0.8 in the middle. This misplaces
  // an edge by at most 0.25 and 0.1 pixels, forwards as often as back.
  simulation.max_step_px = 1.25;
  return simulation;
}

}  // namespace efm
