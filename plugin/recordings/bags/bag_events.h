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

/// Maps the clock of an event camera to the host's clock. An EventPacket has times of both:
/// `header.stamp`, when the host received its first bytes, and the sensor's times of its events.
/// The sensor's times are exact, but have their own zero and wrap (evt3: every 16.8 s).
///
///   t = sensor time + offset;   offset = min over the first packets of (stamp − first sensor time)
///
/// The whole recording has one offset, so its time line is the sensor's: without the host's jitter
/// and without steps. The offset is the minimum, because the host is late by a varying delay and
/// never early: by 0 to 4.4 ms in a recording of metavision_driver, whose first packet alone would
/// be wrong by 4.0 ms. Two errors remain: the smallest delay (some 0.1 ms) and the drift of the two
/// clocks, which moves events against poses of the host's clock, typically by 10 ms an hour.
///
/// Each camera has its own offset. Cameras that are synchronised by wire share one clock. Their
/// offsets then differ only by the hosts' delays, so cameras whose offsets agree within 10 ms use
/// the same offset (`share`). A constant difference that remains is set by time_offsets_s.
class SensorClock {
 public:
  /// @param wrap_ns time after which the sensor's time begins again at 0; 0: never.
  explicit SensorClock(std::int64_t wrap_ns) : wrap_ns_(wrap_ns) {}

  /// Takes a packet into account.
  void observe(std::int64_t stamp_ns, std::int64_t sensor_ns);
  /// Returns whether the sensor's clock is the host's: times and stamps agree within 1 s.
  bool isHostClock() const;
  /// Uses the offset of another clock if the two agree within `tolerance_ns`, apart from wraps.
  /// @return whether the clocks agree.
  bool share(const SensorClock& other, std::int64_t tolerance_ns);
  /// Sets the offset to 0.
  void useHostTime() { offset_ns_ = 0; }

  /// Returns the time to add to the sensor's times of a packet: the offset and whole wraps.
  /// @throws std::runtime_error if the host's time differs by more than 1 s: after a clock reset of
  /// the sensor.
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

/// Opens the events of cameras, a stream for each. A camera uses the clock of the first camera if
/// the two are synchronised: see SensorClock.
/// @param cameras the parts of each camera's topic in one or several bags, in time order, at least
/// one part per camera.
std::vector<std::unique_ptr<EventStream>> openBagEvents(
    const std::vector<std::vector<BagTopicPart>>& cameras);

}  // namespace efm
