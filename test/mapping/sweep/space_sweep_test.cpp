// SPDX-License-Identifier: BSD-3-Clause
// Compares the DSI of events with the oracle, and tests the other results of a sweep.
#include "mapping/sweep/space_sweep.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <opencv2/core.hpp>

#include "mapping/events/window.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "test/mapping/depth/same_image.h"
#include "test/mapping/dsi/chosen_dsi.h"
#include "test/mapping/kernels/fast_kernels.h"
#include "test/mapping/keyframes/random_scene.h"
#include "test/oracle/naive_mapper.h"

namespace efm {
namespace {

using test::errorOverMass;
using test::same;
using test::WholeDsi;
using Recording = test::RandomRecording;

constexpr Window kWindow = Recording::kWindow;

/// Returns options that give every event its own pose, so that only rounding differs.
KeyframeMapperOptions exactOptions(const SplitFusionOptions& split, int subintervals) {
  KeyframeMapperOptions options;
  options.split = split;
  options.extraction.extraction = ExtractionMethod::kPaper;  // only the DSI matters
  options.planes = {0.5, 4.0, 2, PlaneSpacing::kInverse};
  options.view.width = 24;  // a quarter of the pixels: each has votes in every group
  options.packets.packet_error_px = 0;
  options.subintervals.count = subintervals;
  options.sweep.threads = 1;
  return options;
}

std::vector<float> dsiOf(const Recording& recording, const KeyframeMapperOptions& options,
                         const Window& window = kWindow) {
  KeyframeMapper mapper(recording.rig, recording.cameras(), options);
  WholeDsi dsi(mapper.planes(), mapper.view());
  EXPECT_TRUE(mapper.map(window, recording.spans(), recording.trajectory, &dsi));
  return dsi.values;
}

/// The oracle's ray densities, [camera][sub-interval of the window][polarity]. All events have
/// polarity 0 if there is no split by polarity.
using Parts = std::vector<std::vector<std::vector<oracle::Dsi>>>;

Parts exactParts(const Recording& recording, const KeyframeMapperOptions& options) {
  const KeyframeMapper mapper(recording.rig, recording.cameras(), options);
  const Rigid3 T_world_ref = mapper.referencePose(*recording.trajectory.poseAt(kWindow.t_ref_ns));
  const int count = options.subintervals.count * options.split.time_slices;
  Parts parts;
  for (std::size_t c = 0; c < recording.events.size(); ++c) {
    const RigCamera& camera = recording.rig.cameras[c];
    const UndistortionTable undistortion(camera.model);
    auto& of_camera = parts.emplace_back();
    for (const auto& events : oracle::splitEvents(recording.events[c], kWindow.t0_ns, kWindow.t1_ns,
                                                  count, options.subintervals.split)) {
      std::vector<std::vector<Event>> by_polarity(options.split.polarity ? 2 : 1);
      for (const Event& event : events) {
        by_polarity[options.split.polarity && event.polarity ? 1 : 0].push_back(event);
      }
      auto& of_part = of_camera.emplace_back();
      for (const auto& group : by_polarity) {
        of_part.push_back(
            oracle::rayDensity(oracle::poseEach(group, camera, recording.trajectory, T_world_ref),
                               undistortion, mapper.view(), mapper.planes()));
      }
    }
  }
  return parts;
}

/// Returns the sum over slices and polarities of the fused cameras and sub-intervals. For a single
/// camera: the sum over polarities of the fused slices and sub-intervals.
oracle::Dsi exactDsi(const Parts& parts, const KeyframeMapperOptions& options) {
  const auto subintervals = static_cast<std::size_t>(options.subintervals.count);
  const std::size_t slices = parts[0].size() / subintervals;
  const auto slots = assignSubintervals(static_cast<int>(parts.size()), options.subintervals);
  const auto input = [&](std::size_t camera, std::size_t slice, std::size_t polarity) {
    std::vector<oracle::Dsi> by_slot;
    for (const int part : slots[camera]) {
      by_slot.push_back(
          parts[camera][slice * subintervals + static_cast<std::size_t>(part)][polarity]);
    }
    return by_slot;
  };
  oracle::Dsi sum = parts[0][0][0];
  std::fill(sum.values.begin(), sum.values.end(), 0.0);
  const auto addFused = [&](const std::vector<std::vector<oracle::Dsi>>& inputs) {
    const oracle::Dsi fused = oracle::fuse(options.sweep.fusion, inputs);
    for (std::size_t i = 0; i < sum.values.size(); ++i) sum.values[i] += fused.values[i];
  };
  for (std::size_t polarity = 0; polarity < parts[0][0].size(); ++polarity) {
    std::vector<std::vector<oracle::Dsi>> inputs;
    for (std::size_t slice = 0; slice < slices; ++slice) {
      for (std::size_t c = 0; c < parts.size(); ++c) inputs.push_back(input(c, slice, polarity));
      if (parts.size() == 1 && slice + 1 < slices) continue;
      addFused(inputs);
      inputs.clear();
    }
  }
  return sum;
}

class SpaceSweepOn : public ::testing::TestWithParam<VotingKernel> {};

INSTANTIATE_TEST_SUITE_P(Kernels, SpaceSweepOn, ::testing::ValuesIn(availableKernels()),
                         test::nameOfKernel);

TEST_P(SpaceSweepOn, FromEventsTheDsiIsTheOraclesForAllRulesOrdersAndSplits) {
  const struct {
    SplitFusionOptions split;
    int subintervals;
    std::vector<FusionRule> across_time;
  } cases[] = {{SplitFusionOptions::none(), 1, {FusionRule::kArithmetic}},
               {SplitFusionOptions::none(), 3, allFusionRules()},
               {{true, 2}, 1, {FusionRule::kRms}},
               {{true, 2}, 2, {FusionRule::kRms}},
               {{false, 3}, 2, {FusionRule::kRms}},
               {{true, 1}, 2, {FusionRule::kRms}}};
  for (int cameras = 1; cameras <= 3; ++cameras) {
    const Recording recording(40 + static_cast<std::uint32_t>(cameras), cameras, 4000);
    for (const auto& c : cases) {
      KeyframeMapperOptions options = exactOptions(c.split, c.subintervals);
      options.sweep.kernel = GetParam();
      const Parts parts = exactParts(recording, options);
      for (const FusionRule across_cameras : allFusionRules()) {
        for (const FusionRule across_time : c.across_time) {
          for (const auto order : {FusionOrder::kCamerasThenTime, FusionOrder::kTimeThenCameras}) {
            options.sweep.fusion = {across_cameras, across_time, order};
            EXPECT_LE(errorOverMass(dsiOf(recording, options), exactDsi(parts, options)),
                      test::errorOverMassOf(GetParam()))
                << cameras << " cameras " << nameOf(across_cameras) << ", " << nameOf(across_time)
                << ", " << nameOf(order) << ", polarities " << c.split.polarities() << ", slices "
                << c.split.time_slices << " of " << c.subintervals;
          }
        }
      }
    }
  }
}

/// Without the reference camera's events, all others make pairs. A silent camera adds nothing.
TEST_P(SpaceSweepOn, PairsAreTheSumOfTheHarmonicSweepsOfTwoCameras) {
  using Pairs = std::vector<std::vector<int>>;
  const struct {
    std::vector<int> selected;
    int reference;
    int silent;
    Pairs pairs;
  } cases[] = {{{0, 1, 2, 3}, 0, -1, {{0, 1}, {0, 2}, {0, 3}}},
               {{0, 1, 2, 3}, 2, -1, {{2, 0}, {2, 1}, {2, 3}}},
               {{1, 2, 3}, 0, -1, {{1, 2}, {1, 3}}},
               {{0, 1, 2, 3}, 0, 1, {{0, 2}, {0, 3}}},
               {{0, 1, 2, 3}, 1, 1, {{0, 2}, {0, 3}, {2, 3}}},
               {{1, 3}, 0, -1, {{1, 3}}}};
  for (const auto& c : cases) {
    for (const bool exclude_silent : {false, true}) {
      Recording recording(44, 4, 4000);
      if (c.silent >= 0) recording.events[static_cast<std::size_t>(c.silent)].clear();
      KeyframeMapperOptions options = exactOptions({true, 2}, 1);
      options.sweep.kernel = GetParam();
      options.reference_camera = c.reference;
      options.exclude_silent = exclude_silent;
      const auto dsi_of = [&](const std::vector<int>& cameras) {
        KeyframeMapper mapper(recording.rig, cameras, options);
        WholeDsi dsi(mapper.planes(), mapper.view());
        EXPECT_TRUE(mapper.map(kWindow, recording.spans(), recording.trajectory, &dsi));
        return dsi.values;
      };
      const std::vector<float> found = dsi_of(c.selected);
      std::vector<double> sum(found.size());
      for (const std::vector<int>& pair : c.pairs) {
        const std::vector<float> of_pair = dsi_of(pair);
        for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += double{of_pair[i]};
      }
      for (std::size_t i = 0; i < sum.size(); ++i) {
        ASSERT_NEAR(found[i], sum[i], 1e-5 * sum[i])
            << "reference " << c.reference << ", silent " << c.silent;
      }
    }
  }
}

// ---------------------------------------------------------------- other results

TEST(SpaceSweep, OptionsHaveTheirLimits) {
  using O = SpaceSweepOptions;
  EXPECT_THROW(sweepSpace({{RayBundle()}}, DsiGrid(), {{}, 0, {}}), std::invalid_argument);
  const tbb::global_control two_cores(tbb::global_control::max_allowed_parallelism, 2);
  EXPECT_EQ(O().threadsOrCores(), 2);
  O three;
  three.threads = 3;
  EXPECT_EQ(three.threadsOrCores(), 2) << "never more than there are cores";
  three.threads = 1;
  EXPECT_EQ(three.threadsOrCores(), 1);
}

}  // namespace
}  // namespace efm
