// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/event_filter.h"

#include "mapping/geometry/timestamp.h"
#include "mapping/options/option_check.h"

namespace efm {

void EventFilterOptions::validate() const {
  hot_pixel.validate();
  // Shorter than a nanosecond is no time at all.
  requireOption(
      background_activity_s == 0 || (background_activity_s >= 1e-9 && background_activity_s <= 10),
      "background_activity_s", background_activity_s, "0, or from 1e-9 to 10 (seconds)");
}

EventFilter::EventFilter(int width, int height, const EventFilterOptions& options) {
  options.validate();
  if (options.hot_pixels) hot_pixels_.emplace(width, height, options.hot_pixel);
  if (options.background_activity_s > 0) {
    background_activity_.emplace(width, height, durationFromSeconds(options.background_activity_s));
  }
}

bool EventFilter::keeps(const Event& event) {
  if (hot_pixels_ && hot_pixels_->isHot(event)) return false;
  return !background_activity_ || !background_activity_->isIsolated(event);
}

}  // namespace efm
