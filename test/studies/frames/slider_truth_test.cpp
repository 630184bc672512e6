// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/frames/slider_truth.h"

#include <gtest/gtest.h>

namespace efm::studies {
namespace {

/// A dark field with a bright block: rows 20 to 39, columns 30 to 59.
cv::Mat1f block() {
  cv::Mat1f grey(60, 90, 40.0F);
  grey(cv::Rect(30, 20, 30, 20)) = 90;
  return grey;
}

TEST(EdgeKinds, TellHowAnEdgeRuns) {
  const EdgeKinds edges = edgeKinds(block());
  EXPECT_EQ(edges.kindNear(45, 20), EdgeKind::kHorizontal);
  EXPECT_EQ(edges.kindNear(45, 40), EdgeKind::kHorizontal);
  EXPECT_EQ(edges.kindNear(30, 30), EdgeKind::kVertical);
  EXPECT_EQ(edges.kindNear(60, 30), EdgeKind::kVertical);
  EXPECT_EQ(edges.kindNear(30, 20), EdgeKind::kOblique);  // a corner
  EXPECT_EQ(edges.kindNear(45, 30), EdgeKind::kNone);
  EXPECT_EQ(edges.kindNear(10, 10), EdgeKind::kNone);
}

TEST(EdgeKinds, LinesAreOnePixelWide) {
  const EdgeKinds edges = edgeKinds(block());
  EXPECT_EQ(cv::countNonZero(edges.vertical_lines.row(30)), 2);
  EXPECT_EQ(cv::countNonZero(edges.horizontal_lines.col(45)), 2);
  EXPECT_EQ(cv::countNonZero(edges.horizontal_lines.row(30)), 0);
}

TEST(EdgeKinds, RejectAnglesThatOverlap) {
  EdgeKindOptions options;
  options.vertical_deg = 80;
  EXPECT_THROW(edgeKinds(block(), options), std::invalid_argument);
}

class ScoreOnSlider : public ::testing::Test {
 protected:
  ScoreOnSlider() {
    truth_.edges = edgeKinds(block());
    truth_.frames.depth = cv::Mat1f(60, 90, 0.0F);
    truth_.frames.depth(cv::Rect(28, 18, 34, 24)) = 1;
  }
  SliderTruth truth_;
  cv::Mat1f depth_m_ = cv::Mat1f(60, 90, 0.0F);
};

TEST_F(ScoreOnSlider, CountsWhatWasWorkedOutByHand) {
  // On the left edge 10 points, 2 of them wrong; on the top edge 5, 3 of them wrong; 5 where the
  // frames know nothing and there is no edge.
  for (int y = 24; y < 34; ++y) depth_m_(y, 30) = y < 26 ? 1.2F : 1.02F;
  for (int x = 40; x < 45; ++x) depth_m_(20, x) = x < 43 ? 0.8F : 1.0F;
  for (int x = 5; x < 10; ++x) depth_m_(5, x) = 2;
  const SliderScore score = scoreOnSlider(depth_m_, truth_);
  EXPECT_EQ(score.points, 20U);
  EXPECT_EQ(score.with_truth, 15U);
  EXPECT_NEAR(score.median_error, 0.02, 1e-6);
  EXPECT_DOUBLE_EQ(score.beyond_10, 5.0 / 15);
  EXPECT_DOUBLE_EQ(score.vertical_beyond_10, 0.2);
  EXPECT_DOUBLE_EQ(score.horizontal_beyond_10, 0.6);
  EXPECT_DOUBLE_EQ(score.on_horizontal, 0.25);
  // 12 of the lines' pixels: the 10 and one at each end. Corners are on no line.
  const int lines = cv::countNonZero(truth_.edges.vertical_lines);
  EXPECT_DOUBLE_EQ(score.vertical_covered, 12.0 / lines);
}

TEST_F(ScoreOnSlider, IsZeroWithoutPoints) {
  const SliderScore score = scoreOnSlider(depth_m_, truth_);
  EXPECT_EQ(score.points, 0U);
  EXPECT_EQ(score.beyond_10, 0);
  EXPECT_EQ(score.vertical_covered, 0);
}

}  // namespace
}  // namespace efm::studies
