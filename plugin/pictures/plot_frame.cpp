// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/pictures/plot_frame.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "plugin/pictures/plot_text.h"

namespace efm {
namespace {

constexpr int kGap = 6;  // pixels between things
const cv::Scalar kGrid(225, 225, 225);

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

int ticksSideways(const cv::Rect& area) { return std::max(2, area.width / 55); }
int ticksUpwards(const cv::Rect& area) { return std::max(2, area.height / 36); }

}  // namespace

PlotFrame layOut(const CurvePlot& plot) {
  PlotFrame frame;
  frame.x = rangeOf(plot, plot.x, true);
  frame.y = rangeOf(plot, plot.y, false);
  const int line = plotTextSize("0").height;
  const auto area_with = [&](int tick_width) {
    const int left = 2 * kGap + (plot.y.label.empty() ? 0 : line + kGap) + tick_width + kGap;
    const int top = plot.title.empty() ? 2 * kGap : line + 3 * kGap;
    const int bottom = 2 * kGap + line + (plot.x.label.empty() ? 0 : line + kGap);
    return cv::Rect(left, top, plot.size.width - left - 3 * kGap, plot.size.height - top - bottom);
  };
  frame.area = area_with(0);
  if (plot.equal_units) makeUnitsEqual(frame.x, frame.y, frame.area.size());
  int tick_width = 0;
  for (const AxisTick& tick : ticksOf(frame.y, ticksUpwards(frame.area))) {
    tick_width = std::max(tick_width, plotTextSize(tick.text).width);
  }
  frame.area = area_with(tick_width);
  if (plot.equal_units) makeUnitsEqual(frame.x, frame.y, frame.area.size());
  return frame;
}

void drawAxes(cv::Mat3b& picture, const CurvePlot& plot, const PlotFrame& frame) {
  const cv::Rect& area = frame.area;
  const int bottom = area.br().y - 1;
  const int right = area.br().x - 1;
  for (const AxisTick& tick : ticksOf(frame.x, ticksSideways(area))) {
    const int x = cvRound(frame.place({tick.value, frame.y.from}).x);
    cv::line(picture, {x, area.y}, {x, bottom}, kGrid);
    cv::line(picture, {x, bottom}, {x, bottom + 3}, plotInk());
    const cv::Size size = plotTextSize(tick.text);
    writeText(picture, tick.text, {x - size.width / 2, bottom + kGap + size.height - 3});
  }
  for (const AxisTick& tick : ticksOf(frame.y, ticksUpwards(area))) {
    const int y = cvRound(frame.place({frame.x.from, tick.value}).y);
    cv::line(picture, {area.x, y}, {right, y}, kGrid);
    cv::line(picture, {area.x - 3, y}, {area.x, y}, plotInk());
    writeText(picture, tick.text, {area.x - kGap - plotTextSize(tick.text).width, y + 4});
  }
  cv::rectangle(picture, area, plotInk());

  const int middle = area.x + area.width / 2;
  writeText(picture, plot.x.label,
            {middle - plotTextSize(plot.x.label).width / 2, picture.rows - 2 * kGap + 2});
  if (!plot.y.label.empty()) {
    writeTextUpwards(picture, plot.y.label, {2 * kGap, area.y + area.height / 2});
  }
  writeText(picture, plot.title,
            {std::max(kGap, middle - plotTextSize(plot.title, kPlotTitleScale).width / 2),
             area.y - kGap - 2},
            kPlotTitleScale);
}

}  // namespace efm
