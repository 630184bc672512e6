// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/event_pixels.h"

#include <algorithm>
#include <cmath>

#include "mapping/option_check.h"
#include "tracking_stub/random_numbers.h"

namespace efm {
namespace {

constexpr std::int64_t kNanosecondsPerMicrosecond = 1000;

std::int64_t roundToMicroseconds(std::int64_t base_ns, double offset_ns) {
  // Only the part below a microsecond goes through a double.
  const std::int64_t whole = base_ns / kNanosecondsPerMicrosecond;
  const auto rest_ns = static_cast<double>(base_ns - whole * kNanosecondsPerMicrosecond);
  return (whole + std::llround((rest_ns + offset_ns) / kNanosecondsPerMicrosecond)) *
         kNanosecondsPerMicrosecond;
}

}  // namespace

EventPixels::EventPixels(int width, int height, double contrast_threshold)
    : threshold_(static_cast<float>(contrast_threshold)), last_(height, width, 0.0F) {
  requireOption(threshold_ > 0, "contrast_threshold", contrast_threshold, "above 0");
}

void EventPixels::start(const cv::Mat1f& log_intensity) { log_intensity.copyTo(last_); }

void EventPixels::start(const cv::Mat1f& log_intensity, std::uint64_t seed) {
  start(log_intensity);
  RandomNumbers random(seed);
  for (float& last : last_) {
    last += threshold_ * static_cast<float>(random.uniform(-1, 1));
  }
}

void EventPixels::fireRow(int y, const FrameStep& step, const cv::Mat1f& before,
                          const cv::Mat1f& after, std::vector<Event>& events) {
  const float* from = before.ptr<float>(y);
  const float* to = after.ptr<float>(y);
  float* last = last_.ptr<float>(y);
  const auto duration_ns = static_cast<double>(step.t1_ns - step.t0_ns);
  for (int x = 0; x < last_.cols; ++x) {
    while (std::abs(to[x] - last[x]) >= threshold_) {
      const bool brighter = to[x] > last[x];
      last[x] += brighter ? threshold_ : -threshold_;
      const double change = static_cast<double>(to[x]) - from[x];
      // A pixel that started just a threshold away fires at once, also where nothing changes.
      const double fraction =
          change == 0 ? 0.0 : (static_cast<double>(last[x]) - from[x]) / change;
      // A start within rounding of a threshold may lie a hair outside of the step.
      const double offset_ns = std::clamp(fraction, 0.0, 1.0) * duration_ns;
      events.push_back({roundToMicroseconds(step.t0_ns, offset_ns), static_cast<std::uint16_t>(x),
                        static_cast<std::uint16_t>(y), brighter});
    }
  }
}

}  // namespace efm
