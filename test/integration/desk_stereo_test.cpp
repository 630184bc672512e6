// SPDX-License-Identifier: BSD-3-Clause
// Tests the whole method on the simulated desk against the exact truth.
#include <gtest/gtest.h>

#include <iostream>
#include <vector>

#include "mapping/keyframes/fusion_mapper.h"
#include "maps/metrics/depth_metrics.h"
#include "test/integration/simulated_recording.h"

namespace efm {
namespace {

using test::SimulatedRecording;

FusionMapperOptions optionsOf(double window_s, double stride_s) {
  FusionMapperOptions options;
  options.policy.window_s = window_s;
  options.policy.stride_s = stride_s;
  options.keyframe.planes = {0.55, 5.0, 100, PlaneSpacing::kInverse};
  return options;
}

/// Returns the share of bad pixels of all keyframes together.
double badShare(const FusionMapperOptions& options, const char* name) {
  const SimulatedRecording& desk = SimulatedRecording::desk();
  std::vector<DepthPair> all;
  for (const KeyframeDepthMap& keyframe : desk.map(options)) {
    const auto some = desk.pairs(keyframe);
    all.insert(all.end(), some.begin(), some.end());
  }
  const RigCamera& right = desk.simulation().rig.cameras.at(1);
  const double bad =
      *depthErrors(all, right.model.fx * right.T_rig_cam.translation.norm()).bad_pix_3px;
  std::cout << name << ": bad-pix " << 100 * bad << " % of " << all.size() << " points\n";
  return bad;
}

TEST(DeskStereo, EachCameraFiresAboutAMillionEvents) {
  for (const auto& events : SimulatedRecording::desk().events()) {
    EXPECT_GE(events.size(), 800'000U);
    EXPECT_LE(events.size(), 1'200'000U);
  }
}

TEST(DeskStereo, DepthIsGoodToAFractionOfAPlaneAndTheMapLiesOnTheTrueSurfaces) {
  const FusionMapperOptions options = optionsOf(0.5, 0.25);
  const SimulatedRecording& desk = SimulatedRecording::desk();
  const auto keyframes = desk.map(options);
  ASSERT_GE(keyframes.size(), 5U);
  const double step = DepthPlanes(options.keyframe.planes).inverseDepthStep();
  double mean = 0;
  for (const KeyframeDepthMap& keyframe : keyframes) {
    mean += depthErrors(desk.pairs(keyframe)).median_inverse / step /
            static_cast<double>(keyframes.size());
  }
  std::cout << "median inverse depth error: " << mean << " plane steps, mean of "
            << keyframes.size() << " keyframes\n";
  EXPECT_LE(mean, 0.8);

  const auto points = test::globalCloudOf(keyframes);
  ASSERT_GT(points->size(), 10'000U);
  const double median_m = desk.medianDistanceToSurfaces(*points);
  std::cout << "map: " << points->size() << " points, median distance to the surfaces "
            << 100 * median_m << " cm\n";
  EXPECT_LE(median_m, 0.03);
}

TEST(DeskStereo, TheHarmonicMeanRejectsOutliersInShortWindows) {
  // Tests the paper's claim with its settings: no groups of events, the paper's extraction.
  FusionMapperOptions harmonic = optionsOf(0.1, 0.1);
  harmonic.keyframe.split = SplitFusionOptions::none();
  harmonic.keyframe.extraction.extraction = ExtractionMethod::kPaper;
  FusionMapperOptions arithmetic = harmonic;
  arithmetic.keyframe.sweep.fusion.across_cameras = FusionRule::kArithmetic;
  FusionMapperOptions one_camera = harmonic;
  one_camera.cameras = {0};
  const double of_harmonic = badShare(harmonic, "harmonic");
  EXPECT_LE(of_harmonic, 0.85 * badShare(arithmetic, "arithmetic"));
  EXPECT_LE(of_harmonic, 0.85 * badShare(one_camera, "one camera"));
}

}  // namespace
}  // namespace efm
