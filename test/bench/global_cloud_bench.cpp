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

std::vector<CloudPoint> cloudOf(const SyntheticWindow& made, int planes) {
  KeyframeMapperOptions options = made.options;
  options.planes.num_planes = planes;
  KeyframeMapper mapper(made.rig, {0, 1}, options);
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

void benchGlobalCloud(BenchSession& session) {
  const SyntheticWindow made = makeSyntheticWindow(session.plan().sensors.front().window(2));
  const std::vector<CloudPoint> cloud = cloudOf(made, session.plan().planes);
  std::vector<GlobalCloud> maps;  // all in memory: compared cases take turns
  for (const std::uint64_t points : session.plan().map_points) maps.push_back(hallOf(points));
  for (std::size_t i = 0; i < maps.size(); ++i) {
    const std::string name = "into " + std::to_string(session.plan().map_points[i]) + " points";
    session.add({"global_cloud", name, ""}, [&, map = &maps[i]](benchmark::State& state) {
      for (auto _ : state) {
        map->insert(kInsertedKeyframe, cloud);
        state.PauseTiming();
        map->remove(kInsertedKeyframe);
        state.ResumeTiming();
      }
      countRate(state, "points/s", static_cast<double>(cloud.size()));
    });
  }
  session.run();
}

}  // namespace efm::bench
