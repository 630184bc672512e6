// SPDX-License-Identifier: BSD-3-Clause
// Hot pixels of a stereo rig, end to end: the simulator says which events are noise.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <iostream>
#include <vector>

#include "mapping/keyframes/fusion_mapper.h"
#include "maps/metrics/depth_metrics.h"
#include "tracking_stub/presets/presets.h"
#include "tracking_stub/rendering/frame_renderer.h"

namespace efm {
namespace {

/// A tenth of a percent of the pixels fires a thousand times a second.
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
  EventCounts counts;
  std::size_t points = 0;
  double bad_share = 0;  ///< Of the points, more than 10 % from the true depth.
};

/// The last window, once the filter has seen a little.
Mapped mapLast(const Simulation& simulation, const std::vector<CameraRecording>& recordings,
               bool hot_pixels) {
  FusionMapperOptions options;
  options.filter.hot_pixels = hot_pixels;
  options.keyframe.planes = {0.5, 3.0, 100, PlaneSpacing::kInverse};
  options.only_window = Window{simulation.start_ns + 300'000'000, simulation.start_ns + 500'000'000,
                               simulation.start_ns + 400'000'000};
  FusionMapper mapper(options);
  for (const RigCamera& camera : simulation.rig.cameras) mapper.addCamera(camera);
  for (const StampedPose& pose : samplePoses(simulation)) mapper.addPose(pose);
  for (std::size_t c = 0; c < recordings.size(); ++c) {
    mapper.addEvents(static_cast<int>(c), recordings[c].events);
  }
  mapper.finish();
  Mapped mapped;
  const auto keyframe = mapper.next();
  while (mapper.next()) {
  }
  mapped.counts = mapper.counts().total();
  if (!keyframe) return mapped;
  DepthPairingOptions pairing;
  pairing.tolerance_px = 1;
  const cv::Mat1f truth = renderDepth(simulation.scene, keyframe->T_world_ref, keyframe->view);
  std::size_t bad = 0;
  for (const DepthPair& pair : pairDepths(keyframe->map.depth, truth, pairing)) {
    ++mapped.points;
    if (std::abs(pair.estimate_m - pair.truth_m) > 0.1 * pair.truth_m) ++bad;
  }
  mapped.bad_share = static_cast<double>(bad) / static_cast<double>(mapped.points);
  return mapped;
}

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
  EXPECT_EQ(ideal.counts.filtered, 0U) << "of 350,000 events none is taken for noise";
  EXPECT_GT(unfiltered.bad_share, 2 * ideal.bad_share);
  EXPECT_LT(filtered.bad_share, 1.15 * ideal.bad_share);
  EXPECT_GT(filtered.points, ideal.points * 9 / 10);

  // Which ones: all but the first 50 of each hot pixel, and of the edges those that they fire.
  std::size_t noise = 0;
  std::size_t noise_left_out = 0;
  std::size_t edges = 0;
  std::size_t edges_left_out = 0;
  for (std::size_t c = 0; c < hot_events.size(); ++c) {
    const CameraModel& model = hot.rig.cameras[c].model;
    EventFilter filter(model.width, model.height, {});
    for (std::size_t i = 0; i < hot_events[c].events.size(); ++i) {
      const bool is_noise = hot_events[c].sources[i].surface < 0;
      const bool left_out = !filter.keeps(hot_events[c].events[i]);
      ++(is_noise ? noise : edges);
      if (left_out) ++(is_noise ? noise_left_out : edges_left_out);
    }
  }
  EXPECT_GT(static_cast<double>(noise_left_out), 0.85 * static_cast<double>(noise));
  EXPECT_LT(static_cast<double>(edges_left_out), 0.002 * static_cast<double>(edges));
}

}  // namespace
}  // namespace efm
