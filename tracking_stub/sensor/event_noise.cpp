// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/sensor/event_noise.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "mapping/base/named_choice.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

bool isRate(double hz) { return hz >= 0 && hz <= EventNoiseOptions::kMaxHz; }

}  // namespace

void EventNoiseOptions::validate() const {
  requireOption(isRate(background_hz), "background_hz", background_hz, "0 to 1e5");
  requireOption(hot_fraction >= 0 && hot_fraction <= 1, "hot_fraction", hot_fraction, "0 to 1");
  requireOption(isRate(hot_hz), "hot_hz", hot_hz, "0 to 1e5");
}

EventNoise::EventNoise(int width, int height, const EventNoiseOptions& options, const Start& start)
    : width_(static_cast<std::size_t>(width)) {
  constexpr std::uint64_t kFirstStream = 1000;
  options.validate();
  if (options.background_hz == 0 && options.hot_fraction * options.hot_hz == 0) return;
  const std::size_t count = width_ * static_cast<std::size_t>(height);
  pixels_.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    Pixel pixel = {RandomNumbers(start.seed, kFirstStream + i), 0, start.t_ns};
    const bool hot = pixel.random.uniform() < options.hot_fraction;
    pixel.rate_hz = options.background_hz + (hot ? options.hot_hz : 0);
    draw(pixel);
    pixels_.push_back(pixel);
  }
}

void EventNoise::draw(Pixel& pixel) {
  constexpr double kMaxWaitS = 1e9;  // longer than any recording; sums fit 64 bits
  const double wait_s =
      pixel.rate_hz > 0 ? -std::log(1 - pixel.random.uniform()) / pixel.rate_hz : kMaxWaitS;
  pixel.next_ns += durationFromSeconds(std::min(wait_s, kMaxWaitS));
}

void EventNoise::fireRow(int y, std::int64_t until_ns, std::vector<Event>& events) {
  if (pixels_.empty()) return;
  Pixel* row = pixels_.data() + static_cast<std::size_t>(y) * width_;
  for (std::size_t x = 0; x < width_; ++x) {
    Pixel& pixel = row[x];
    while (true) {
      // Rounded up to whole microseconds, as sensors stamp events.
      constexpr std::int64_t kTickNs = 1000;
      const std::int64_t whole = pixel.next_ns / kTickNs;
      const std::int64_t t_ns = (whole + (whole * kTickNs < pixel.next_ns ? 1 : 0)) * kTickNs;
      if (t_ns > until_ns) break;
      events.push_back({t_ns, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
                        pixel.random.below(2) == 0});
      draw(pixel);
    }
  }
}

}  // namespace efm
