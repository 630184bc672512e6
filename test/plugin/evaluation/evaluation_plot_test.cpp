// SPDX-License-Identifier: BSD-3-Clause

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "plugin/evaluation/cloud_evaluation.h"
#include "plugin/evaluation/depth_evaluation.h"
#include "plugin/evaluation/trajectory_evaluation.h"
#include "plugin/results/pictures/depth_picture.h"
#include "test/plugin/results/pictures/sketch.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

TEST(ValuePicture, NanIsWhiteOrWhatLiesUnder) {
  ValuePicture picture;
  picture.values = (cv::Mat1f(1, 3) << 1, NAN, 3);
  picture.range = {1, 3};
  picture.min_width = 300;
  const cv::Mat3b drawn = drawValues(picture);
  ASSERT_GE(drawn.cols, 300);
  const int middle = 24 + drawn.cols / 6;  // below the title
  const cv::Vec3b low = drawn(middle, drawn.cols / 6);
  EXPECT_EQ(drawn(middle, drawn.cols / 2), cv::Vec3b(255, 255, 255));
  picture.under = (cv::Mat1b(1, 3) << 0, 200, 0);
  EXPECT_EQ(drawValues(picture)(middle, drawn.cols / 2), cv::Vec3b(200, 200, 200));
  EXPECT_EQ(drawValues(picture)(middle, drawn.cols / 6), low) << "grey is under the values alone";
  EXPECT_THROW(drawValues({}), std::invalid_argument);
}

class EvaluationPlot : public TemporaryFolder {
 protected:
  /// A depth map of one depth with a hole, and twice the depth in its lower half.
  std::filesystem::path tiff(const std::string& name, float depth_m) const {
    const auto file = folder() / name;
    std::filesystem::create_directories(file.parent_path());
    cv::Mat1f depth(30, 40, depth_m);
    depth.rowRange(15, 30) *= 2;
    depth(cv::Rect(0, 0, 10, 10)) = 0;
    cv::imwrite(file.string(), depth);
    return file;
  }
};

TEST_F(EvaluationPlot, OfDepthShowsThreeImagesAboveTheCurves) {
  const auto plotOf = [](const auto& estimate, const auto& truth) {
    return test::sketchOf(evaluationPlot(evaluateDepth(estimate, truth, {}), {}), 50);
  };
  EXPECT_NE(plotOf(tiff("a.tiff", 2), folder() / "a.tiff"), "") << "without an error";
  tiff("out/1/depth.tiff", 2);
  tiff("out/2/depth.tiff", 2.1F);
  tiff("out/3/depth.tiff", 2.5F);
  tiff("data/1.tiff", 2.2F);
  tiff("data/2.tiff", 2.2F);
  tiff("data/3.tiff", 2.2F);
  EXPECT_EQ(plotOf(folder() / "out", folder() / "data"), R"(
 +yyyyyyyyyyyybcggggg
  yyyyyyyyyyyybcggggg
yyyyyyyyyyyyyyggggggg
bbbbbbbbbbbbbbrrrrrrr
bbbbbbbbbbbbbbrrrrrrr
rmmmmbb#+mmbbbmb#yrrr
    +++ccc    ++++
 ++   c    +++     rr
      c    +      r+c
+    c    +++r   rc
+    c      cc+rrc
     c         cc
 +ccc
  +++++       ++++
260318 px at 535.2, 188.8
)") << "three maps";
}

TEST_F(EvaluationPlot, OfATrajectoryShowsItFromItsNarrowestSideAndItsErrors) {
  TrajectoryEvaluation evaluation;
  for (int i = 0; i < 20; ++i) {
    const double t = 0.1 * i;
    evaluation.pairs.push_back({100'000'000 * i,
                                {{1, 0, 0, 0}, {t - 1, 0.1, 1.5 * t * t}},
                                {{1, 0, 0, 0}, {t, 0.01 * t, t * t}}});
    evaluation.errors.translation_m.push_back(0.2 + 0.1 * t);
    evaluation.errors.rotation_rad.push_back(0.1 - 0.04 * t);
  }
  evaluation.T_world_map.translation = {1, 0, 0};
  EXPECT_EQ(test::sketchOf(evaluationPlot(evaluation), 40), R"(
      +++      + ++++++++++
 +       r++++        ccccc
 +       r    + cccccc
 +      r     ++
 +      r+
        r+         +
++      r          +++++
       r+       c++++++#++
 +     r+     ++ cccc
       r      +      ccc
 +    r+      ++        cccc
 +   rr        +
       +           +++++
35529 px at 574.4, 241.6
)");
  TrajectoryEvaluation exact;
  exact.pairs = {{0, {}, {}}};
  exact.errors = {{0}, {0}};
  EXPECT_FALSE(evaluationPlot(exact).empty());
}

TEST_F(EvaluationPlot, OfACloudDrawsItsDistancesInOrder) {
  CloudEvaluation evaluation;
  evaluation.errors.steps = {
      {1, 1, 0, 0.9, 0.95}, {0.1, 0.2, 0.8, 0.1, 0.13}, {0.3, 0.6, 0, 0.5, 0.5}};
  EXPECT_EQ(test::sketchOf(evaluationPlot(evaluation), 40), R"(
       +++
 +++++++     cc+
 +c        cc+y
 +        ccy
 +      ccyy
++    cccy
++   ccg
 + ccyy
 +ccy
 +yy

        ++
21621 px at 301.9, 208.5
)");
}

}  // namespace
}  // namespace efm
