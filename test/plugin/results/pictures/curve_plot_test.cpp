// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>
#include <opencv2/imgproc.hpp>

#include <cmath>
#include <limits>

#include "plugin/results/pictures/curve_plot.h"
#include "test/plugin/results/pictures/sketch.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::ElementsAre;

std::vector<std::string> textsOf(const AxisRange& range, int max_ticks) {
  std::vector<std::string> texts;
  for (const AxisTick& tick : ticksOf(range, max_ticks)) texts.push_back(tick.text);
  return texts;
}

TEST(PlotAxis, TicksAreRoundNumbersAndOnLogarithmicAxesPowersOfTenOrValuesBetweenThem) {
  EXPECT_THAT(textsOf({0, 1}, 6), ElementsAre("0", "0.2", "0.4", "0.6", "0.8", "1"));
  EXPECT_THAT(textsOf({0, 102}, 6), ElementsAre("0", "20", "40", "60", "80", "100"));
  EXPECT_THAT(textsOf({-0.7, 2.3}, 5), ElementsAre("0", "1", "2"));
  EXPECT_THAT(textsOf({12.3, 12.9}, 4), ElementsAre("12.4", "12.6", "12.8"));
  EXPECT_THAT(textsOf({0, 1}, 5), ElementsAre("0", "0.5", "1"));
  EXPECT_THAT(textsOf({0, 1}, 2), ElementsAre("0", "1"));
  EXPECT_THAT(textsOf({0.01, 1, AxisScale::kLogarithmic}, 7),
              ElementsAre("0.01", "0.02", "0.05", "0.1", "0.2", "0.5", "1"));
  EXPECT_THAT(textsOf({1, 1e6, AxisScale::kLogarithmic}, 7),
              ElementsAre("1", "10", "100", "1000", "10000", "100000", "1e+06"));
  EXPECT_THAT(textsOf({1, 1e6, AxisScale::kLogarithmic}, 4),
              ElementsAre("1", "100", "10000", "1e+06"));
  EXPECT_THAT(textsOf({0.7, 3.2, AxisScale::kLogarithmic}, 5),
              ElementsAre("1", "1.5", "2", "2.5", "3"))
      << "a short axis: evenly apart";
}

TEST(PlotAxis, ALogarithmicAxisHasEqualFactorsOnEqualLengthsAnInverseOneEqualInverses) {
  const AxisRange range{1, 100, AxisScale::kLogarithmic};
  EXPECT_DOUBLE_EQ(range.fractionAlong(10), 0.5);
  EXPECT_TRUE(std::isnan(range.fractionAlong(0)));
  EXPECT_TRUE(std::isnan(range.fractionAlong(-1)));
  const AxisRange inverse{0.77, 6.4, AxisScale::kInverse};  // equal steps of the inverse
  EXPECT_DOUBLE_EQ(inverse.fractionAlong(0.77), 0);
  EXPECT_DOUBLE_EQ(inverse.fractionAlong(6.4), 1);
  EXPECT_NEAR(inverse.fractionAlong(2 / (1 / 0.77 + 1 / 6.4)), 0.5, 1e-12);
  EXPECT_TRUE(std::isnan(inverse.fractionAlong(0)));
  EXPECT_THAT(textsOf(inverse, 6), ElementsAre("0.8", "1", "2", "5"));
  EXPECT_THAT(textsOf({1.05, 1.35, AxisScale::kInverse}, 3), ElementsAre("1.1", "1.2", "1.3"));
}

TEST(PlotAxis, HasAMarginOf4PercentAndARangeForNoValueAndForOneValue) {
  struct Case {
    std::vector<double> values;
    AxisScale scale;
    double from, to;
  };
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const Case& of :
       {Case{{3, NAN, 1, kInfinity, 2}, AxisScale::kLinear, 0.92, 3.08},
        {{}, AxisScale::kLinear, -0.1, 0.1},
        {{-5}, AxisScale::kLinear, -5.5, -4.5},
        {{0.2}, AxisScale::kLinear, 0.1, 0.3},
        {{1e300, 1e300}, AxisScale::kLinear, 0.9e300, 1.1e300},
        {{1, 100, 0, -1}, AxisScale::kLogarithmic, std::pow(10, -0.08), std::pow(10, 2.08)},
        {{1, 10}, AxisScale::kInverse, std::pow(10, -0.04), std::pow(10, 1.04)},
        {{-1}, AxisScale::kLogarithmic, std::pow(10, -0.1), std::pow(10, 0.1)}}) {
    const AxisRange range = rangeAround(of.values, of.scale);
    EXPECT_DOUBLE_EQ(range.from, of.from);
    EXPECT_DOUBLE_EQ(range.to, of.to);
    EXPECT_EQ(range.scale, of.scale);
  }
  EXPECT_TRUE(ticksOf({1, 1}, 5).empty());
}

RC_GTEST_PROP(PlotAxis, ContainsAllValuesAndItsTicks, ()) {
  const auto drawn = *rc::gen::nonEmpty<std::vector<int>>();
  const double unit = std::pow(10.0, *rc::gen::inRange(-12, 12));
  std::vector<double> values;
  for (const int value : drawn) values.push_back(value * unit);
  const AxisRange range = rangeAround(values, AxisScale::kLinear);
  for (const double value : values) {
    RC_ASSERT(range.fractionAlong(value) > 0);
    RC_ASSERT(range.fractionAlong(value) < 1);
  }
  const auto ticks = ticksOf(range, 6);
  RC_ASSERT(!ticks.empty());
  RC_ASSERT(ticks.size() <= 6U);
  for (const AxisTick& tick : ticks) {
    RC_ASSERT(range.fractionAlong(tick.value) > -1e-6);
    RC_ASSERT(range.fractionAlong(tick.value) < 1 + 1e-6);
  }
}

using testing::HasSubstr;

const cv::Vec3b kRed(0, 0, 255);

/// Returns a plot from 0 to 1 on both axes.
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
