// SPDX-License-Identifier: BSD-3-Clause
#include "test/bench/unfused_keyframe.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "mapping/keyframes/keyframe_mapper.h"
#include "test/bench/synthetic_window.h"

namespace efm::bench {
namespace {

/// The two timed programs must do the same work.
TEST(UnfusedKeyframe, FindsTheDepthsOfTheMapper) {
  SyntheticWindowOptions size;
  size.width = 173;
  size.height = 130;
  size.events_per_camera = 40'000;
  SyntheticWindow made = makeSyntheticWindow(size);
  made.options.sweep.kernel = VotingKernel::kPlain;
  const std::vector<EventSpan> events(made.events.begin(), made.events.end());

  KeyframeMapper mapper(made.rig, {0, 1}, made.options);
  const auto fused = mapper.map(made.window, events, made.trajectory);
  UnfusedKeyframe reference(made.rig, made.options);
  reference.map(made.window, events, made.trajectory);  // a previous keyframe must not matter
  const auto unfused = reference.map(made.window, events, made.trajectory);

  ASSERT_TRUE(fused && unfused);
  const int found = cv::countNonZero(fused->map.depth > 0);
  ASSERT_GT(found, 500);
  // The order of additions differs: values at the threshold may differ.
  const cv::Mat1b differ = cv::abs(fused->map.depth - unfused->depth) > 1e-3;
  EXPECT_LE(cv::countNonZero(differ), found / 500);
  EXPECT_LT(cv::norm(fused->map.confidence, unfused->confidence, cv::NORM_INF), 1e-3);
}

}  // namespace
}  // namespace efm::bench
