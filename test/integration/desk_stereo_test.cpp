// SPDX-License-Identifier: BSD-3-Clause
// The method end to end on the simulated desk, compared with the exact truth.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "mapping/keyframes/fusion_mapper.h"
#include "maps/metrics/depth_metrics.h"
#include "test/integration/simulated_recording.h"

namespace efm {
namespace {

class DeskStereo : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    recording_ = new test::SimulatedRecording(test::SimulatedRecording::desk());
  }
  static void TearDownTestSuite() {
    delete recording_;
    recording_ = nullptr;
  }

  static FusionMapperOptions options(double window_s, double stride_s) {
    FusionMapperOptions options;
    options.policy.window_s = window_s;
    options.policy.stride_s = stride_s;
    options.keyframe.planes = {0.55, 5.0, 100, PlaneSpacing::kInverse};
    return options;
  }

  /// As the paper has it, whose claims are tested: no groups of events, its extraction.
  static FusionMapperOptions paperOptions(double window_s, double stride_s) {
    FusionMapperOptions paper = options(window_s, stride_s);
    paper.keyframe.split = SplitFusionOptions::none();
    paper.keyframe.extraction.extraction = ExtractionMethod::kPaper;
    return paper;
  }

  /// Over all keyframes together.
  static DepthErrors errors(const std::vector<KeyframeDepthMap>& keyframes) {
    std::vector<DepthPair> all;
    for (const KeyframeDepthMap& keyframe : keyframes) {
      const auto some = recording_->pairs(keyframe);
      all.insert(all.end(), some.begin(), some.end());
    }
    const RigCamera& right = recording_->simulation().rig.cameras.at(1);
    return depthErrors(all, right.model.fx * right.T_rig_cam.translation.norm());
  }

  static test::SimulatedRecording* recording_;
};

test::SimulatedRecording* DeskStereo::recording_ = nullptr;

TEST_F(DeskStereo, EachCameraFiresAboutAMillionEvents) {
  for (const auto& events : recording_->events()) {
    EXPECT_GE(events.size(), 800'000U);
    EXPECT_LE(events.size(), 1'200'000U);
  }
}

TEST_F(DeskStereo, DepthIsGoodToAFractionOfAPlane) {
  const auto keyframes = recording_->map(options(0.5, 0.25));
  ASSERT_GE(keyframes.size(), 5U);
  const double step = DepthPlanes(options(0.5, 0.25).keyframe.planes).inverseDepthStep();
  double mean = 0;
  for (const KeyframeDepthMap& keyframe : keyframes) {
    mean += depthErrors(recording_->pairs(keyframe)).median_inverse / step /
            static_cast<double>(keyframes.size());
  }
  std::cout << "median inverse depth error: " << mean << " plane steps, mean of "
            << keyframes.size() << " keyframes\n";
  EXPECT_LE(mean, 0.8);
}

TEST_F(DeskStereo, TheHarmonicMeanRejectsOutliersInShortWindows) {
  FusionMapperOptions harmonic = paperOptions(0.1, 0.1);
  FusionMapperOptions arithmetic = harmonic;
  arithmetic.keyframe.sweep.fusion.across_cameras = FusionRule::kArithmetic;
  FusionMapperOptions one_camera = harmonic;
  one_camera.cameras = {0};
  const DepthErrors of_harmonic = errors(recording_->map(harmonic));
  const DepthErrors of_arithmetic = errors(recording_->map(arithmetic));
  const DepthErrors of_one = errors(recording_->map(one_camera));
  for (const auto& [name, e] :
       {std::pair{"harmonic", of_harmonic}, std::pair{"arithmetic", of_arithmetic},
        std::pair{"one camera", of_one}}) {
    std::cout << name << ": bad-pix " << 100 * *e.bad_pix_3px << " % of " << e.points
              << " points\n";
  }
  EXPECT_LE(*of_harmonic.bad_pix_3px, 0.85 * *of_arithmetic.bad_pix_3px);
  EXPECT_LE(*of_harmonic.bad_pix_3px, 0.85 * *of_one.bad_pix_3px);
}

TEST_F(DeskStereo, TheMapLiesOnTheTrueSurfaces) {
  const auto points = test::globalCloudOf(recording_->map(options(0.5, 0.25)));
  ASSERT_GT(points->size(), 10'000U);
  const double median_m = recording_->medianDistanceToSurfaces(*points);
  std::cout << "map: " << points->size() << " points, median distance to the surfaces "
            << 100 * median_m << " cm\n";
  EXPECT_LE(median_m, 0.03);
}

}  // namespace
}  // namespace efm
