// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "mapping/events/event.h"
#include "tracking_stub/random/random_numbers.h"

namespace efm {

/// Events that nothing caused. The default is none.
struct EventNoiseOptions {
  static constexpr double kMaxHz = 1e5;

  double background_hz =
      0;                 ///< Of every pixel, 0 to 1e5. Real sensors: 0.1 to 10, more in the dark.
  double hot_share = 0;  ///< Of the pixels that are hot, 0 to 1, drawn at random.
  double hot_hz = 1000;  ///< Of a hot pixel, 0 to 1e5.

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// The noise of an event camera's pixels: in each a Poisson process of its own, polarities half and
/// half. It leaves the pixels' memory alone. Seeded per pixel: what a pixel fires does not depend
/// on when it is asked.
class EventNoise {
 public:
  struct Start {
    std::uint64_t seed = 0;
    std::int64_t t_ns = 0;  ///< No event is before it.
  };
  /// @throws std::invalid_argument where the options are not valid.
  EventNoise(int width, int height, const EventNoiseOptions& options, const Start& start);

  /// Appends the row's events up to a time, inclusive, since the last call, by column and then in
  /// order of time; whole microseconds. Rows may be fired by different threads.
  void fireRow(int y, std::int64_t until_ns, std::vector<Event>& events);

 private:
  struct Pixel {
    RandomNumbers random;
    double rate_hz;
    std::int64_t next_ns;
  };
  static void draw(Pixel& pixel);

  std::size_t width_;
  std::vector<Pixel> pixels_;  // row-major; empty without noise
};

}  // namespace efm
