// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "mapping/base/option.h"
#include "mapping/events/event.h"

namespace efm {

/// Finds isolated events. An edge fires in neighbouring pixels within a short time, but a noise
/// event comes alone (Delbruck, "Frame-free dynamic digital vision", Proc. Intl. Symp. on
/// Secure-Life Electronics, 2008). The first event of an edge in a quiet part of the image is
/// isolated, too.
class BackgroundActivityFilter {
 public:
  /// @param support_ns an event is isolated if none of its eight neighbours fired during this time
  /// before it. Above 0. An edge crosses a pixel in about 1 / (pixels per second).
  BackgroundActivityFilter(int width, int height, std::int64_t support_ns);

  /// Returns whether the camera's next event (in time order, inside the sensor) is isolated. It
  /// supports later events even if it is isolated. Constant cost.
  bool isIsolated(const Event& event);

 private:
  std::int64_t support_ns_;
  std::size_t stride_;
  std::vector<std::int64_t> newest_ns_;  // per pixel, row-major, with a border of one silent pixel
};

struct HotPixelOptions {
  /// A pixel is hot while it fires this many times as often as the second busiest of its eight
  /// neighbours. 2 to 1000. An edge of any contrast and speed passes several pixels, so a normal
  /// pixel has neighbours that fire as often.
  double ratio = 5;
  /// Rates are counted over the last one to two periods of this length. Seconds, 0.001 to 100. Long
  /// enough that edges also pass the neighbours, and that a hot pixel fires `min_events`.
  double period_s = 0.5;
  /// A pixel with fewer events in the counted time is not judged. 2 to 30,000. It must be more than
  /// a single edge causes: an edge from black to white is some 20 contrast thresholds.
  int min_events = 50;

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("hot_pixel_ratio", self.ratio, Allowed::from(2, 1000, "from 2 to 1000"));
    visit("hot_pixel_period_s", self.period_s,
          Allowed::from(0.001, 100, "from 0.001 to 100 (seconds)"));
    visit("hot_pixel_min_events", self.min_events, Allowed::from(2, 30'000, "from 2 to 30000"));
  }
  void validate() const { requireFields(*this); }
};

/// Finds events of hot pixels, which fire all the time, independent of the scene. A hot pixel votes
/// for the same ray from every pose of the window. If such rays of two cameras meet each other or
/// an edge, they make a false point.
///
/// A pixel is compared with its neighbours, not with a fixed rate, because rates depend on the
/// sensor, the scene and the motion. It is compared with the second busiest neighbour, so that two
/// adjacent hot pixels are found, too. On the sensor's border, where edges end and neighbours are
/// missing, it is compared with the busiest neighbour. The two ends of a line that flickers in
/// place have one busy neighbour each, so they count as hot. Counts are per period of the clock, so
/// the result depends only on the events and their order.
class HotPixelFilter {
 public:
  HotPixelFilter(int width, int height, const HotPixelOptions& options);

  /// Returns whether the pixel of the camera's next event, inside the sensor, is hot. Constant
  /// cost: only a pixel with `min_events` is compared, and most pixels have fewer. On a sensor that
  /// is one pixel wide or high, pixels have too few neighbours: none is hot.
  bool isHot(const Event& event) {
    if (event.t_ns < period_begin_ns_ || event.t_ns >= period_end_ns_) enterPeriodOf(event.t_ns);
    bringUpToDate(event.y + std::size_t{1});
    std::uint32_t& counts = counts_[indexOf(event)];
    if (counts < kNewestFull) counts += kOneNewest;
    return eventsIn(counts) >= min_events_ && isBusiest(event);
  }

 private:
  // A count: events in the row's period (high half) and in the period before it (low half).
  static constexpr unsigned kHalf = 16;
  static constexpr std::uint32_t kOneNewest = 1U << kHalf;
  static constexpr std::uint32_t kNewestFull = (kOneNewest - 1) << kHalf;
  static std::uint32_t eventsIn(std::uint32_t counts) {
    return (counts >> kHalf) + counts % kOneNewest;
  }

  void enterPeriodOf(std::int64_t t_ns);
  /// Shifts a row's counts to the current period.
  void bringUpToDate(std::size_t row) {
    if (row_periods_[row] != period_) startPeriod(row);
  }
  void startPeriod(std::size_t row);
  bool isBusiest(const Event& event);
  /// Returns the index in `counts_`, which has a border of one silent pixel.
  std::size_t indexOf(const Event& event) const {
    return (std::size_t{event.y} + 1) * stride_ + event.x + 1;
  }

  double ratio_;
  std::uint32_t min_events_;
  int width_;
  int height_;
  std::int64_t period_ns_;
  std::int64_t period_begin_ns_ = 0;
  std::int64_t period_end_ns_ = 0;
  std::uint32_t period_ = 0;  // current period, modulo 2^32
  std::size_t stride_;
  std::vector<std::uint32_t> counts_;       // row-major
  std::vector<std::uint32_t> row_periods_;  // the period of a row's counts
};

/// Options of the filters that remove noise before events get into a window.
struct EventFilterOptions {
  bool hot_pixels = true;  ///< True: remove events of pixels that fire all the time.
  HotPixelOptions hot_pixel;
  /// An event is removed if none of its eight neighbour pixels fired during this time before it.
  /// Seconds, 0 (off) to 10.
  double background_activity_s = 0;

  bool any() const { return hot_pixels || background_activity_s > 0; }
  /// Returns the time before an event on whose events it depends whether the event is removed.
  std::int64_t memoryNs() const;
  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("hot_pixels", self.hot_pixels);
    visit(self.hot_pixel);
    // The resolution of times is a nanosecond.
    visit("background_activity_s", self.background_activity_s,
          Allowed::from(1e-9, 10, "0, or from 1e-9 to 10 (seconds)").orZero());
  }
  void validate() const { requireFields(*this); }
};

/// The filters of one camera, in turn: an event of a hot pixel does not support other events.
class EventFilter {
 public:
  EventFilter(int width, int height, const EventFilterOptions& options);

  /// @param event the camera's next event in time order, inside the sensor.
  bool keeps(const Event& event) {
    if (hot_pixels_ && hot_pixels_->isHot(event)) return false;
    return !background_activity_ || !background_activity_->isIsolated(event);
  }

 private:
  std::optional<HotPixelFilter> hot_pixels_;
  std::optional<BackgroundActivityFilter> background_activity_;
};

/// Holds the events of one camera until no earlier event can arrive, then filters them. So the
/// result depends neither on the packets nor on the order in which late events arrive.
class FilteredEvents {
 public:
  explicit FilteredEvents(EventFilter filter) : filter_(std::move(filter)) {}

  /// Adds events. @return the number of events that came after a newer event.
  std::uint64_t insert(EventSpan events) { return waiting_.insert(events); }
  /// Returns the number of events that are not filtered yet.
  std::size_t waiting() const { return waiting_.events.size() - waiting_.begin; }
  /// Filters the events before `until_ns` and inserts the remaining events into `buffer`. After
  /// this call, no event before `until_ns` may be inserted here.
  /// @return the number of events that the filter removed.
  std::uint64_t release(std::int64_t until_ns, EventBuffer& buffer);

 private:
  EventFilter filter_;
  EventBuffer waiting_;
};

}  // namespace efm
