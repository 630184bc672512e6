// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/pictures/curve_plot.h"

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace efm {
namespace {

constexpr double kMargin = 0.04;

std::string shortText(double value) { return fmt::format("{:.6g}", value); }

/// Returns the smallest of 1, 2, 5 times a power of ten that is `min_step` or more.
double roundStep(double min_step) {
  const double power = std::pow(10.0, std::floor(std::log10(min_step)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= min_step * (1 - 1e-9)) return factor * power;
  }
  return 10 * power;
}

std::vector<AxisTick> multiplesInside(const AxisRange& range, double step) {
  const double slack = 1e-9 * step;
  const double last = std::floor((range.to + slack) / step);
  std::vector<AxisTick> ticks;
  // Adding 0.0 converts -0 to 0.
  for (double k = std::ceil((range.from - slack) / step) + 0.0; k <= last; ++k) {
    ticks.push_back({k * step, shortText(k * step)});
  }
  return ticks;
}

std::vector<AxisTick> linearTicks(const AxisRange& range, int max_ticks) {
  double step = roundStep((range.to - range.from) / (max_ticks + 1));
  std::vector<AxisTick> ticks = multiplesInside(range, step);
  while (ticks.size() > static_cast<std::size_t>(max_ticks)) {
    step = roundStep(1.5 * step);
    ticks = multiplesInside(range, step);
  }
  return ticks;
}

/// Returns powers of ten times each factor inside the range; uses every `stride`-th power.
std::vector<AxisTick> powersInside(const AxisRange& range, const std::vector<double>& factors,
                                   int stride) {
  const int first = static_cast<int>(std::floor(std::log10(range.from)));
  const int last = static_cast<int>(std::ceil(std::log10(range.to)));
  std::vector<AxisTick> ticks;
  for (int power = first; power <= last; power += stride) {
    for (const double factor : factors) {
      const double value = factor * std::pow(10.0, power);
      if (value < range.from * (1 - 1e-9) || value > range.to * (1 + 1e-9)) continue;
      ticks.push_back({value, shortText(value)});
    }
  }
  return ticks;
}

std::vector<AxisTick> logarithmicTicks(const AxisRange& range, int max_ticks) {
  const auto max_size = static_cast<std::size_t>(max_ticks);
  std::vector<AxisTick> ticks = powersInside(range, {1, 2, 5}, 1);
  // Over a short interval the axis is nearly linear.
  if (ticks.size() < 3) return linearTicks(range, max_ticks);
  if (ticks.size() <= max_size + 2) return ticks;
  for (int stride = 1; (ticks = powersInside(range, {1}, stride)).size() > max_size; ++stride) {
  }
  return ticks;
}

/// Selects values in the order of roundness, if they have space beside the values so far.
std::vector<AxisTick> inverseTicks(const AxisRange& range, int max_ticks) {
  static const std::vector<double> kRoundness[] = {{1}, {2, 5}, {1.5, 3}, {4, 7}, {1.2, 2.5, 6, 8}};
  std::vector<AxisTick> ticks;
  for (const std::vector<double>& factors : kRoundness) {
    for (const AxisTick& tick : powersInside(range, factors, 1)) {
      const double at = range.fractionAlong(tick.value);
      const bool has_space = std::none_of(ticks.begin(), ticks.end(), [&](const AxisTick& other) {
        return std::abs(range.fractionAlong(other.value) - at) * max_ticks < 1;
      });
      if (has_space) ticks.push_back(tick);
    }
  }
  if (ticks.size() < 2) return linearTicks(range, max_ticks);
  std::sort(ticks.begin(), ticks.end(),
            [](const AxisTick& a, const AxisTick& b) { return a.value < b.value; });
  return ticks;
}

}  // namespace

double AxisRange::fractionAlong(double value) const {
  if (scale == AxisScale::kLinear) return (value - from) / (to - from);
  if (!(value > 0)) return std::numeric_limits<double>::quiet_NaN();
  if (scale == AxisScale::kInverse) return (1 / value - 1 / from) / (1 / to - 1 / from);
  return std::log(value / from) / std::log(to / from);
}

AxisRange rangeAround(const std::vector<double>& values, AxisScale scale) {
  const bool logarithmic = scale != AxisScale::kLinear;
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const double value : values) {
    if (!std::isfinite(value) || (logarithmic && !(value > 0))) continue;
    const double position = logarithmic ? std::log10(value) : value;
    low = std::min(low, position);
    high = std::max(high, position);
  }
  if (low > high) low = high = 0;
  double margin = kMargin * (high - low);
  if (!(margin > 1e-12 * std::abs(high))) margin = std::max(0.1, 0.1 * std::abs(high));
  low -= margin;
  high += margin;
  if (logarithmic) return {std::pow(10.0, low), std::pow(10.0, high), scale};
  return {low, high, scale};
}

std::vector<AxisTick> ticksOf(const AxisRange& range, int max_ticks) {
  if (!(range.from < range.to)) return {};
  switch (range.scale) {
    case AxisScale::kLogarithmic:
      return logarithmicTicks(range, max_ticks);
    case AxisScale::kInverse:
      return inverseTicks(range, max_ticks);
    case AxisScale::kLinear:
      break;
  }
  return linearTicks(range, max_ticks);
}

namespace {

constexpr int kPlotFont = cv::FONT_HERSHEY_SIMPLEX;

/// Returns the thickness of a text's strokes, in pixels.
int thicknessOf(double scale) { return std::max(1, cvRound(1.7 * scale)); }

}  // namespace

cv::Size plotTextSize(const std::string& text, double scale) {
  int baseline = 0;
  const cv::Size size = cv::getTextSize(text, kPlotFont, scale, thicknessOf(scale), &baseline);
  return {size.width, size.height + baseline};
}

void writeText(cv::Mat3b& picture, const std::string& text, cv::Point at, double scale) {
  cv::putText(picture, text, at, kPlotFont, scale, kPlotInk, thicknessOf(scale), cv::LINE_AA);
}

namespace {

constexpr int kPlotGap = 6;  // pixels between two parts
constexpr double kPlotTitleScale = 0.5;
const cv::Scalar kPlotGrid = cv::Scalar::all(225);
constexpr int kLegendLine = 18;    // pixels
constexpr int kLegendStroke = 24;  // pixels

/// The rectangle that curves are drawn in, and the values at its edges.
struct PlotFrame {
  cv::Rect area;  ///< Pixels of the picture.
  AxisRange x;
  AxisRange y;

  /// Returns the pixel of a point. NaN for a value that a logarithmic axis cannot show.
  cv::Point2d pixelOf(const cv::Point2d& point) const {
    return {area.x + x.fractionAlong(point.x) * (area.width - 1),
            area.br().y - 1 - y.fractionAlong(point.y) * (area.height - 1)};
  }
};

AxisRange rangeOf(const CurvePlot& plot, const PlotAxis& axis, bool is_x) {
  std::vector<double> values;
  for (const Curve& curve : plot.curves) {
    for (const cv::Point2d& point : curve.points) values.push_back(is_x ? point.x : point.y);
  }
  // A given end is also a value, so that the margin at the other end is correct.
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

/// Widens the range of the axis with more pixels per unit.
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

int maxTicksX(const cv::Rect& area) { return std::max(2, area.width / 55); }
int maxTicksY(const cv::Rect& area) { return std::max(2, area.height / 36); }

/// Writes a text rotated to the left, around its centre.
void writeTextUpwards(cv::Mat3b& picture, const std::string& text, cv::Point centre) {
  const cv::Size size = plotTextSize(text) + cv::Size(2, 2);
  cv::Mat3b horizontal(size, cv::Vec3b(255, 255, 255));
  writeText(horizontal, text, {0, size.height - 6});
  cv::Mat3b upright;
  cv::rotate(horizontal, upright, cv::ROTATE_90_COUNTERCLOCKWISE);
  const cv::Rect target(centre - cv::Point(upright.cols / 2, upright.rows / 2), upright.size());
  const cv::Rect visible = target & cv::Rect({}, picture.size());
  upright(visible - target.tl()).copyTo(picture(visible));
}

/// Computes the frame of a plot: the picture without its labels. The ends of the axes fit the
/// curves.
PlotFrame layOut(const CurvePlot& plot) {
  PlotFrame frame;
  frame.x = rangeOf(plot, plot.x, true);
  frame.y = rangeOf(plot, plot.y, false);
  const int line = plotTextSize("0").height;
  const auto area_with = [&](int tick_width) {
    const int left =
        2 * kPlotGap + (plot.y.label.empty() ? 0 : line + kPlotGap) + tick_width + kPlotGap;
    const int top = plot.title.empty() ? 2 * kPlotGap : line + 3 * kPlotGap;
    const int bottom = 2 * kPlotGap + line + (plot.x.label.empty() ? 0 : line + kPlotGap);
    return cv::Rect(left, top, plot.size.width - left - 3 * kPlotGap,
                    plot.size.height - top - bottom);
  };
  frame.area = area_with(0);
  if (plot.equal_units) makeUnitsEqual(frame.x, frame.y, frame.area.size());
  int tick_width = 0;
  for (const AxisTick& tick : ticksOf(frame.y, maxTicksY(frame.area))) {
    tick_width = std::max(tick_width, plotTextSize(tick.text).width);
  }
  frame.area = area_with(tick_width);
  if (plot.equal_units) makeUnitsEqual(frame.x, frame.y, frame.area.size());
  return frame;
}

/// Draws grid, axes, ticks, labels and title.
void drawAxes(cv::Mat3b& picture, const CurvePlot& plot, const PlotFrame& frame) {
  const cv::Rect& area = frame.area;
  const int bottom = area.br().y - 1;
  const int right = area.br().x - 1;
  for (const AxisTick& tick : ticksOf(frame.x, maxTicksX(area))) {
    const int x = cvRound(frame.pixelOf({tick.value, frame.y.from}).x);
    cv::line(picture, {x, area.y}, {x, bottom}, kPlotGrid);
    cv::line(picture, {x, bottom}, {x, bottom + 3}, kPlotInk);
    const cv::Size size = plotTextSize(tick.text);
    writeText(picture, tick.text, {x - size.width / 2, bottom + kPlotGap + size.height - 3});
  }
  for (const AxisTick& tick : ticksOf(frame.y, maxTicksY(area))) {
    const int y = cvRound(frame.pixelOf({frame.x.from, tick.value}).y);
    cv::line(picture, {area.x, y}, {right, y}, kPlotGrid);
    cv::line(picture, {area.x - 3, y}, {area.x, y}, kPlotInk);
    writeText(picture, tick.text, {area.x - kPlotGap - plotTextSize(tick.text).width, y + 4});
  }
  cv::rectangle(picture, area, kPlotInk);

  const int middle = area.x + area.width / 2;
  writeText(picture, plot.x.label,
            {middle - plotTextSize(plot.x.label).width / 2, picture.rows - 2 * kPlotGap + 2});
  if (!plot.y.label.empty()) {
    writeTextUpwards(picture, plot.y.label, {2 * kPlotGap, area.y + area.height / 2});
  }
  writeText(picture, plot.title,
            {std::max(kPlotGap, middle - plotTextSize(plot.title, kPlotTitleScale).width / 2),
             area.y - kPlotGap - 2},
            kPlotTitleScale);
}

/// Returns whether a pixel is not NaN and is within the range of cv::line.
bool canBeDrawn(const cv::Point2d& pixel) {
  constexpr double kMaxPixel = 1e6;
  return std::abs(pixel.x) < kMaxPixel && std::abs(pixel.y) < kMaxPixel;
}

/// Returns the uninterrupted lines of a curve, in pixels of the picture.
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

/// Counts the positions on the curves that a rectangle with a gap around it would hide. Eight
/// positions are checked between two points.
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

/// Returns the best of four corners (the upper right is tried first) and two middles of the sides.
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
