// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "mapping/events/background_activity_filter.h"
#include "mapping/events/event.h"
#include "mapping/events/event_buffer.h"
#include "mapping/events/hot_pixel_filter.h"

namespace efm {

/// The filters that remove noise before events get into a window.
struct EventFilterOptions {
  bool hot_pixels = true;  ///< Remove events of pixels that fire all the time.
  HotPixelOptions hot_pixel;
  /// Remove an event if none of its eight neighbour pixels fired in this time before it. Seconds, 0
  /// (off) to 10.
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

  /// @param event the next one of the camera, in time order, inside the sensor.
  bool keeps(const Event& event) {
    if (hot_pixels_ && hot_pixels_->isHot(event)) return false;
    return !background_activity_ || !background_activity_->isIsolated(event);
  }

 private:
  std::optional<HotPixelFilter> hot_pixels_;
  std::optional<BackgroundActivityFilter> background_activity_;
};

/// Holds the events of one camera until no earlier event can arrive, then filters them. So the
/// result depends neither on packets nor on the order in which late events arrive.
class FilteredEvents {
 public:
  explicit FilteredEvents(EventFilter filter) : filter_(std::move(filter)) {}

  /// @return the number of events that came after a newer one.
  std::uint64_t insert(EventSpan events) { return waiting_.insert(events); }
  /// The number of events that were not filtered yet.
  std::size_t waiting() const { return waiting_.events.size() - waiting_.begin; }
  /// Filters the events before `until_ns` and inserts those that remain into `buffer`. No event
  /// before `until_ns` may be inserted here afterwards.
  /// @return the number of events that the filter removed.
  std::uint64_t release(std::int64_t until_ns, EventBuffer& buffer);

 private:
  EventFilter filter_;
  EventBuffer waiting_;
};

}  // namespace efm
