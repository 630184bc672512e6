// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/bags/bag_events.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cstdlib>
#include <iterator>
#include <stdexcept>
#include <string>
#include <utility>

#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/bags/ros_messages.h"
#include "plugin/recordings/sensors/evt_decoder.h"

namespace efm {
namespace {

constexpr std::int64_t kMaxHostDelayNs = kNanosecondsPerSecond;

constexpr std::size_t kBlockEvents = 16'384;
constexpr int kClockPackets = 100;
constexpr std::int64_t kSameClockNs = 10'000'000;       // cameras that are synchronised by wire
constexpr std::int64_t kContinuedClockNs = 50'000'000;  // bags of one recording: includes drift

constexpr std::int64_t wrapNs(int bits) { return (std::int64_t{1} << bits) * 1'000; }

struct PacketEncoding {
  std::string_view name;
  std::optional<EvtEncoding> evt;  ///< EVT words; unset: `decode` takes a packet.
  std::int64_t wrap_ns = 0;
  void (*decode)(const EventPacketMessage& packet, std::vector<Event>& events) = nullptr;
  bool has_host_times = false;  ///< True: Unix times, no clock is fitted.
};

constexpr PacketEncoding kPacketEncodings[] = {
    {"evt3", EvtEncoding::kEvt3, wrapNs(24)},
    {"evt21", EvtEncoding::kEvt21, wrapNs(34)},
    {"evt2", EvtEncoding::kEvt2, wrapNs(34)},
    {"mono", std::nullopt, 0, decodeMonoEvents},
    {"libcaer", std::nullopt, 0, decodeLibcaerEvents, true},
    {"libcaer_cmp", std::nullopt, 0, decodeLibcaerCmpEvents, true},
};

/// Decodes the messages of one events topic, EventArray or EventPacket, one after the other.
class BagEventDecoder {
 public:
  /// @param topic its name and type.
  explicit BagEventDecoder(const BagTopic& topic) : type_(rosTypeOf(topic.type)) {}

  /// Fits the sensor's clock to the first 100 packets with events. Does nothing for EventArray,
  /// whose events have the host's time. Never throws at damaged data.
  void fitClock(const BagCursor& cursor) {
    if (type_ != RosType::kEventPacket) return;
    BagMessage message;
    std::vector<Event> events;
    try {
      for (int packets = 0; packets < kClockPackets && cursor(message);) {
        const EventPacketMessage packet = decodeEventPacket(message);
        events.clear();
        decodePacket(packet, events);
        if (events.empty()) continue;
        clock_.observe(packet.stamp_ns, events.front().t_ns);
        ++packets;
      }
    } catch (const std::runtime_error&) {
      // `decode` reports the damage, after the events before it.
    }
    // The time base of `mono` is the host's time or the sensor's.
    if (!evt_ && (hasHostTimes() || clock_.isHostClock())) clock_.useHostTime();
    restart(false);
    lost_packets_ = 0;
    undated_events_ = 0;
  }
  SensorClock& clock() { return clock_; }

  /// Appends the events of a message, in the order of the message.
  /// @throws std::runtime_error without the file's name; `events` has the events before the damage.
  void decode(const BagMessage& message, std::vector<Event>& events) {
    const auto take_size = [this](const CameraSize& size) {
      if (size.width > 0 && size.height > 0) size_ = size;
    };
    if (type_ == RosType::kEventArray) {
      take_size(decodeEventArray(message, events));
      return;
    }
    const EventPacketMessage packet = decodeEventPacket(message);
    take_size(packet.size);
    const std::size_t first = events.size();
    decodePacket(packet, events);
    if (events.size() == first || hasHostTimes()) return;
    const std::int64_t shift_ns = clock_.shiftFor(packet.stamp_ns, events[first].t_ns);
    for (std::size_t i = first; i < events.size(); ++i) events[i].t_ns += shift_ns;
  }
  /// Prepares for a message that does not follow the last message.
  /// @param inside true if reading starts inside the recording: events without time or row are then
  /// not counted before the first event that has both.
  void restart(bool inside) {
    count_undated_ = !inside;
    sequence_.reset();
    if (evt_) evt_->reset();
  }

  /// The number of missing packets so far, from gaps in their numbers.
  std::uint64_t lostPackets() const { return lost_packets_; }
  /// The number of events without time or row so far: see `EventStream::undatedEvents`.
  std::uint64_t undatedEvents() const { return undated_events_; }
  /// The size in the last message that has it; std::nullopt if there was none.
  std::optional<CameraSize> size() const { return size_; }

 private:
  /// Appends the events with the sensor's times.
  void decodePacket(const EventPacketMessage& packet, std::vector<Event>& events) {
    if (encoding_ == nullptr || packet.encoding != encoding_->name) chooseEncoding(packet.encoding);
    if (sequence_ && packet.sequence > *sequence_ + 1) {
      lost_packets_ += packet.sequence - *sequence_ - 1;
      if (evt_) evt_->skipGap();
    }
    sequence_ = packet.sequence;
    if (evt_) {
      const std::size_t before = events.size();
      const std::uint64_t undated_before = evt_->undatedEvents();
      evt_->decode(packet.data, packet.data_size, events);
      if (count_undated_) undated_events_ += evt_->undatedEvents() - undated_before;
      count_undated_ = count_undated_ || events.size() > before;
    } else {
      encoding_->decode(packet, events);
    }
  }
  void chooseEncoding(std::string_view name) {
    const auto* const found =
        std::find_if(std::begin(kPacketEncodings), std::end(kPacketEncodings),
                     [&](const PacketEncoding& known) { return known.name == name; });
    if (encoding_ != nullptr || found == std::end(kPacketEncodings)) {
      throw std::runtime_error(fmt::format("encoding = {}: expected {}", inQuotes(name),
                                           encoding_ == nullptr
                                               ? "evt3, evt21, evt2, mono, libcaer or libcaer_cmp"
                                               : inQuotes(encoding_->name)));
    }
    encoding_ = found;
    if (encoding_->evt) evt_.emplace(*encoding_->evt);
    clock_ = SensorClock(encoding_->wrap_ns);
  }
  bool hasHostTimes() const { return encoding_ != nullptr && encoding_->has_host_times; }

  RosType type_;
  std::optional<CameraSize> size_;
  const PacketEncoding* encoding_ = nullptr;  // for EventPacket
  std::optional<EvtDecoder> evt_;             // for the EVT encodings
  SensorClock clock_{0};
  std::optional<std::uint64_t> sequence_;  // number of the last packet
  std::uint64_t lost_packets_ = 0;
  bool count_undated_ = true;
  std::uint64_t undated_events_ = 0;
};

/// The events of one camera: a topic of one or several bags.
class BagEvents : public EventStream {
 public:
  /// @param parts parts of the same topic, in time order, at least one.
  explicit BagEvents(const std::vector<BagTopicPart>& parts) {
    assert(!parts.empty());
    for (const BagTopicPart& topic : parts) {
      Part part = {topic, BagEventDecoder(topic.bag->topics()[topic.topic])};
      part.decoder.fitClock(topic.bag->messages(topic.topic, kMinTimeNs));
      if (!size_) size_ = firstSize(part);
      // The next bag of a recording goes on with the same clock.
      if (!parts_.empty()) {
        part.decoder.clock().share(parts_.back().decoder.clock(), kContinuedClockNs);
      }
      parts_.push_back(std::move(part));
    }
    begin(0, kMinTimeNs);
  }

  /// Uses the clock of another camera if the two are synchronised: see SensorClock.
  void shareClock(BagEvents& other) {
    for (Part& part : parts_) {
      part.decoder.clock().share(other.parts_.front().decoder.clock(), kSameClockNs);
    }
  }

  bool decode(std::vector<Event>& events) override {
    events.clear();
    places_.clear();
    BagMessage message;
    while (events.size() < kBlockEvents && nextMessage(message)) {
      places_.push_back({events.size(), part_, message.log_ns});
      try {
        parts_[part_].decoder.decode(message, events);
      } catch (const std::runtime_error& error) {
        throw std::runtime_error(fmt::format("{}: {}", place(part_, message.log_ns), error.what()));
      }
    }
    return !events.empty();
  }
  /// Bisects the bag's log times by the times of events, so their relation does not matter.
  void seek(std::int64_t t_ns) override {
    constexpr std::int64_t kWarmUpNs = 20'000'000;  // until EVT words have given time and row
    const std::int64_t target_ns = t_ns - kWarmUpNs;
    std::size_t part = parts_.size();
    std::int64_t from_log_ns = kMinTimeNs;
    try {
      while (--part > 0) {
        const auto first_ns = firstTime(parts_[part], kMinTimeNs);
        if (first_ns && *first_ns <= target_ns) break;
      }
      from_log_ns = searchLog(parts_[part], target_ns);
    } catch (const std::runtime_error&) {
      part = 0;  // damaged: read in order, to deliver the events before the damage
      from_log_ns = kMinTimeNs;
    }
    begin(part, from_log_ns);
  }
  std::string positionOf(std::size_t index) const override {
    const auto after =
        std::upper_bound(places_.begin(), places_.end(), index,
                         [](std::size_t i, const MessagePlace& entry) { return i < entry.first; });
    const MessagePlace& found = *std::prev(after);
    return fmt::format("{}: event {}", place(found.part, found.log_ns), index - found.first);
  }
  std::string name() const override {
    const BagTopicPart& topic = parts_[part_].topic;
    return fmt::format("{}: {}", topic.bag->file().string(), topic.bag->topics()[topic.topic].name);
  }
  double progress() const override {
    const BagSource& bag = *parts_[part_].topic.bag;
    const double length_s = secondsBetween(bag.firstLogNs(), bag.lastLogNs());
    const double read_s = secondsBetween(bag.firstLogNs(), log_ns_);
    const double part = length_s > 0 ? std::clamp(read_s / length_s, 0.0, 1.0) : 1.0;
    return (static_cast<double>(part_) + part) / static_cast<double>(parts_.size());
  }
  std::optional<CameraSize> size() const override { return size_; }
  std::uint64_t lostPackets() const override { return sumOf(&BagEventDecoder::lostPackets); }
  std::uint64_t undatedEvents() const override { return sumOf(&BagEventDecoder::undatedEvents); }

 private:
  struct Part {
    BagTopicPart topic;
    BagEventDecoder decoder;
  };
  std::uint64_t sumOf(std::uint64_t (BagEventDecoder::*count)() const) const {
    std::uint64_t sum = 0;
    for (const Part& part : parts_) sum += (part.decoder.*count)();
    return sum;
  }
  /// Continues with the messages of a part that were recorded from a time on.
  void begin(std::size_t part, std::int64_t from_log_ns) {
    part_ = part;
    log_ns_ = std::max(from_log_ns, parts_[part].topic.bag->firstLogNs());
    cursor_ = parts_[part].topic.bag->messages(parts_[part].topic.topic, from_log_ns);
    parts_[part].decoder.restart(from_log_ns > parts_[part].topic.bag->firstLogNs());
  }
  bool nextMessage(BagMessage& message) {
    while (!cursor_(message)) {
      if (part_ + 1 == parts_.size()) return false;
      begin(part_ + 1, kMinTimeNs);
    }
    log_ns_ = message.log_ns;
    return true;
  }
  /// Returns the sensor's size in the first message.
  static std::optional<CameraSize> firstSize(const Part& part) {
    const auto cursor = part.topic.bag->messages(part.topic.topic, kMinTimeNs);
    BagEventDecoder decoder = part.decoder;
    BagMessage message;
    std::vector<Event> events;
    try {
      if (cursor(message)) decoder.decode(message, events);
    } catch (const std::runtime_error&) {
      // `read` reports the damage.
    }
    return decoder.size();
  }
  /// Returns the time of the first event recorded from a time on; std::nullopt if there is none.
  static std::optional<std::int64_t> firstTime(const Part& part, std::int64_t from_log_ns) {
    const auto cursor = part.topic.bag->messages(part.topic.topic, from_log_ns);
    BagEventDecoder decoder = part.decoder;
    decoder.restart(true);
    BagMessage message;
    std::vector<Event> events;
    while (cursor(message)) {
      decoder.decode(message, events);
      if (!events.empty()) return events.front().t_ns;
    }
    return std::nullopt;
  }
  /// Returns a log time before which no event of `t_ns` or later was recorded.
  static std::int64_t searchLog(const Part& part, std::int64_t t_ns) {
    constexpr std::int64_t kNearEnoughNs = 50'000'000;
    std::int64_t before_ns = part.topic.bag->firstLogNs();
    std::int64_t after_ns = part.topic.bag->lastLogNs();
    while (after_ns - before_ns > kNearEnoughNs) {
      const std::int64_t middle_ns = before_ns + (after_ns - before_ns) / 2;
      const auto first_ns = firstTime(part, middle_ns);
      (first_ns && *first_ns <= t_ns ? before_ns : after_ns) = middle_ns;
    }
    return before_ns;
  }
  std::string place(std::size_t part, std::int64_t log_ns) const {
    const BagTopicPart& topic = parts_[part].topic;
    return fmt::format("{}: {}: message of {}", topic.bag->file().string(),
                       topic.bag->topics()[topic.topic].name, formatSeconds(log_ns));
  }

  std::vector<Part> parts_;
  std::optional<CameraSize> size_;
  std::size_t part_ = 0;
  BagCursor cursor_;
  std::int64_t log_ns_;  // log time of the last message
  /// A message of the last block: the index of its first event, its part and its log time.
  struct MessagePlace {
    std::size_t first;
    std::size_t part;
    std::int64_t log_ns;
  };
  std::vector<MessagePlace> places_;
};

}  // namespace

/// Returns the multiple of the wrap that is nearest to a difference.
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

std::vector<std::unique_ptr<EventStream>> openBagEvents(
    const std::vector<std::vector<BagTopicPart>>& cameras) {
  std::vector<std::unique_ptr<EventStream>> streams;
  BagEvents* first = nullptr;
  for (const std::vector<BagTopicPart>& parts : cameras) {
    auto stream = std::make_unique<BagEvents>(parts);
    if (first != nullptr) stream->shareClock(*first);
    if (first == nullptr) first = stream.get();
    streams.push_back(std::move(stream));
  }
  return streams;
}

}  // namespace efm
