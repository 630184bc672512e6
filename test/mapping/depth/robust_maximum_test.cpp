// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/depth_extraction.h"
#include "mapping/depth/peak_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <random>
#include <vector>

#include "test/mapping/keyframes/played_recording.h"

namespace efm::robust_maximum_test {
namespace {

TEST(RobustMaximum, IsTheSmallestValueThatNinetyFivePercentDoNotExceed) {
  std::mt19937 random(1);
  RobustMaximum maximum;
  EXPECT_FALSE(maximum.value());
  std::vector<double> values;
  for (int n = 1; n <= 300; ++n) {
    const double value = static_cast<double>(random() % 100) - 50;  // many are equal
    maximum.add(value);
    values.push_back(value);
    std::vector<double> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    const auto enough = std::find_if(sorted.begin(), sorted.end(), [&](double candidate) {
      const auto not_above = std::count_if(values.begin(), values.end(),
                                           [&](double other) { return other <= candidate; });
      return 100 * not_above >= 95 * n;
    });
    ASSERT_EQ(*maximum.value(), *enough) << n;
  }
}

/// Which pixels a fixed white level keeps.
cv::Mat1b keptWith(const cv::Mat1f& confidence, double white) {
  const cv::Mat1f none(confidence.size(), -1.0F);
  DepthExtractionOptions options;
  options.max_confidence = MaxConfidence::of(white);
  return extractAsPaper({confidence, cv::Mat1i::zeros(confidence.size()), none, none},
                        DepthPlanes(), options)
             .depth > 0;
}

TEST(RobustMaximum, OfTheKeyframesSoFarIsTheWhiteLevelOfTheSequence) {
  const test::LongRecording recording(1, 1.0);
  FusionMapperOptions options = test::playedOptions();
  options.keyframe.extraction.extraction = ExtractionMethod::kPaper;
  options.policy.window_s = 0.05;
  options.policy.stride_s = 0.015;
  options.keyframe.extraction.max_confidence.level = WhiteLevel::kSequence;
  const test::Played played = test::play(recording, options, 0);
  EXPECT_GE(played.keyframes.size(), 22U) << "more than the nineteen that are a plain maximum";
  RobustMaximum maximum;
  int unlike_its_own = 0;
  for (const KeyframeDepthMap& keyframe : played.keyframes) {
    double largest = 0;
    cv::minMaxLoc(keyframe.map.confidence, nullptr, &largest);
    EXPECT_EQ(keyframe.max_confidence, largest);
    maximum.add(largest);
    const cv::Mat1b kept = keyframe.map.depth > 0;
    EXPECT_EQ(cv::countNonZero(kept != keptWith(keyframe.map.confidence, *maximum.value())), 0);
    if (cv::countNonZero(kept != keptWith(keyframe.map.confidence, largest)) > 0) ++unlike_its_own;
  }
  EXPECT_GT(unlike_its_own, 5) << "or the test would not tell";
}

}  // namespace
}  // namespace efm::robust_maximum_test
