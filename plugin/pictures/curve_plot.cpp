// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/pictures/curve_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "plugin/pictures/plot_frame.h"
#include "plugin/pictures/plot_text.h"

namespace efm {
namespace {

constexpr int kGap = 6;          // pixels between things
constexpr int kLegendLine = 18;  // pixels
constexpr int kLegendStroke = 24;
constexpr int kSubpixelBits = 4;

const cv::Scalar kGrid(225, 225, 225);
const cv::Scalar kPaper = cv::Scalar::all(255);

bool isPlace(const cv::Point2d& place) {
  constexpr double kFarthest = 1e6;  // pixels: what a drawn line can take
  return std::abs(place.x) < kFarthest && std::abs(place.y) < kFarthest;
}

/// The stretches of a curve that nothing interrupts, in pixels of the picture.
std::vector<std::vector<cv::Point2d>> stretchesOf(const Curve& curve, const PlotFrame& frame) {
  std::vector<std::vector<cv::Point2d>> stretches(1);
  for (const cv::Point2d& point : curve.points) {
    const cv::Point2d place = frame.place(point);
    if (isPlace(place)) {
      stretches.back().push_back(place);
    } else if (!stretches.back().empty()) {
      stretches.emplace_back();
    }
  }
  return stretches;
}

cv::Point subpixel(const cv::Point2d& place) {
  constexpr double kOnes = 1 << kSubpixelBits;
  return {cvRound(place.x * kOnes), cvRound(place.y * kOnes)};
}

/// @param picture the area of the frame alone, so that what lies beyond is cut off.
void drawCurve(cv::Mat3b& picture, const Curve& curve, const PlotFrame& frame,
               const cv::Scalar& colour) {
  const cv::Point2d corner = frame.area.tl();
  for (const std::vector<cv::Point2d>& places : stretchesOf(curve, frame)) {
    for (std::size_t k = 0; k < places.size(); ++k) {
      const cv::Point at = subpixel(places[k] - corner);
      if (k > 0 && curve.style != CurveStyle::kDots) {
        cv::line(picture, subpixel(places[k - 1] - corner), at, colour, 2, cv::LINE_AA,
                 kSubpixelBits);
      }
      if (curve.style != CurveStyle::kLine || places.size() == 1) {
        cv::circle(picture, at, 3 << kSubpixelBits, colour, cv::FILLED, cv::LINE_AA, kSubpixelBits);
      }
    }
  }
}

/// How many places along the curves a rectangle and a gap around it would hide, between their
/// points too.
int hiddenBy(const cv::Rect& rectangle, const CurvePlot& plot, const PlotFrame& frame) {
  constexpr int kBetween = 8;
  const cv::Rect box(rectangle.tl() - cv::Point(kGap, kGap),
                     rectangle.size() + cv::Size(2 * kGap, 2 * kGap));
  int hidden = 0;
  for (const Curve& curve : plot.curves) {
    for (const std::vector<cv::Point2d>& places : stretchesOf(curve, frame)) {
      for (std::size_t k = 0; k < places.size(); ++k) {
        const cv::Point2d& before = places[k > 0 ? k - 1 : 0];
        for (int part = 1; part <= kBetween; ++part) {
          const double share = static_cast<double>(part) / kBetween;
          const cv::Point2d at = before * (1 - share) + places[k] * share;
          if (box.contains(cv::Point(cvRound(at.x), cvRound(at.y)))) ++hidden;
        }
      }
    }
  }
  return hidden;
}

/// The corners and the middles of the sides, the upper right first.
cv::Rect legendPlace(cv::Size size, const CurvePlot& plot, const PlotFrame& frame) {
  const cv::Point low = frame.area.tl() + cv::Point(kGap, kGap);
  const cv::Point high = frame.area.br() - cv::Point(size.width + kGap + 1, size.height + kGap + 1);
  const int middle = (low.y + high.y) / 2;
  cv::Rect best;
  int fewest = std::numeric_limits<int>::max();
  for (const int y : {low.y, high.y, middle}) {
    for (const int x : {high.x, low.x}) {
      const cv::Rect box({x, y}, size);
      const int hidden = hiddenBy(box, plot, frame);
      if (hidden >= fewest) continue;
      fewest = hidden;
      best = box;
    }
  }
  return best;
}

cv::Vec3b colourOf(const CurvePlot& plot, std::size_t number) {
  return plot.curves[number].colour.value_or(curveColour(number));
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
  const cv::Size size(width + kLegendStroke + 3 * kGap, lines * kLegendLine + kGap);
  const cv::Rect box = legendPlace(size, plot, frame);
  cv::rectangle(picture, box, kPaper, cv::FILLED);
  cv::rectangle(picture, box, kGrid);
  int y = box.y + kGap / 2 + kLegendLine / 2;
  for (std::size_t n = 0; n < plot.curves.size(); ++n) {
    const Curve& curve = plot.curves[n];
    if (curve.label.empty()) continue;
    const int x = box.x + kGap;
    const cv::Scalar colour(colourOf(plot, n));
    if (curve.style != CurveStyle::kDots) {
      cv::line(picture, {x, y}, {x + kLegendStroke, y}, colour, 2, cv::LINE_AA);
    }
    if (curve.style != CurveStyle::kLine) {
      cv::circle(picture, {x + kLegendStroke / 2, y}, 3, colour, cv::FILLED, cv::LINE_AA);
    }
    writeText(picture, curve.label, {x + kLegendStroke + kGap, y + 4});
    y += kLegendLine;
  }
}

}  // namespace

cv::Vec3b curveColour(std::size_t number) {
  static constexpr std::array<std::array<unsigned char, 3>, 7> kRgb = {{{0, 114, 178},
                                                                        {213, 94, 0},
                                                                        {0, 158, 115},
                                                                        {204, 121, 167},
                                                                        {230, 159, 0},
                                                                        {86, 180, 233},
                                                                        {60, 60, 60}}};
  const auto& rgb = kRgb[number % kRgb.size()];
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
