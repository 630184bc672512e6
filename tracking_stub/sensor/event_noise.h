// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "mapping/events/event.h"
#include "tracking_stub/random/random_numbers.h"

namespace efm {

/// Noise events. The default is none.
struct EventNoiseOptions {
  static constexpr double kMaxHz = 1e5;

  /// Rate of every pixel, 0 to 1e5. Real sensors have 0.1 to 10, and more in the dark.
  double background_hz = 0;
  double hot_fraction = 0;  ///< Fraction of hot pixels, 0 to 1. They are random.
  double hot_hz = 1000;     ///< Additional rate of a hot pixel, 0 to 1e5.

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// The noise of an event camera's pixels: a Poisson process in each, with equal probabilities of
/// the polarities. It does not change the pixels' memory. Each pixel has its own seed: its events
/// do not depend on the times of the calls.
class EventNoise {
 public:
  struct Start {
    std::uint64_t seed = 0;
    std::int64_t t_ns = 0;  ///< The events begin here.
  };
  /// @throws std::invalid_argument where the options are not valid.
  EventNoise(int width, int height, const EventNoiseOptions& options, const Start& start);

  /// Appends the row's events from the last call to `until_ns`, inclusive, by column and then by
  /// time. Times are whole microseconds. Different threads may call it for different rows.
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
