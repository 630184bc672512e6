// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mapping/events/event.h"

namespace efm {

struct HotPixelOptions {
  /// A pixel is hot while it fires this many times as often as the second busiest of its eight
  /// neighbours. Range: 2 to 1000. An edge passes several pixels, whatever its contrast and speed:
  /// along it, before it and after it; so a pixel of the image has neighbours like itself.
  double ratio = 5;
  /// Rates are counted over the last one to two periods of this. Seconds, 0.001 to 100. Long enough
  /// for edges to have passed the neighbours too, and for a hot pixel to have fired `min_events`.
  double period_s = 0.5;
  /// A pixel with fewer events in that time is not judged. Range: 2 to 30,000. More than a pixel
  /// fires of a single edge: from black to white is some 20 contrast thresholds.
  int min_events = 50;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// Finds events of hot pixels: such as fire all the time, whatever they see. Each votes a ray of
/// its own over and over, from every pose of the window, and where two cameras have one, or one
/// meets an edge, the rays make a point that nothing in the world corresponds to.
///
/// A pixel is compared with its neighbours, not with a rate: how often pixels fire depends on the
/// sensor, the scene and the motion. The second busiest neighbour is taken so that two hot pixels
/// side by side are found as well; the ends of a line that flickers in one place, with one busy
/// neighbour each, look the same. On the sensor's border, where edges end and neighbours are
/// missing, it is the busiest. Counts are whole numbers per period of the clock, so the result
/// depends on the events and their order alone.
class HotPixelFilter {
 public:
  /// @throws std::invalid_argument where the options are not valid.
  HotPixelFilter(int width, int height, const HotPixelOptions& options);

  /// Takes the next event of the camera; it lies inside the sensor. Constant cost: a pixel's own
  /// count, and those of its neighbours once it has fired often. Pixels of sensors that are one
  /// pixel wide or high have too few neighbours: they are never hot.
  bool isHot(const Event& event);

 private:
  /// A pixel's events in the newest period in which it fired, and in the one before that.
  struct Activity {
    std::uint32_t period = 0;
    std::uint16_t newest = 0;
    std::uint16_t before = 0;
  };

  void enterPeriodOf(std::int64_t t_ns);
  int recentEvents(const Activity& pixel) const;

  double ratio_;
  int min_events_;
  int width_;
  int height_;
  std::int64_t period_ns_;
  std::int64_t period_begin_ns_ = 0;
  std::int64_t period_end_ns_ = 0;
  std::uint32_t period_ = 0;  // of the clock, modulo 2^32
  std::size_t stride_;
  std::vector<Activity> pixels_;  // row-major, with a frame of one silent pixel
};

}  // namespace efm
