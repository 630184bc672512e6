// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "mapping/events/background_activity_filter.h"
#include "mapping/events/event.h"
#include "mapping/events/hot_pixel_filter.h"

namespace efm {

/// Which events never reach a window because nothing in the world caused them.
struct EventFilterOptions {
  bool hot_pixels = true;  ///< Leave out events of pixels that fire all the time.
  HotPixelOptions hot_pixel;
  /// Leave out events without another in the eight pixels around them in so many seconds before.
  /// 0 (off) to 10.
  double background_activity_s = 0;

  bool any() const { return hot_pixels || background_activity_s > 0; }
  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// The filters of one camera, one after the other: an event of a hot pixel supports no other.
class EventFilter {
 public:
  /// @throws std::invalid_argument where the options are not valid.
  EventFilter(int width, int height, const EventFilterOptions& options);

  /// Takes the next event of the camera, in time order; it lies inside the sensor.
  bool keeps(const Event& event);

 private:
  std::optional<HotPixelFilter> hot_pixels_;
  std::optional<BackgroundActivityFilter> background_activity_;
};

}  // namespace efm
