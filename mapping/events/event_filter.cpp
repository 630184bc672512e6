// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/event_filter.h"

#include <algorithm>
#include <array>

#include "mapping/base/option.h"
#include "mapping/geometry/timestamp.h"

namespace efm {

BackgroundActivityFilter::BackgroundActivityFilter(int width, int height, std::int64_t support_ns)
    : support_ns_(support_ns),
      stride_(static_cast<std::size_t>(width) + 2),
      newest_ns_(stride_ * (static_cast<std::size_t>(height) + 2), kMinTimeNs) {}

bool BackgroundActivityFilter::isIsolated(const Event& event) {
  std::int64_t* pixel = newest_ns_.data() + (std::size_t{event.y} + 1) * stride_ + event.x + 1;
  *pixel = event.t_ns;
  const std::int64_t from_ns = event.t_ns - support_ns_;
  const auto row = static_cast<std::ptrdiff_t>(stride_);
  const std::array<std::ptrdiff_t, 8> neighbors = {-1,      1,        -row,    row,
                                                   row - 1, -row + 1, row + 1, -row - 1};
  return std::none_of(neighbors.begin(), neighbors.end(),
                      [&](std::ptrdiff_t offset) { return pixel[offset] >= from_ns; });
}

HotPixelFilter::HotPixelFilter(int width, int height, const HotPixelOptions& options)
    : ratio_(options.ratio),
      min_events_(static_cast<std::uint32_t>(options.min_events)),
      width_(width),
      height_(height),
      stride_(static_cast<std::size_t>(width) + 2) {
  options.validate();
  period_ns_ = durationFromSeconds(options.period_s);
  row_periods_.resize(static_cast<std::size_t>(height) + 2);
  counts_.resize(stride_ * row_periods_.size());
}

void HotPixelFilter::enterPeriodOf(std::int64_t t_ns) {
  std::int64_t index = t_ns / period_ns_;
  if (index * period_ns_ > t_ns) --index;  // times may be negative
  period_ = static_cast<std::uint32_t>(index);
  period_begin_ns_ = index * period_ns_;
  period_end_ns_ = period_begin_ns_ + period_ns_;
}

void HotPixelFilter::startPeriod(std::size_t row) {
  const bool counted_before = row_periods_[row] + 1 == period_;
  row_periods_[row] = period_;
  const auto begin = counts_.begin() + static_cast<std::ptrdiff_t>(row * stride_);
  std::transform(begin, begin + static_cast<std::ptrdiff_t>(stride_), begin,
                 [&](std::uint32_t counts) { return counted_before ? counts >> kHalf : 0; });
}

/// Returns whether a pixel with enough events fires too often compared with its neighbours.
bool HotPixelFilter::isBusiest(const Event& event) {
  if (width_ == 1 || height_ == 1) return false;
  bringUpToDate(event.y);
  bringUpToDate(event.y + std::size_t{2});
  const std::uint32_t* pixel = &counts_[indexOf(event)];
  const std::uint32_t own = eventsIn(*pixel);
  const auto row = static_cast<std::ptrdiff_t>(stride_);
  const std::array<std::ptrdiff_t, 8> neighbors = {-1,      1,        -row,    row,
                                                   row - 1, -row + 1, row + 1, -row - 1};
  const bool on_border =
      event.x == 0 || event.y == 0 || event.x + 1 == width_ || event.y + 1 == height_;
  int busy_ones_left = on_border ? 1 : 2;
  for (const std::ptrdiff_t offset : neighbors) {
    if (ratio_ * eventsIn(pixel[offset]) >= own && --busy_ones_left == 0) return false;
  }
  return true;
}

std::int64_t EventFilterOptions::memoryNs() const {
  const double counted_s = hot_pixels ? 2 * hot_pixel.period_s : 0;
  return durationFromSeconds(counted_s + background_activity_s);
}

EventFilter::EventFilter(int width, int height, const EventFilterOptions& options) {
  options.validate();
  if (options.hot_pixels) hot_pixels_.emplace(width, height, options.hot_pixel);
  if (options.background_activity_s > 0) {
    background_activity_.emplace(width, height, durationFromSeconds(options.background_activity_s));
  }
}

std::uint64_t FilteredEvents::release(std::int64_t until_ns, EventBuffer& buffer) {
  const std::size_t end = waiting_.indexOf(until_ns);
  const std::size_t released = end - waiting_.begin;
  if (released == 0) return 0;
  const auto at = [&](std::size_t i) {
    return waiting_.events.begin() + static_cast<std::ptrdiff_t>(i);
  };
  const auto last = std::remove_if(at(waiting_.begin), at(end),
                                   [&](const Event& event) { return !filter_.keeps(event); });
  const auto kept = static_cast<std::size_t>(last - at(waiting_.begin));
  if (buffer.begin == buffer.events.size() && kept > buffer.events.capacity()) {
    // After a long wait the memory is exchanged, because a copy would hold all events twice.
    EventBuffer rest;  // filled before the exchange, because memory may run out
    rest.insert({waiting_.events.data() + end, waiting_.events.data() + waiting_.events.size()});
    waiting_.cut(waiting_.begin + kept);
    buffer = std::exchange(waiting_, std::move(rest));
  } else {
    buffer.insert({&*at(waiting_.begin), &*at(waiting_.begin) + kept});
    waiting_.begin = end;
    waiting_.compact();
  }
  return released - kept;
}

}  // namespace efm
