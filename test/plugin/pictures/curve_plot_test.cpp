// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/pictures/curve_plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

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

/// The rectangle around all pixels of exactly this colour.
cv::Rect boundsOf(const cv::Mat3b& picture, const cv::Vec3b& colour) {
  cv::Rect bounds;
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      if (picture(y, x) == colour) bounds |= cv::Rect(x, y, 1, 1);
    }
  }
  return bounds;
}

TEST(CurvePlot, DrawsAPointAtItsValuesOnTheAxes) {
  const auto place = [](const cv::Point2d& point) {
    const cv::Rect dot = boundsOf(drawCurves(plotOf({"", {point}, CurveStyle::kDots, kRed})), kRed);
    return cv::Point2d(dot.x + 0.5 * dot.width, dot.y + 0.5 * dot.height);
  };
  const cv::Point2d low = place({0.25, 0.25});
  const cv::Point2d middle = place({0.5, 0.5});
  const cv::Point2d high = place({0.75, 0.75});
  EXPECT_LT(low.x, middle.x);
  EXPECT_GT(low.y, middle.y) << "y grows upwards";
  EXPECT_NEAR(middle.x, 0.5 * (low.x + high.x), 1.5);
  EXPECT_NEAR(middle.y, 0.5 * (low.y + high.y), 1.5);
}

TEST(CurvePlot, ANanInterruptsTheLine) {
  const auto inTheMiddle = [](double y) {
    const Curve curve = {
        "", {{0, 0.5}, {0.4, 0.5}, {0.5, y}, {0.6, 0.5}, {1, 0.5}}, CurveStyle::kLine, kRed};
    const cv::Mat3b picture = drawCurves(plotOf(curve));
    const cv::Rect line = boundsOf(picture, kRed);
    return picture(line.y, line.x + line.width / 2);
  };
  EXPECT_EQ(inTheMiddle(0.5), kRed);
  EXPECT_NE(inTheMiddle(std::nan("")), kRed);
}

TEST(CurvePlot, CutsCurvesAtTheAxes) {
  const cv::Mat3b inside = drawCurves(plotOf({"", {{0, 0}, {1, 1}}, CurveStyle::kLine, kRed}));
  const cv::Mat3b beyond = drawCurves(plotOf({"", {{-5, -5}, {5, 5}}, CurveStyle::kLine, kRed}));
  const cv::Rect area = boundsOf(inside, kRed);
  const cv::Rect drawn = boundsOf(beyond, kRed);
  EXPECT_GE(drawn.x, area.x - 3);
  EXPECT_LE(drawn.br().x, area.br().x + 3);
  EXPECT_NO_THROW(drawCurves(plotOf({"", {{0, INFINITY}, {1, 1e300}}, CurveStyle::kLine, kRed})));
}

TEST(CurvePlot, ALegendHidesNoCurve) {
  // A curve through the upper right corner, where legends are put first.
  Curve curve = {
      "a curve", {{0.6, 0.9}, {0.8, 0.9}, {0.95, 0.9}, {0.95, 0.6}}, CurveStyle::kMarkedLine, kRed};
  const cv::Mat3b with = drawCurves(plotOf(curve));
  curve.label.clear();
  const cv::Mat3b without = drawCurves(plotOf(curve));
  for (int y = 0; y < with.rows; ++y) {
    for (int x = 0; x < with.cols; ++x) {
      if (without(y, x) != kRed) continue;
      ASSERT_EQ(with(y, x), kRed) << x << ", " << y;
    }
  }
}

TEST(CurvePlot, EqualUnitsShowASquareAsASquare) {
  CurvePlot plot;
  plot.curves = {{"", {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}}, CurveStyle::kLine, kRed}};
  plot.equal_units = true;
  plot.size = {500, 300};
  const cv::Rect square = boundsOf(drawCurves(plot), kRed);
  EXPECT_NEAR(square.width, square.height, 2);
}

TEST(CurvePlot, WithoutCurvesIsAnEmptyFrame) {
  const cv::Mat3b picture = drawCurves({});
  EXPECT_EQ(picture.size(), cv::Size(640, 480));
}

TEST(CurvePlot, AWrongPlotIsAnErrorThatNamesIt) {
  const auto errorOf = [](const CurvePlot& plot) -> std::string {
    try {
      drawCurves(plot);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "no error";
  };
  CurvePlot plot = plotOf({});
  plot.title = "errors";
  plot.x.from = 2;
  EXPECT_THAT(errorOf(plot), HasSubstr("the plot 'errors': the axis 'x' from 2"));
  plot = plotOf({});
  plot.y.scale = AxisScale::kLogarithmic;
  EXPECT_THAT(errorOf(plot), HasSubstr("the axis 'y' from 0"));
  plot = plotOf({});
  plot.size = {100, 100};
  EXPECT_THAT(errorOf(plot), HasSubstr("100x100 pixels"));
}

TEST(CurvePlot, ColoursAreDistinct) {
  for (std::size_t a = 0; a < 7; ++a) {
    for (std::size_t b = 0; b < a; ++b) EXPECT_GT(cv::norm(curveColour(a), curveColour(b)), 60);
  }
}

}  // namespace
}  // namespace efm
