// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/sensor/event_pixels.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "mapping/base/named_choice.h"
#include "mapping/geometry/timestamp.h"
#include "tracking_stub/random/random_numbers.h"

namespace efm {
namespace {

std::int64_t roundToMicroseconds(std::int64_t base_ns, double offset_ns) {
  // Only the part below a microsecond is a double.
  constexpr std::int64_t kNanosecondsPerMicrosecond = 1000;
  const std::int64_t whole = base_ns / kNanosecondsPerMicrosecond;
  const auto rest_ns = static_cast<double>(base_ns - whole * kNanosecondsPerMicrosecond);
  return (whole + std::llround((rest_ns + offset_ns) / kNanosecondsPerMicrosecond)) *
         kNanosecondsPerMicrosecond;
}

}  // namespace

void EventPixelOptions::validate() const {
  requireOption(threshold_on >= kMinThreshold && std::isfinite(threshold_on), "threshold_on",
                threshold_on, "0.01 or more");
  requireOption(threshold_off >= kMinThreshold && std::isfinite(threshold_off), "threshold_off",
                threshold_off, "0.01 or more");
  requireOption(mismatch >= 0 && mismatch <= 0.5, "mismatch", mismatch, "0 to 0.5");
  requireOption(refractory_ns >= 0 && refractory_ns <= kNanosecondsPerSecond, "refractory_ns",
                refractory_ns, "0 to 1e9");
}

EventPixels::EventPixels(int width, int height, const EventPixelOptions& options,
                         std::uint64_t seed)
    : on_(static_cast<float>(options.threshold_on)),
      off_(static_cast<float>(options.threshold_off)),
      refractory_ns_(options.refractory_ns),
      last_(height, width, 0.0F) {
  constexpr std::uint64_t kMismatchStream = 1;
  constexpr double kMinFactor = 0.2;
  options.validate();
  if (options.mismatch > 0) {
    factor_.create(height, width);
    RandomNumbers random(seed, kMismatchStream);
    for (float& factor : factor_) {
      factor = static_cast<float>(std::max(kMinFactor, 1 + options.mismatch * random.normal()));
    }
  }
  if (refractory_ns_ > 0) blind_until_.assign(last_.total(), -kEndOfTimeNs);
}

void EventPixels::start(const cv::Mat1f& log_intensity) { log_intensity.copyTo(last_); }

void EventPixels::start(const cv::Mat1f& log_intensity, std::uint64_t seed) {
  start(log_intensity);
  RandomNumbers random(seed);
  for (int y = 0; y < last_.rows; ++y) {
    for (int x = 0; x < last_.cols; ++x) {
      const auto offset = static_cast<float>(random.uniform(-1, 1));
      // A memory below the current intensity is within the threshold of an on event.
      last_(y, x) += thresholdAt(y, x, offset < 0) * offset;
    }
  }
}

void EventPixels::fireRow(int y, const FrameStep& step, const cv::Mat1f& before,
                          const cv::Mat1f& after, std::vector<Event>& events) {
  const float* from = before.ptr<float>(y);
  const float* to = after.ptr<float>(y);
  float* last = last_.ptr<float>(y);
  const auto duration_ns = static_cast<double>(step.t1_ns - step.t0_ns);
  std::int64_t* blind_until =
      blind_until_.empty() ? nullptr
                           : blind_until_.data() + static_cast<std::ptrdiff_t>(y) * last_.cols;
  for (int x = 0; x < last_.cols; ++x) {
    const double change = static_cast<double>(to[x]) - from[x];
    double earliest = 0;  // the pixel sees from this fraction of the step
    // Whether the pixel sees within this step. After a blind time its memory is the current
    // intensity.
    const auto sees = [&] {
      if (blind_until == nullptr || blind_until[x] <= step.t0_ns) return true;
      if (blind_until[x] >= step.t1_ns) return false;
      earliest = static_cast<double>(blind_until[x] - step.t0_ns) / duration_ns;
      last[x] = static_cast<float>(from[x] + earliest * change);
      return true;
    };
    if (!sees()) {
      last[x] = to[x];
      continue;
    }
    while (true) {
      const bool brighter = to[x] > last[x];
      const float threshold = thresholdAt(y, x, brighter);
      if (!(std::abs(to[x] - last[x]) >= threshold)) break;
      last[x] += brighter ? threshold : -threshold;
      // A pixel whose memory starts a threshold away fires at once, also without a change.
      const double fraction = change == 0 ? 0.0 : (static_cast<double>(last[x]) - from[x]) / change;
      // By rounding, such a pixel may cross the threshold slightly outside of the step.
      const double offset_ns = std::clamp(fraction, earliest, 1.0) * duration_ns;
      const std::int64_t t_ns = roundToMicroseconds(step.t0_ns, offset_ns);
      events.push_back(
          {t_ns, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), brighter});
      if (blind_until == nullptr) continue;
      blind_until[x] = t_ns + refractory_ns_;
      if (!sees()) {
        last[x] = to[x];
        break;
      }
    }
  }
}

}  // namespace efm
