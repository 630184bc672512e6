// SPDX-License-Identifier: BSD-3-Clause
// Tests the event filter on hot pixels of a stereo rig. The simulator knows the noise events.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iostream>
#include <vector>

#include "test/integration/simulated_recording.h"

namespace efm {
namespace {

/// Returns a rig. If `hot`, 0.1 % of the pixels fire a thousand times per second.
Simulation makeRig(bool hot) {
  SimulationOptions options;
  options.preset = "desk_stereo";
  options.seed = 11;
  options.duration_s = 0.5;
  Simulation simulation = makeSimulation(options);
  if (hot) {
    simulation.noise.hot_fraction = 0.001;
    simulation.noise.hot_hz = 1000;
  }
  return simulation;
}

struct Mapped {
  std::size_t points = 0;
  double bad_share = 0;  ///< Share of the points that are more than 10 % from the true depth.
};

/// Maps only the last window, after the filter has seen 0.3 s of events.
Mapped mapLast(const Simulation& simulation, const std::vector<CameraRecording>& recordings,
               bool hot_pixels) {
  FusionMapperOptions options;
  options.filter.hot_pixels = hot_pixels;
  options.keyframe.planes = {0.5, 3.0, 100, PlaneSpacing::kInverse};
  options.only_window = Window{simulation.start_ns + 300'000'000, simulation.start_ns + 500'000'000,
                               simulation.start_ns + 400'000'000};
  std::vector<std::vector<Event>> events;
  for (const CameraRecording& camera : recordings) events.push_back(camera.events);
  const test::SimulatedRecording recording(simulation, events);
  const auto pairs = recording.pairs(recording.map(options).at(0));
  const auto bad = std::count_if(pairs.begin(), pairs.end(), [](const DepthPair& pair) {
    return std::abs(pair.estimate_m - pair.truth_m) > 0.1 * pair.truth_m;
  });
  return {pairs.size(), static_cast<double>(bad) / static_cast<double>(pairs.size())};
}

/// Numbers of events of hot pixels and of edges, and of the events that the filter removes.
struct Filtered {
  double noise = 0, noise_left_out = 0, edges = 0, edges_left_out = 0;

  Filtered(const Simulation& simulation, const std::vector<CameraRecording>& recordings) {
    for (std::size_t c = 0; c < recordings.size(); ++c) {
      const CameraModel& model = simulation.rig.cameras[c].model;
      EventFilter filter(model.width, model.height, {});
      for (std::size_t i = 0; i < recordings[c].events.size(); ++i) {
        const bool is_noise = recordings[c].sources[i].surface < 0;
        const bool left_out = !filter.keeps(recordings[c].events[i]);
        ++(is_noise ? noise : edges);
        if (left_out) ++(is_noise ? noise_left_out : edges_left_out);
      }
    }
  }
};

TEST(EventFilterEndToEnd, HotPixelsAreTakenOutAndEdgesAreNot) {
  const Simulation clean = makeRig(false);
  const Simulation hot = makeRig(true);
  const auto clean_events = simulateEvents(clean);
  const auto hot_events = simulateEvents(hot);

  const Mapped ideal = mapLast(clean, clean_events, true);
  const Mapped unfiltered = mapLast(hot, hot_events, false);
  const Mapped filtered = mapLast(hot, hot_events, true);
  std::cout << "beyond 10 %: without hot pixels " << ideal.bad_share << ", with "
            << unfiltered.bad_share << ", filtered " << filtered.bad_share << "\n";
  const Filtered of_clean(clean, clean_events);
  EXPECT_EQ(of_clean.noise_left_out + of_clean.edges_left_out, 0) << "of 350,000 events";
  EXPECT_GT(unfiltered.bad_share, 2 * ideal.bad_share);
  EXPECT_LT(filtered.bad_share, 1.15 * ideal.bad_share);
  EXPECT_GT(filtered.points, ideal.points * 9 / 10);

  // Removed: all but the first 50 events of each hot pixel, including its events of edges.
  const Filtered of_hot(hot, hot_events);
  EXPECT_GT(of_hot.noise_left_out, 0.85 * of_hot.noise);
  EXPECT_LT(of_hot.edges_left_out, 0.002 * of_hot.edges);
}

}  // namespace
}  // namespace efm
