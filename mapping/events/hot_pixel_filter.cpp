// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/hot_pixel_filter.h"

#include <array>
#include <limits>

#include "mapping/geometry/timestamp.h"
#include "mapping/options/option_check.h"

namespace efm {

void HotPixelOptions::validate() const {
  requireOption(ratio >= 2 && ratio <= 1000, "hot_pixel_ratio", ratio, "from 2 to 1000");
  requireOption(period_s >= 0.001 && period_s <= 100, "hot_pixel_period_s", period_s,
                "from 0.001 to 100 (seconds)");
  requireOption(min_events >= 2 && min_events <= 30'000, "hot_pixel_min_events", min_events,
                "from 2 to 30000");
}

HotPixelFilter::HotPixelFilter(int width, int height, const HotPixelOptions& options)
    : ratio_(options.ratio),
      min_events_(options.min_events),
      width_(width),
      height_(height),
      stride_(static_cast<std::size_t>(width) + 2) {
  options.validate();
  period_ns_ = durationFromSeconds(options.period_s);
  pixels_.resize(stride_ * (static_cast<std::size_t>(height) + 2));
}

void HotPixelFilter::enterPeriodOf(std::int64_t t_ns) {
  std::int64_t index = t_ns / period_ns_;
  if (index * period_ns_ > t_ns) --index;  // times may be negative
  period_ = static_cast<std::uint32_t>(index);
  period_begin_ns_ = index * period_ns_;
  period_end_ns_ = period_begin_ns_ + period_ns_;
}

int HotPixelFilter::recentEvents(const Activity& pixel) const {
  if (pixel.period == period_) return pixel.newest + pixel.before;
  return pixel.period + 1 == period_ ? pixel.newest : 0;
}

bool HotPixelFilter::isHot(const Event& event) {
  if (event.t_ns < period_begin_ns_ || event.t_ns >= period_end_ns_) enterPeriodOf(event.t_ns);
  Activity* pixel = pixels_.data() + (std::size_t{event.y} + 1) * stride_ + event.x + 1;
  if (pixel->period != period_) {
    const bool fired_before = pixel->period + 1 == period_;
    *pixel = {period_, 0, fired_before ? pixel->newest : std::uint16_t{0}};
  }
  if (pixel->newest < std::numeric_limits<std::uint16_t>::max()) ++pixel->newest;

  const int own = pixel->newest + pixel->before;
  if (own < min_events_ || width_ == 1 || height_ == 1) return false;
  const auto row = static_cast<std::ptrdiff_t>(stride_);
  const std::array<std::ptrdiff_t, 8> neighbors = {-1,      1,        -row,    row,
                                                   row - 1, -row + 1, row + 1, -row - 1};
  const bool on_border =
      event.x == 0 || event.y == 0 || event.x + 1 == width_ || event.y + 1 == height_;
  int busy_ones_left = on_border ? 1 : 2;
  for (const std::ptrdiff_t offset : neighbors) {
    if (ratio_ * recentEvents(pixel[offset]) >= own && --busy_ones_left == 0) return false;
  }
  return true;
}

}  // namespace efm
