// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/pictures/curve_plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "test/plugin/results/pictures/sketch.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::HasSubstr;

const cv::Vec3b kRed(0, 0, 255);

/// A plot from 0 to 1 on both axes.
CurvePlot plotOf(const Curve& curve) {
  CurvePlot plot;
  plot.x = {"x", AxisScale::kLinear, 0, 1};
  plot.y = {"y", AxisScale::kLinear, 0, 1};
  plot.curves = {curve};
  plot.size = {300, 200};
  return plot;
}

TEST(CurvePlot, HasAxesTicksLabelsLegendAndCurvesOfEachStyle) {
  CurvePlot plot;
  plot.title = "errors";
  plot.x.label = "time";
  plot.y.label = "metres";
  plot.y.from = 0;
  const double nan = std::nan("");
  plot.curves = {
      {"line", {{0, 1}, {1, 3}, {1.4, 3}, {1.5, nan}, {1.6, 3}, {3, 1}}, CurveStyle::kLine},
      {"marked", {{0, 5}, {3, 5.5}}, CurveStyle::kMarkedLine},
      {"dots", {{0.5, 7}, {1, 8}, {2.7, 9}}, CurveStyle::kDots},
      {"", {{2, 6.5}}, CurveStyle::kLine, kRed}};
  plot.size = {360, 240};
  EXPECT_EQ(test::sketchOf(drawCurves(plot), 12), R"(

              ++++
    ########################
   #.       .      .     c .#
   #.       c      .       .#
   #.   c   .      .       .#
   #.   c   .      rr      .#
++ #.       .      r       .#
++++rrrrrrrrrrrrrrrrrrrrrrrr#
++ #rrrr    .      .       .#
++ #.       .      .........#
+  #.       cccc c .ccc++  .#
   #.    ccc.    ccccr  ++ +#
   #. cccc  .      .rrr+++++#
   #ccc     .      ..c +++ .#
   #.       .      .........#
  ++########################
    ++      +      ++      +
               +++
               ++
6223 px at 195.3, 125.2
)");
}

TEST(CurvePlot, MayBeLogarithmicOrHaveEqualUnits) {
  CurvePlot plot;
  plot.x = {"", AxisScale::kLogarithmic};
  plot.y = {"", AxisScale::kLinear, {}, 2};
  plot.curves = {{"", {{0, 9}, {0.01, 0}, {1, 1}, {100, 1}}, CurveStyle::kMarkedLine}};
  plot.size = {240, 180};
  EXPECT_EQ(test::sketchOf(drawCurves(plot), 12), R"(
 +
 +####+#######+####
  #   .       .   #
  #   .       .   #
  #   .       .   #
 +#   .   cccccccc#
  #.....cccccccccc+
  #   .cc     .   #
  #   cc      .   #
  # cc.       .   #
 +ccc.............#
 +c   .       .   #
  ####+#######+####
     +++     ++
      +       +
2534 px at 115.9, 93.0
)");
  plot = {};
  plot.curves = {{"", {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}}, CurveStyle::kLine, kRed}};
  plot.equal_units = true;
  plot.size = {360, 180};
  EXPECT_EQ(test::sketchOf(drawCurves(plot), 12), R"(

  +#++++++rrrrrrrrrrrr++++++#
   # .    r    .    rr    . #
   # .    r    .    rr    . #
   # .    r    .    rr    . #
   # .    r    .    rr    . #
 ++#......r.........rr......#
 ++# .    r    .    rr    . #
   # .    r    .    rr    . #
   # .    r    .    rr    . #
   # .    r    .    rr    . #
  +#......rrrrrrrrrrrr......#
  +##+####rrrrrrrrrrr+####+##
    +++   +    ++    #   ++
     ++   +    ++         +
4599 px at 180.8, 91.3
)");
  EXPECT_EQ(drawCurves({}).size(), cv::Size(640, 480));
  EXPECT_NO_THROW(drawCurves(plotOf({"", {{0, INFINITY}, {1, 1e300}}, CurveStyle::kLine, kRed})));
}

TEST(CurvePlot, ACurveLeavesThePlotOnItsWayToAPointFarOutside) {
  Curve steep{"", {{0, 0}, {0.1, 100}}, CurveStyle::kLine, kRed};
  const cv::Mat3b picture = drawCurves(plotOf(steep));
  cv::Mat1b red;
  cv::inRange(picture, kRed, kRed, red);
  const cv::Rect drawn = cv::boundingRect(red);
  EXPECT_GT(drawn.height, 100) << "from the foot of the plot to its top";
  EXPECT_LT(drawn.width, 6);
}

TEST(CurvePlot, AWrongPlotIsAnErrorThatNamesIt) {
  const auto errorOf = [](const auto& change) {
    CurvePlot plot = plotOf({});
    plot.title = "errors";
    change(plot);
    return messageOf([&] { drawCurves(plot); });
  };
  EXPECT_THAT(errorOf([](auto& p) { p.x.from = 2; }),
              HasSubstr("the plot 'errors': the axis 'x' from 2"));
  EXPECT_THAT(errorOf([](auto& p) { p.y.to = INFINITY; }), HasSubstr("the axis 'y' from 0"));
  EXPECT_THAT(errorOf([](auto& p) { p.y.scale = AxisScale::kLogarithmic; }),
              HasSubstr("the axis 'y' from 0"));
  EXPECT_THAT(errorOf([](auto& p) { p.size = {239, 180}; }), HasSubstr("239x180 pixels"));
  EXPECT_THAT(errorOf([](auto& p) { p.size = {240, 179}; }), HasSubstr("240x179 pixels"));
  EXPECT_EQ(errorOf([](auto& p) { p.size = {240, 180}; }), "no error");
}

}  // namespace
}  // namespace efm
