// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/recordings/room_loop.h"

#include <memory>

#include "mapping/geometry/timestamp.h"
#include "tracking_stub/motion/motion.h"
#include "tracking_stub/presets/presets.h"

namespace efm::studies {
namespace {

constexpr double kPeriodS = 20;

/// Its periods do not fit the loop: the second loop has other positions than the first.
std::shared_ptr<const Motion> sway(std::int64_t start_ns) {
  SmoothMotionOptions options;
  options.start_ns = start_ns;
  options.translation[0] = {{0.02, 0.83, 0.4}};
  options.translation[1] = {{0.08, 0.61, 1.1}};
  options.translation[2] = {{0.06, 0.72, 2.0}};
  options.rotation[0] = {{radians(4), 0.37, 0.3}, {radians(0.2), 1.4, 1.1}};
  options.rotation[1] = {{radians(2), 0.52, 2.0}};
  options.rotation[2] = {{radians(2), 0.64, 1.9}};
  return std::make_shared<SmoothMotion>(options);
}

}  // namespace

Simulation roomLoop(double duration_s) {
  Simulation simulation = makeSimulation({"room_stereo"});
  LoopMotionOptions loop;
  loop.start_ns = simulation.start_ns;
  loop.period_s = kPeriodS;
  loop.radius_x_m = 1.8;
  loop.radius_y_m = 1.1;
  loop.height_m = 1.25;
  loop.heading_rad = radians(35);
  loop.sway = sway(loop.start_ns);
  simulation.motion = std::make_shared<LoopMotion>(loop);
  simulation.duration_ns = durationFromSeconds(duration_s);
  return simulation;
}

}  // namespace efm::studies
