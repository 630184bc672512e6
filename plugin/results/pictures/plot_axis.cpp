// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/pictures/plot_axis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace efm {
namespace {

constexpr double kMargin = 0.04;

std::string shortText(double value) { return fmt::format("{:.6g}", value); }

/// The smallest of 1, 2, 5 times a power of ten that is `min_step` or more.
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
  // The sum makes 0 of -0.
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

/// Powers of ten times each factor inside the range; every `stride`-th power.
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

/// The roundest values first, where their neighbours leave them space.
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

}  // namespace efm
