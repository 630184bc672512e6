// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/geometry/rigid3.h"
#include "test/plugin/recordings/sensors/evt_words.h"

namespace efm {

enum class RosBytes { kRos1, kCdr, kCdrBigEndian };

/// Writes the fields of a message one after another.
class RosMessage {
 public:
  explicit RosMessage(RosBytes kind) : kind_(kind) {
    if (kind != RosBytes::kRos1) bytes_ = {'\0', kind == RosBytes::kCdr ? '\1' : '\0', '\0', '\0'};
  }

  template <typename T>
  RosMessage& add(T value) {
    while (kind_ != RosBytes::kRos1 && (bytes_.size() - 4) % sizeof(T) != 0) bytes_ += '\0';
    std::string raw(sizeof(T), '\0');
    std::memcpy(raw.data(), &value, sizeof(T));
    if (kind_ == RosBytes::kCdrBigEndian) std::reverse(raw.begin(), raw.end());
    bytes_ += raw;
    return *this;
  }
  RosMessage& u16(unsigned value) { return add(static_cast<std::uint16_t>(value)); }
  RosMessage& u32(std::size_t value) { return add(static_cast<std::uint32_t>(value)); }
  RosMessage& u8(unsigned value) { return add(static_cast<std::uint8_t>(value)); }
  RosMessage& text(const std::string& text) {
    u32(text.size() + (kind_ == RosBytes::kRos1 ? 0 : 1));
    bytes_ += text;
    if (kind_ != RosBytes::kRos1) bytes_ += '\0';
    return *this;
  }
  RosMessage& data(const std::string& raw) {
    u32(raw.size());
    bytes_ += raw;
    return *this;
  }
  RosMessage& time(std::int64_t t_ns) {
    constexpr std::int64_t kSecond = 1'000'000'000;
    return u32(static_cast<std::size_t>(t_ns / kSecond))
        .u32(static_cast<std::size_t>(t_ns % kSecond));
  }
  RosMessage& header(std::int64_t t_ns, const std::string& frame = "cam") {
    if (kind_ == RosBytes::kRos1) u32(7);  // seq
    return time(t_ns).text(frame);
  }
  RosMessage& numbers(const std::vector<double>& values) {
    for (const double value : values) add(value);
    return *this;
  }
  RosMessage& pose(const Rigid3& T) {
    const Eigen::Vector4d q = T.rotation.coeffs();
    return numbers(
        {T.translation.x(), T.translation.y(), T.translation.z(), q[0], q[1], q[2], q[3]});
  }
  const std::string& bytes() const { return bytes_; }

 private:
  RosBytes kind_;
  std::string bytes_;
};

/// Returns a dvs_msgs/EventArray of a sensor of 346x260 pixels.
inline std::string eventArray(RosBytes kind, const std::vector<Event>& events,
                              const std::string& frame = "cam") {
  RosMessage message(kind);
  message.header(events.empty() ? 0 : events.front().t_ns, frame)
      .u32(260)
      .u32(346)
      .u32(events.size());
  for (const Event& event : events) {
    message.u16(event.x).u16(event.y).time(event.t_ns).u8(event.polarity ? 1 : 0);
  }
  return message.bytes();
}

/// Returns an event_camera_msgs/EventPacket.
inline std::string eventPacket(RosBytes kind, std::int64_t stamp_ns, std::uint64_t sequence,
                               const std::string& encoding, const std::string& data,
                               std::uint64_t time_base = 0) {
  return RosMessage(kind)
      .header(stamp_ns)
      .u32(480)
      .u32(640)
      .add(sequence)
      .add(time_base)
      .text(encoding)
      .u8(0)
      .data(data)
      .bytes();
}

inline std::string monoWords(const std::vector<Event>& events, std::int64_t base_ns) {
  std::string bytes;
  for (const Event& event : events) {
    putWord(bytes, static_cast<std::uint64_t>(event.t_ns - base_ns) | std::uint64_t{event.x} << 32 |
                       std::uint64_t{event.y} << 48 | std::uint64_t{event.polarity} << 63);
  }
  return bytes;
}

/// @param base_ns start of the times. The µs after it have 31 bits, and then start again at 0.
inline std::string libcaerWords(const std::vector<Event>& events, std::int64_t base_ns) {
  std::string bytes;
  for (const Event& event : events) {
    putWord(bytes, static_cast<std::uint32_t>(event.x << 17 | event.y << 2 |
                                              (event.polarity ? 2 : 0) | 1));  // 1: valid
    putWord(bytes, static_cast<std::uint32_t>((event.t_ns - base_ns) / 1'000 & 0x7fff'ffff));
  }
  return bytes;
}

/// Returns the words of time, column and row of each event.
inline std::string libcaerCmpWords(const std::vector<Event>& events, std::int64_t base_ns) {
  std::string bytes;
  for (const Event& event : events) {
    const auto t_us = static_cast<unsigned>((event.t_ns - base_ns) / 1'000);
    bytes += evt3Words({t_us >> 12U, 0x1000 | (t_us & 0xfffU), 0x2000U | event.x,
                        0x3000U | (event.polarity ? 0x800U : 0U) | event.y});
  }
  return bytes;
}

inline std::string poseStamped(RosBytes kind, std::int64_t t_ns, const Rigid3& T) {
  return RosMessage(kind).header(t_ns, "world").pose(T).bytes();
}

inline std::string cameraInfo(RosBytes kind, const std::string& model, const std::vector<double>& D,
                              const std::vector<std::uint32_t>& area = {0, 0, 0, 0, 0, 0}) {
  RosMessage message(kind);
  message.header(0).u32(260).u32(346).text(model).u32(D.size()).numbers(D);
  message.numbers({226.5, 0, 173, 0, 227.5, 130, 0, 0, 1}).numbers(std::vector<double>(9 + 12));
  for (const std::uint32_t value : area) message.u32(value);
  return message.u8(0).bytes();
}

}  // namespace efm
