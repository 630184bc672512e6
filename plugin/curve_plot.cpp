// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/curve_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace efm {
namespace {

constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr double kTextScale = 0.42;
constexpr double kTitleScale = 0.5;
constexpr int kGap = 6;          // pixels between things
constexpr int kLegendLine = 18;  // pixels
constexpr int kLegendStroke = 24;
constexpr int kSubpixelBits = 4;

const cv::Scalar kInk(40, 40, 40);
const cv::Scalar kGrid(225, 225, 225);
const cv::Scalar kPaper = cv::Scalar::all(255);

cv::Size sizeOf(const std::string& text, double scale = kTextScale) {
  int baseline = 0;
  const cv::Size size = cv::getTextSize(text, kFont, scale, 1, &baseline);
  return {size.width, size.height + baseline};
}

/// @param at the lower left corner of the letters.
void write(cv::Mat3b& picture, const std::string& text, cv::Point at, double scale = kTextScale) {
  cv::putText(picture, text, at, kFont, scale, kInk, 1, cv::LINE_AA);
}

void writeUpwards(cv::Mat3b& picture, const std::string& text, cv::Point centre) {
  const cv::Size size = sizeOf(text) + cv::Size(2, 2);
  cv::Mat3b sideways(size, cv::Vec3b(255, 255, 255));
  write(sideways, text, {0, size.height - 6});
  cv::Mat3b upright;
  cv::rotate(sideways, upright, cv::ROTATE_90_COUNTERCLOCKWISE);
  const cv::Rect place(centre - cv::Point(upright.cols / 2, upright.rows / 2), upright.size());
  const cv::Rect seen = place & cv::Rect({}, picture.size());
  upright(seen - place.tl()).copyTo(picture(seen));
}

AxisRange rangeOf(const CurvePlot& plot, const PlotAxis& axis, bool across) {
  std::vector<double> values;
  for (const Curve& curve : plot.curves) {
    for (const cv::Point2d& point : curve.points) values.push_back(across ? point.x : point.y);
  }
  // A given end belongs to what is seen, so that the other leaves it some room.
  for (const auto& end : {axis.from, axis.to}) {
    if (end) values.push_back(*end);
  }
  AxisRange range = rangeAround(values, axis.scale);
  if (axis.from) range.from = *axis.from;
  if (axis.to) range.to = *axis.to;
  const bool fits = std::isfinite(range.from) && std::isfinite(range.to) && range.from < range.to &&
                    (axis.scale == AxisScale::kLinear || range.from > 0);
  if (!fits) {
    throw std::invalid_argument("the plot '" + plot.title + "': the axis '" + axis.label +
                                "' from " + std::to_string(range.from) + " to " +
                                std::to_string(range.to) +
                                ": expected ends in this order, above 0 where it is logarithmic");
  }
  return range;
}

/// Widens the range that has more pixels per unit.
void makeUnitsEqual(AxisRange& x, AxisRange& y, cv::Size pixels) {
  const double per_pixel =
      std::max((x.to - x.from) / pixels.width, (y.to - y.from) / pixels.height);
  const auto widen = [&](AxisRange& range, int length) {
    const double middle = 0.5 * (range.from + range.to);
    range.from = middle - 0.5 * per_pixel * length;
    range.to = middle + 0.5 * per_pixel * length;
  };
  widen(x, pixels.width);
  widen(y, pixels.height);
}

/// The rectangle that curves are drawn in, and where values lie in it.
struct Frame {
  cv::Rect area;
  AxisRange x;
  AxisRange y;

  double column(double value) const { return area.x + x.shareAlong(value) * (area.width - 1); }
  double row(double value) const {
    return area.br().y - 1 - y.shareAlong(value) * (area.height - 1);
  }
  cv::Point2d place(const cv::Point2d& point) const { return {column(point.x), row(point.y)}; }
};

int ticksSideways(const cv::Rect& area) { return std::max(2, area.width / 55); }
int ticksUpwards(const cv::Rect& area) { return std::max(2, area.height / 36); }

Frame layOut(const CurvePlot& plot) {
  Frame frame;
  frame.x = rangeOf(plot, plot.x, true);
  frame.y = rangeOf(plot, plot.y, false);
  const int line = sizeOf("0").height;
  const auto areaWith = [&](int tick_width) {
    const int left = 2 * kGap + (plot.y.label.empty() ? 0 : line + kGap) + tick_width + kGap;
    const int top = plot.title.empty() ? 2 * kGap : line + 3 * kGap;
    const int bottom = 2 * kGap + line + (plot.x.label.empty() ? 0 : line + kGap);
    return cv::Rect(left, top, plot.size.width - left - 3 * kGap, plot.size.height - top - bottom);
  };
  frame.area = areaWith(0);
  if (plot.equal_units) makeUnitsEqual(frame.x, frame.y, frame.area.size());
  int tick_width = 0;
  for (const AxisTick& tick : ticksOf(frame.y, ticksUpwards(frame.area))) {
    tick_width = std::max(tick_width, sizeOf(tick.text).width);
  }
  frame.area = areaWith(tick_width);
  if (plot.equal_units) makeUnitsEqual(frame.x, frame.y, frame.area.size());
  return frame;
}

void drawAxes(cv::Mat3b& picture, const CurvePlot& plot, const Frame& frame) {
  const cv::Rect& area = frame.area;
  const int bottom = area.br().y - 1;
  const int right = area.br().x - 1;
  for (const AxisTick& tick : ticksOf(frame.x, ticksSideways(area))) {
    const int x = cvRound(frame.column(tick.value));
    cv::line(picture, {x, area.y}, {x, bottom}, kGrid);
    cv::line(picture, {x, bottom}, {x, bottom + 3}, kInk);
    const cv::Size size = sizeOf(tick.text);
    write(picture, tick.text, {x - size.width / 2, bottom + kGap + size.height - 3});
  }
  for (const AxisTick& tick : ticksOf(frame.y, ticksUpwards(area))) {
    const int y = cvRound(frame.row(tick.value));
    cv::line(picture, {area.x, y}, {right, y}, kGrid);
    cv::line(picture, {area.x - 3, y}, {area.x, y}, kInk);
    write(picture, tick.text, {area.x - kGap - sizeOf(tick.text).width, y + 4});
  }
  cv::rectangle(picture, area, kInk);

  const int middle = area.x + area.width / 2;
  write(picture, plot.x.label,
        {middle - sizeOf(plot.x.label).width / 2, picture.rows - 2 * kGap + 2});
  if (!plot.y.label.empty()) {
    writeUpwards(picture, plot.y.label, {2 * kGap, area.y + area.height / 2});
  }
  write(picture, plot.title,
        {std::max(kGap, middle - sizeOf(plot.title, kTitleScale).width / 2), area.y - kGap - 2},
        kTitleScale);
}

bool isPlace(const cv::Point2d& place) {
  constexpr double kFarthest = 1e6;  // pixels: what a drawn line can take
  return std::abs(place.x) < kFarthest && std::abs(place.y) < kFarthest;
}

/// The stretches of a curve that nothing interrupts, in pixels of the picture.
std::vector<std::vector<cv::Point2d>> stretchesOf(const Curve& curve, const Frame& frame) {
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
void drawCurve(cv::Mat3b& picture, const Curve& curve, const Frame& frame,
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
int hiddenBy(const cv::Rect& rectangle, const CurvePlot& plot, const Frame& frame) {
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

cv::Rect legendPlace(cv::Size size, const CurvePlot& plot, const Frame& frame) {
  const cv::Point low = frame.area.tl() + cv::Point(kGap, kGap);
  const cv::Point high = frame.area.br() - cv::Point(size.width + kGap + 1, size.height + kGap + 1);
  const std::array<cv::Point, 4> corners = {cv::Point(high.x, low.y), low, high,
                                            cv::Point(low.x, high.y)};
  cv::Rect best(corners[0], size);
  int fewest = hiddenBy(best, plot, frame);
  for (const cv::Point& corner : corners) {
    const cv::Rect box(corner, size);
    const int hidden = hiddenBy(box, plot, frame);
    if (hidden >= fewest) continue;
    fewest = hidden;
    best = box;
  }
  return best;
}

cv::Vec3b colourOf(const CurvePlot& plot, std::size_t number) {
  return plot.curves[number].colour.value_or(curveColour(number));
}

void drawLegend(cv::Mat3b& picture, const CurvePlot& plot, const Frame& frame) {
  int width = 0;
  int lines = 0;
  for (const Curve& curve : plot.curves) {
    if (curve.label.empty()) continue;
    width = std::max(width, sizeOf(curve.label).width);
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
    write(picture, curve.label, {x + kLegendStroke + kGap, y + 4});
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
  const Frame frame = layOut(plot);
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
