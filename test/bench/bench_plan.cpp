// SPDX-License-Identifier: BSD-3-Clause
#include "test/bench/bench_plan.h"

namespace efm::bench {

SyntheticWindowOptions SensorSize::window(int cameras) const {
  SyntheticWindowOptions options;
  options.width = width;
  options.height = height;
  options.events_per_camera = events;
  options.cameras = cameras;
  return options;
}

BenchPlan BenchPlan::full() {
  BenchPlan plan;
  plan.sensors = {{346, 260, 235'000}, {640, 480, 2'000'000}, {1280, 720, 5'000'000}};
  plan.map_points = {1'000, 100'000, 10'000'000};
  return plan;
}

BenchPlan BenchPlan::quick() {
  BenchPlan plan;
  plan.sensors = {{86, 65, 5'000}};
  plan.planes = 20;
  plan.map_points = {1'000};
  plan.growth_steps = 2;
  plan.once = true;
  return plan;
}

}  // namespace efm::bench
