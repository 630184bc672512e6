// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/bags/sensor_clock.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <stdexcept>

#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

constexpr std::int64_t kMaxHostDelayNs = kNanosecondsPerSecond;

}  // namespace

/// The multiple of the wrap that is nearest to a difference.
std::int64_t SensorClock::withoutWraps(std::int64_t difference_ns) const {
  if (wrap_ns_ == 0) return 0;
  const std::int64_t half_ns = difference_ns < 0 ? -wrap_ns_ / 2 : wrap_ns_ / 2;
  return (difference_ns + half_ns) / wrap_ns_ * wrap_ns_;
}

void SensorClock::observe(std::int64_t stamp_ns, std::int64_t sensor_ns) {
  const std::int64_t offset_ns = stamp_ns - sensor_ns;
  offset_ns_ = std::min(offset_ns_.value_or(offset_ns), offset_ns);
}

bool SensorClock::isHostClock() const {
  return offset_ns_ && std::abs(*offset_ns_) <= kMaxHostDelayNs;
}

bool SensorClock::share(const SensorClock& other, std::int64_t tolerance_ns) {
  if (!offset_ns_ || !other.offset_ns_ || wrap_ns_ != other.wrap_ns_) return false;
  const std::int64_t difference_ns = *offset_ns_ - *other.offset_ns_;
  const std::int64_t wraps_ns = withoutWraps(difference_ns);
  if (std::abs(difference_ns - wraps_ns) > tolerance_ns) return false;
  offset_ns_ = *other.offset_ns_ + wraps_ns;
  return true;
}

std::int64_t SensorClock::shiftFor(std::int64_t stamp_ns, std::int64_t sensor_ns) const {
  const std::int64_t offset_ns = offset_ns_.value_or(stamp_ns - sensor_ns);
  const std::int64_t difference_ns = stamp_ns - offset_ns - sensor_ns;
  const std::int64_t wraps_ns = withoutWraps(difference_ns);
  if (std::abs(difference_ns - wraps_ns) > kMaxHostDelayNs) {
    throw std::runtime_error(fmt::format(
        "header.stamp = {}, {} s from the sensor's clock: expected one clock for the whole "
        "recording, within 1 s",
        formatSeconds(stamp_ns), formatSeconds(difference_ns - wraps_ns)));
  }
  return offset_ns + wraps_ns;
}

}  // namespace efm
