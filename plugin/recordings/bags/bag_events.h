// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "plugin/recordings/bags/bag_source.h"
#include "plugin/recordings/bags/ros_messages.h"
#include "plugin/recordings/sensors/evt_decoder.h"
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

struct PacketEncoding;

/// Decodes the messages of one events topic, EventArray or EventPacket, one after the other.
class BagEventDecoder {
 public:
  /// @param topic its name and type.
  explicit BagEventDecoder(const BagTopic& topic);

  /// Takes the first 100 packets with events into account, for the sensor's clock. Nothing to do
  /// for EventArray: its events have the host's time. Never throws at damaged data.
  void fitClock(BagCursor& cursor);
  SensorClock& clock() { return clock_; }

  /// Appends the events of a message, in the order of the message.
  /// @throws std::runtime_error without the file's name; `events` has the events before the damage.
  void decode(const BagMessage& message, std::vector<Event>& events);
  /// The next message is not the one after the last one.
  /// @param inside the recording: until the first event whose time and row are known, events
  /// without them are not counted.
  void restart(bool inside);

  /// Gaps in the numbers of the packets so far.
  std::uint64_t lostPackets() const { return lost_packets_; }
  /// Events without a time or row so far: see `EventStream::undatedEvents`.
  std::uint64_t undatedEvents() const { return undated_events_; }
  /// Of the last message; nothing where the message does not say it.
  std::optional<CameraSize> size() const { return size_; }

 private:
  void decodePacket(const EventPacketMessage& packet, std::vector<Event>& events);
  void chooseEncoding(std::string_view name);
  bool hasHostTimes() const;

  RosType type_;
  std::optional<CameraSize> size_;
  const PacketEncoding* encoding_ = nullptr;  // of EventPacket
  std::optional<EvtDecoder> evt_;             // of the EVT encodings
  SensorClock clock_{0};
  std::optional<std::uint64_t> sequence_;  // of the last packet
  std::uint64_t lost_packets_ = 0;
  bool count_undated_ = true;
  std::uint64_t undated_events_ = 0;
};

/// The events of one camera: a topic of one or several bags.
class BagEvents : public EventStream {
 public:
  /// @param parts of the same topic, in time order, at least one.
  explicit BagEvents(const std::vector<BagTopicPart>& parts);

  /// Uses the clock of another camera where the two are synchronised, see SensorClock.
  void shareClock(BagEvents& other);

  bool read(std::vector<Event>& events) override;
  /// Bisects the bag's times by the times of events, so that it does not matter how the two relate.
  void seek(std::int64_t t_ns) override;
  std::string positionOf(std::size_t index) const override;
  std::string name() const override;
  double progress() const override;
  std::optional<CameraSize> size() const override { return size_; }
  std::uint64_t lostPackets() const override;
  std::uint64_t undatedEvents() const override;

 private:
  struct Part {
    BagTopicPart topic;
    BagEventDecoder decoder;
  };
  void begin(std::size_t part, std::int64_t from_log_ns);
  bool nextMessage(BagMessage& message);
  static std::optional<CameraSize> firstSize(const Part& part);
  static std::optional<std::int64_t> firstTime(const Part& part, std::int64_t from_log_ns);
  static std::int64_t searchLog(const Part& part, std::int64_t t_ns);
  std::string place(std::size_t part, std::int64_t log_ns) const;

  std::vector<Part> parts_;
  std::optional<CameraSize> size_;
  std::size_t part_ = 0;
  std::unique_ptr<BagCursor> cursor_;
  std::int64_t log_ns_;  // of the last message
  /// The messages of the last block: the index of its first event, the part and the log time.
  struct MessagePlace {
    std::size_t first;
    std::size_t part;
    std::int64_t log_ns;
  };
  std::vector<MessagePlace> places_;
};

}  // namespace efm
