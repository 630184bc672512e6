// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "mapping/keyframes/keyframe_mapper.h"
#include "maps/cloud/global_cloud.h"
#include "maps/cloud/keyframe_cloud.h"
#include "test/bench/benches.h"
#include "test/bench/synthetic_window.h"

namespace efm::bench {
namespace {

constexpr std::uint64_t kInsertedKeyframe = 1'000'000;  // an unused number

std::vector<CloudPoint> keyframeCloud(const SensorSize& sensor) {
  const SyntheticWindow made = makeSyntheticWindow(sensor.window(2));
  KeyframeMapper mapper(made.rig, {0, 1}, made.options);
  const auto keyframe =
      mapper.map(made.window, {made.events.begin(), made.events.end()}, made.trajectory);
  if (!keyframe) return {};
  return pointsInWorld(viewPoints(*keyframe), keyframe->T_world_ref);
}

/// Random points in a hall, in keyframes of a hundred thousand.
GlobalCloud hallOf(std::uint64_t points) {
  constexpr std::uint64_t kPerKeyframe = 100'000;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> side_m(-20, 20);
  std::uniform_real_distribution<double> height_m(0, 5);
  GlobalCloud map;
  for (std::uint64_t keyframe = 0; points > 0; ++keyframe) {
    std::vector<CloudPoint> cloud(std::min(points, kPerKeyframe));
    for (CloudPoint& point : cloud) {
      point.p_world = {side_m(random), side_m(random), height_m(random)};
      point.confidence = 1;
    }
    map.insert(keyframe, cloud);
    points -= cloud.size();
  }
  return map;
}

}  // namespace

void addGlobalCloud(const Sensors& sensors) {
  const auto cloud = lazily([sensor = sensors.front()] { return keyframeCloud(sensor); });
  for (const std::uint64_t points : {1'000, 100'000, 10'000'000}) {
    const auto map = lazily([=] { return hallOf(points); });  // all in memory: they take turns
    add("global_cloud/insertion/into " + std::to_string(points) + " points",
        [=](benchmark::State& state) {
          GlobalCloud& into = map();
          const std::vector<CloudPoint>& inserted = cloud();
          for (auto _ : state) {
            into.insert(kInsertedKeyframe, inserted);
            state.PauseTiming();
            into.remove(kInsertedKeyframe);
            state.ResumeTiming();
          }
          countRate(state, "points/s", static_cast<double>(inserted.size()));
        });
  }
}

}  // namespace efm::bench
