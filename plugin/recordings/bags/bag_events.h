// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "plugin/recordings/bags/bag_source.h"
#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// The clock of an event camera, mapped to the host's. An EventPacket has both: `header.stamp`,
/// when the host received its first bytes, and the sensor's time of its events, exact but with a
/// zero of its own, and with wraps (evt3: every 16.8 s).
///
///   t = sensor time + offset;   offset = min over the first packets of (stamp − first sensor time)
///
/// One offset serves for the whole recording, so the time line is the sensor's: no jitter of the
/// host, no steps. The minimum, because the host is late by a varying delay, never early: by 0 to
/// 4.4 ms in a recording of metavision_driver, whose first packet alone would be 4.0 ms off. What
/// remains is the least delay (some 0.1 ms) and the drift of the two clocks: events move against
/// poses that the host stamps, typically by some 10 ms an hour.
///
/// Cameras: each has its own offset. Cameras that are synchronised by wire share one clock. Their
/// offsets then differ only by the hosts' delays, so cameras whose offsets agree within 10 ms use
/// the same one (`share`). A constant rest is for time_offsets_s.
class SensorClock {
 public:
  /// @param wrap_ns the sensor's time begins again after it; 0: never.
  explicit SensorClock(std::int64_t wrap_ns) : wrap_ns_(wrap_ns) {}

  /// Takes a packet into account.
  void observe(std::int64_t stamp_ns, std::int64_t sensor_ns);
  /// The sensor's clock is the host's already: its times agree with the stamps within 1 s.
  bool isHostClock() const;
  /// Uses the offset of another clock if the two agree within `tolerance_ns`, apart from wraps.
  /// @return whether they do.
  bool share(const SensorClock& other, std::int64_t tolerance_ns);
  /// Sets the offset to 0.
  void useHostTime() { offset_ns_ = 0; }

  /// What to add to the sensor's times of a packet: the offset and whole wraps.
  /// @throws std::runtime_error where the host's time is off by more than 1 s: the sensor's clock
  /// began anew.
  std::int64_t shiftFor(std::int64_t stamp_ns, std::int64_t sensor_ns) const;

 private:
  std::int64_t withoutWraps(std::int64_t difference_ns) const;

  std::int64_t wrap_ns_;
  std::optional<std::int64_t> offset_ns_;
};

/// A topic of one bag.
struct BagTopicPart {
  std::shared_ptr<BagSource> bag;
  std::size_t topic = 0;  ///< Index in `bag->topics()`.
};

/// The events of cameras, a stream for each. A camera uses the clock of the first one where the two
/// are synchronised, see SensorClock.
/// @param cameras the parts of each camera's topic in one or several bags, in time order, at least
/// one.
std::vector<std::unique_ptr<EventStream>> openBagEvents(
    const std::vector<std::vector<BagTopicPart>>& cameras);

}  // namespace efm
