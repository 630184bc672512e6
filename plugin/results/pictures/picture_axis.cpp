// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/pictures/picture_axis.h"

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace efm {
namespace {

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

/// Returns powers of ten times each factor inside the range.
std::vector<AxisTick> powersInside(const AxisRange& range, const std::vector<double>& factors) {
  const int first = static_cast<int>(std::floor(std::log10(range.from)));
  const int last = static_cast<int>(std::ceil(std::log10(range.to)));
  std::vector<AxisTick> ticks;
  for (int power = first; power <= last; ++power) {
    for (const double factor : factors) {
      const double value = factor * std::pow(10.0, power);
      if (value < range.from * (1 - 1e-9) || value > range.to * (1 + 1e-9)) continue;
      ticks.push_back({value, shortText(value)});
    }
  }
  return ticks;
}

/// Selects values in the order of roundness, if they have space beside the values so far.
std::vector<AxisTick> inverseTicks(const AxisRange& range, int max_ticks) {
  static const std::vector<double> kRoundness[] = {{1}, {2, 5}, {1.5, 3}, {4, 7}, {1.2, 2.5, 6, 8}};
  std::vector<AxisTick> ticks;
  for (const std::vector<double>& factors : kRoundness) {
    for (const AxisTick& tick : powersInside(range, factors)) {
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
  return (1 / value - 1 / from) / (1 / to - 1 / from);
}

std::vector<AxisTick> ticksOf(const AxisRange& range, int max_ticks) {
  if (!(range.from < range.to)) return {};
  return range.scale == AxisScale::kInverse ? inverseTicks(range, max_ticks)
                                            : linearTicks(range, max_ticks);
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

}  // namespace efm
