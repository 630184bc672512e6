// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/pictures/curve_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace efm {
namespace {

constexpr int kLegendLine = 18;    // pixels
constexpr int kLegendStroke = 24;  // pixels
constexpr int kSubpixelBits = 4;

/// Not NaN, and within the range of cv::line.
bool canBeDrawn(const cv::Point2d& pixel) {
  constexpr double kMaxPixel = 1e6;
  return std::abs(pixel.x) < kMaxPixel && std::abs(pixel.y) < kMaxPixel;
}

/// The uninterrupted lines of a curve, in pixels of the picture.
std::vector<std::vector<cv::Point2d>> linesOf(const Curve& curve, const PlotFrame& frame) {
  std::vector<std::vector<cv::Point2d>> lines(1);
  for (const cv::Point2d& point : curve.points) {
    const cv::Point2d pixel = frame.pixelOf(point);
    if (canBeDrawn(pixel)) {
      lines.back().push_back(pixel);
    } else if (!lines.back().empty()) {
      lines.emplace_back();
    }
  }
  return lines;
}

cv::Point subpixel(const cv::Point2d& pixel) {
  constexpr double kOnes = 1 << kSubpixelBits;
  return {cvRound(pixel.x * kOnes), cvRound(pixel.y * kOnes)};
}

/// @param picture the area of the frame: OpenCV cuts the curve at its edges.
void drawCurve(cv::Mat3b& picture, const Curve& curve, const PlotFrame& frame,
               const cv::Scalar& colour) {
  const cv::Point2d corner = frame.area.tl();
  for (const std::vector<cv::Point2d>& pixels : linesOf(curve, frame)) {
    for (std::size_t k = 0; k < pixels.size(); ++k) {
      const cv::Point at = subpixel(pixels[k] - corner);
      if (k > 0 && curve.style != CurveStyle::kDots) {
        cv::line(picture, subpixel(pixels[k - 1] - corner), at, colour, 2, cv::LINE_AA,
                 kSubpixelBits);
      }
      if (curve.style != CurveStyle::kLine || pixels.size() == 1) {
        cv::circle(picture, at, 3 << kSubpixelBits, colour, cv::FILLED, cv::LINE_AA, kSubpixelBits);
      }
    }
  }
}

/// Counts the positions on the curves that a rectangle with a gap around it would hide: eight
/// between two points.
int hiddenBy(const cv::Rect& rectangle, const CurvePlot& plot, const PlotFrame& frame) {
  constexpr int kBetween = 8;
  const cv::Rect box(rectangle.tl() - cv::Point(kPlotGap, kPlotGap),
                     rectangle.size() + cv::Size(2 * kPlotGap, 2 * kPlotGap));
  int hidden = 0;
  for (const Curve& curve : plot.curves) {
    for (const std::vector<cv::Point2d>& pixels : linesOf(curve, frame)) {
      for (std::size_t k = 0; k < pixels.size(); ++k) {
        const cv::Point2d& before = pixels[k > 0 ? k - 1 : 0];
        for (int part = 1; part <= kBetween; ++part) {
          const double fraction = static_cast<double>(part) / kBetween;
          const cv::Point2d at = before * (1 - fraction) + pixels[k] * fraction;
          if (box.contains(cv::Point(cvRound(at.x), cvRound(at.y)))) ++hidden;
        }
      }
    }
  }
  return hidden;
}

/// Tries the corners, the upper right first, and the middles of the left and right sides.
cv::Rect legendBox(cv::Size size, const CurvePlot& plot, const PlotFrame& frame) {
  const cv::Point low = frame.area.tl() + cv::Point(kPlotGap, kPlotGap);
  const cv::Point high =
      frame.area.br() - cv::Point(size.width + kPlotGap + 1, size.height + kPlotGap + 1);
  const int middle = (low.y + high.y) / 2;
  cv::Rect best;
  int min_hidden = std::numeric_limits<int>::max();
  for (const int y : {low.y, high.y, middle}) {
    for (const int x : {high.x, low.x}) {
      const cv::Rect box({x, y}, size);
      const int hidden = hiddenBy(box, plot, frame);
      if (hidden >= min_hidden) continue;
      min_hidden = hidden;
      best = box;
    }
  }
  return best;
}

cv::Vec3b colourOf(const CurvePlot& plot, std::size_t index) {
  return plot.curves[index].colour.value_or(curveColour(index));
}

void drawLegend(cv::Mat3b& picture, const CurvePlot& plot, const PlotFrame& frame) {
  int width = 0;
  int lines = 0;
  for (const Curve& curve : plot.curves) {
    if (curve.label.empty()) continue;
    width = std::max(width, plotTextSize(curve.label).width);
    ++lines;
  }
  if (lines == 0) return;
  const cv::Size size(width + kLegendStroke + 3 * kPlotGap, lines * kLegendLine + kPlotGap);
  const cv::Rect box = legendBox(size, plot, frame);
  cv::rectangle(picture, box, cv::Scalar::all(255), cv::FILLED);
  cv::rectangle(picture, box, kPlotGrid);
  int y = box.y + kPlotGap / 2 + kLegendLine / 2;
  for (std::size_t n = 0; n < plot.curves.size(); ++n) {
    const Curve& curve = plot.curves[n];
    if (curve.label.empty()) continue;
    const int x = box.x + kPlotGap;
    const cv::Scalar colour(colourOf(plot, n));
    if (curve.style != CurveStyle::kDots) {
      cv::line(picture, {x, y}, {x + kLegendStroke, y}, colour, 2, cv::LINE_AA);
    }
    if (curve.style != CurveStyle::kLine) {
      cv::circle(picture, {x + kLegendStroke / 2, y}, 3, colour, cv::FILLED, cv::LINE_AA);
    }
    writeText(picture, curve.label, {x + kLegendStroke + kPlotGap, y + 4});
    y += kLegendLine;
  }
}

}  // namespace

cv::Vec3b curveColour(std::size_t index) {
  static constexpr std::array<std::array<unsigned char, 3>, 7> kRgb = {{{0, 114, 178},
                                                                        {213, 94, 0},
                                                                        {0, 158, 115},
                                                                        {204, 121, 167},
                                                                        {230, 159, 0},
                                                                        {86, 180, 233},
                                                                        {60, 60, 60}}};
  const auto& rgb = kRgb[index % kRgb.size()];
  return {rgb[2], rgb[1], rgb[0]};
}

cv::Mat3b drawCurves(const CurvePlot& plot) {
  if (plot.size.width < 240 || plot.size.height < 180) {
    throw std::invalid_argument(
        "the plot '" + plot.title + "': " + std::to_string(plot.size.width) + "x" +
        std::to_string(plot.size.height) + " pixels: expected at least 240x180");
  }
  const PlotFrame frame = layOut(plot);
  cv::Mat3b picture(plot.size, cv::Vec3b(255, 255, 255));
  drawAxes(picture, plot, frame);
  cv::Mat3b inside = picture(frame.area);
  for (std::size_t n = 0; n < plot.curves.size(); ++n) {
    drawCurve(inside, plot.curves[n], frame, cv::Scalar(colourOf(plot, n)));
  }
  drawLegend(picture, plot, frame);
  return picture;
}

}  // namespace efm
