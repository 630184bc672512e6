// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/bags/ros_messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

#include "mapping/base/named_choice.h"
#include "mapping/base/number_bytes.h"
#include "mapping/base/text.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/streams/time_unit.h"

namespace efm {
namespace {

constexpr NamedChoice<RosType> kRosTypes[] = {
    {RosType::kEventArray, "dvs_msgs/EventArray"},
    {RosType::kEventArray, "prophesee_event_msgs/EventArray"},
    {RosType::kEventPacket, "event_camera_msgs/EventPacket"},
    {RosType::kEventPacket, "event_array_msgs/EventArray"},
    {RosType::kPose, "geometry_msgs/PoseStamped"},
    {RosType::kPoseWithCovariance, "geometry_msgs/PoseWithCovarianceStamped"},
    {RosType::kTransform, "geometry_msgs/TransformStamped"},
    {RosType::kOdometry, "nav_msgs/Odometry"},
    {RosType::kPath, "nav_msgs/Path"},
    {RosType::kTransforms, "tf2_msgs/TFMessage"},
    {RosType::kTransforms, "tf/tfMessage"},
    {RosType::kCameraInfo, "sensor_msgs/CameraInfo"},
};

/// The fields of a message, in either serialisation.
class MessageFields {
 public:
  explicit MessageFields(const BagMessage& message)
      : bytes_(message.data, message.size), cdr_(message.cdr) {
    if (!cdr_) return;
    constexpr int kBigEndian = 0;
    constexpr int kLittleEndian = 1;
    const int zero = bytes_.number<std::uint8_t>();
    const int kind = bytes_.number<std::uint8_t>();
    if (zero != 0 || kind > kLittleEndian) {
      throw std::runtime_error(fmt::format(
          "CDR header = {} {}: expected 0 0 or 0 1, plain CDR of version 1", zero, kind));
    }
    bytes_.number<std::uint16_t>();  // options
    bytes_.setBigEndian(kind == kBigEndian);
    bytes_.alignFromHere();
  }

  ByteReader& bytes() { return bytes_; }
  template <typename T>
  T number() {
    return bytes_.number<T>();
  }
  std::int64_t time() {
    // The seconds of ROS 1 have no sign.
    const std::int64_t seconds = cdr_ ? std::int64_t{bytes_.number<std::int32_t>()}
                                      : std::int64_t{bytes_.number<std::uint32_t>()};
    const std::uint32_t nanoseconds = bytes_.number<std::uint32_t>();
    return seconds * kNanosecondsPerSecond + nanoseconds;
  }
  std::string_view text() {
    const std::uint32_t size = bytes_.number<std::uint32_t>();
    const std::string_view text = bytes_.text(size);
    return cdr_ && !text.empty() ? text.substr(0, text.size() - 1) : text;  // a zero at the end
  }
  /// Reads the header. @return its stamp.
  std::int64_t header() { return headerAndFrame().first; }
  /// Reads the header. @return its stamp and its frame.
  std::pair<std::int64_t, std::string_view> headerAndFrame() {
    if (!cdr_) bytes_.number<std::uint32_t>();  // seq
    const std::int64_t t_ns = time();
    return {t_ns, text()};
  }
  CameraSize size() {
    const auto side = [this](const char* name) {
      constexpr std::uint32_t kMaxSide = 65'535;
      const std::uint32_t value = bytes_.number<std::uint32_t>();
      if (value <= kMaxSide) return static_cast<int>(value);
      throw std::runtime_error(fmt::format("{} = {}: expected 0 to {}", name, value, kMaxSide));
    };
    const int height = side("height");
    const int width = side("width");
    return {width, height};
  }
  double finite(const char* name) {
    const double value = bytes_.number<double>();
    if (std::isfinite(value)) return value;
    throw std::runtime_error(fmt::format("{} = {}: expected a finite number", name, value));
  }

 private:
  ByteReader bytes_;
  bool cdr_;
};

/// Size of an EventArray's event: 16 bits x, 16 y, 32 seconds, 32 nanoseconds, 8 polarity.
constexpr std::size_t kRosEventBytes = 13;

/// Decodes the little-endian event at `bytes`.
Event eventAt(const std::uint8_t* bytes) {
  Event event;
  std::uint32_t seconds;
  std::uint32_t nanoseconds;
  std::memcpy(&event.x, bytes, 2);
  std::memcpy(&event.y, bytes + 2, 2);
  std::memcpy(&seconds, bytes + 4, 4);
  std::memcpy(&nanoseconds, bytes + 8, 4);
  event.t_ns = std::int64_t{seconds} * kNanosecondsPerSecond + nanoseconds;
  event.polarity = bytes[12] != 0;
  return event;
}

template <typename Time>
std::string notATime(const char* name, Time t_ns) {
  return fmt::format("{} = {}: expected a time in ns before the year 2116", name, t_ns);
}

std::int64_t timeBaseOf(const EventPacketMessage& packet) {
  if (packet.time_base < static_cast<std::uint64_t>(kEndOfTimeNs)) {
    return static_cast<std::int64_t>(packet.time_base);
  }
  throw std::runtime_error(notATime("time_base", packet.time_base));
}

/// Calls `take` for the words of a packet's events, and adds the word's number to its errors.
template <typename Word, typename Take>
void forWords(const EventPacketMessage& packet, const Take& take) {
  const std::size_t count = packet.data_size / sizeof(Word);
  for (std::size_t i = 0; i < count; ++i) {
    Word word;
    std::memcpy(&word, packet.data + i * sizeof(Word), sizeof(Word));
    try {
      take(word);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(
          fmt::format("{} events: word {}: {}", packet.encoding, i, error.what()));
    }
  }
  if (packet.data_size % sizeof(Word) == 0) return;
  throw std::runtime_error(fmt::format("{} bytes of {} events: expected a multiple of {}",
                                       packet.data_size, packet.encoding, sizeof(Word)));
}

PoseNumbers takePose(MessageFields& fields) {
  PoseNumbers numbers;
  for (double& value : numbers) value = fields.number<double>();
  return numbers;
}

std::string frameName(std::string_view frame) {
  return std::string(frame.substr(frame.substr(0, 1) == "/" ? 1 : 0));
}

}  // namespace

RosType rosTypeOf(std::string_view type) {
  for (const auto& known : kRosTypes) {
    if (known.name == type) return known.value;
  }
  return RosType::kOther;
}

bool hasEvents(RosType type) {
  return type == RosType::kEventArray || type == RosType::kEventPacket;
}

bool hasPoses(RosType type) {
  return type == RosType::kPose || type == RosType::kPoseWithCovariance ||
         type == RosType::kTransform || type == RosType::kOdometry || type == RosType::kPath;
}

CameraSize decodeEventArray(const BagMessage& message, std::vector<Event>& events) {
  MessageFields fields(message);
  fields.header();
  const CameraSize size = fields.size();
  const std::uint32_t count = fields.number<std::uint32_t>();
  ByteReader& bytes = fields.bytes();
  if (count > bytes.remaining() / kRosEventBytes) {
    throw std::runtime_error(fmt::format("{} events in {} bytes: expected at most {}", count,
                                         bytes.remaining(), bytes.remaining() / kRosEventBytes));
  }
  events.reserve(events.size() + count);
  if (!message.cdr) {
    const std::uint8_t* event = bytes.take(count * kRosEventBytes);
    for (std::uint32_t i = 0; i < count; ++i, event += kRosEventBytes) {
      events.push_back(eventAt(event));
    }
    return size;
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    Event event;
    event.x = fields.number<std::uint16_t>();
    event.y = fields.number<std::uint16_t>();
    event.t_ns = fields.time();
    event.polarity = fields.number<std::uint8_t>() != 0;
    events.push_back(event);
  }
  return size;
}

EventPacketMessage decodeEventPacket(const BagMessage& message) {
  MessageFields fields(message);
  EventPacketMessage packet;
  packet.stamp_ns = fields.header();
  packet.size = fields.size();
  packet.sequence = fields.number<std::uint64_t>();
  packet.time_base = fields.number<std::uint64_t>();
  packet.encoding = fields.text();
  if (fields.number<std::uint8_t>() != 0) {
    throw std::runtime_error("is_bigendian = 1: expected 0, events in little-endian words");
  }
  packet.data_size = fields.number<std::uint32_t>();
  packet.data = fields.bytes().take(packet.data_size);
  return packet;
}

void decodeMonoEvents(const EventPacketMessage& packet, std::vector<Event>& events) {
  const std::int64_t base_ns = timeBaseOf(packet);
  events.reserve(events.size() + packet.data_size / sizeof(std::uint64_t));
  forWords<std::uint64_t>(packet, [&](std::uint64_t word) {
    events.push_back({base_ns + static_cast<std::int64_t>(word & 0xffff'ffffU),
                      static_cast<std::uint16_t>(word >> 32),
                      static_cast<std::uint16_t>(word >> 48 & 0x7fffU), word >> 63 != 0});
  });
}

void decodeLibcaerEvents(const EventPacketMessage& packet, std::vector<Event>& events) {
  constexpr std::int64_t kRangeUs = std::int64_t{1} << 31;
  const std::int64_t base_ns = timeBaseOf(packet);
  std::int64_t wraps_us = 0;
  std::int64_t last_us = 0;
  events.reserve(events.size() + packet.data_size / sizeof(std::uint64_t));
  forWords<std::uint64_t>(packet, [&](std::uint64_t word) {
    const std::int64_t t_us = static_cast<std::int32_t>(word >> 32);
    if (t_us < 0) throw std::runtime_error(fmt::format("t = {} µs: expected 0 or more", t_us));
    if (last_us - t_us > kRangeUs / 2) wraps_us += kRangeUs;
    last_us = t_us;
    const std::int64_t t_ns = base_ns + (wraps_us + t_us) * kNanosecondsPerMicrosecond;
    if (t_ns >= kEndOfTimeNs) throw std::runtime_error(notATime("t", t_ns));
    events.push_back({t_ns, static_cast<std::uint16_t>(word >> 17 & 0x7fffU),
                      static_cast<std::uint16_t>(word >> 2 & 0x7fffU), (word >> 1 & 1U) != 0});
  });
}

void decodeLibcaerCmpEvents(const EventPacketMessage& packet, std::vector<Event>& events) {
  enum Code { kTimeHigh, kTimeLow, kColumn, kRow, kVectorRow, kVector };
  constexpr unsigned kVectorRows = 8;
  constexpr unsigned kEndRow = 0x1'0000;  // no event has this row
  const std::int64_t base_us = timeBaseOf(packet) / kNanosecondsPerMicrosecond;
  unsigned high_us = 0;
  unsigned low_us = 0;
  unsigned column = 0;
  unsigned vector_row = 0;
  bool vector_polarity = false;
  const auto add = [&](unsigned row, bool polarity) {
    events.push_back({(base_us + (high_us | low_us)) * kNanosecondsPerMicrosecond,
                      static_cast<std::uint16_t>(column), static_cast<std::uint16_t>(row),
                      polarity});
  };
  forWords<std::uint16_t>(packet, [&](std::uint16_t word) {
    const unsigned time = word & 0xfffU;
    const unsigned address = word & 0x7ffU;
    const bool polarity = (word & 0x800U) != 0;
    switch (const int code = word >> 12U; code) {
      case kTimeHigh:
        high_us = time << 12U;
        break;
      case kTimeLow:
        low_us = time;
        break;
      case kColumn:
        column = address;
        break;
      case kRow:
        add(address, polarity);
        break;
      case kVectorRow:
        vector_row = address;
        vector_polarity = polarity;
        break;
      case kVector:
        for (unsigned i = 0; i < kVectorRows; ++i) {
          if ((word >> i & 1U) != 0) add(vector_row + i, vector_polarity);
        }
        // The row stays beyond every sensor, instead of wrapping to row 0.
        vector_row = std::min(vector_row, kEndRow - 2 * kVectorRows) + kVectorRows;
        break;
      default:
        throw std::runtime_error(fmt::format("code {}: expected 0 to {}", code, int{kVector}));
    }
  });
}

MessageFrames framesOf(const BagMessage& message, RosType type) {
  MessageFields fields(message);
  MessageFrames frames;
  frames.frame = frameName(fields.headerAndFrame().second);
  if (type == RosType::kTransform || type == RosType::kOdometry) {
    frames.child = frameName(fields.text());
  }
  return frames;
}

std::vector<PathPose> decodePath(const BagMessage& message, std::int64_t& stamp_ns) {
  MessageFields fields(message);
  stamp_ns = fields.header();
  std::vector<PathPose> poses;
  for (auto count = fields.number<std::uint32_t>(); count > 0; --count) {
    const std::int64_t t_ns = fields.header();
    poses.push_back({t_ns, takePose(fields)});
  }
  return poses;
}

std::vector<StampedPose> decodePoses(const BagMessage& message, RosType type) {
  if (type == RosType::kPath) {
    std::int64_t stamp_ns;
    std::vector<StampedPose> poses;
    for (const PathPose& pose : decodePath(message, stamp_ns)) {
      poses.push_back({pose.t_ns, transformOf(pose.numbers)});
    }
    return poses;
  }
  MessageFields fields(message);
  const std::int64_t t_ns = fields.header();
  if (type == RosType::kTransform || type == RosType::kOdometry) fields.text();  // child_frame_id
  return {{t_ns, transformOf(takePose(fields))}};
}

std::vector<FrameTransform> decodeTransforms(const BagMessage& message) {
  MessageFields fields(message);
  std::vector<FrameTransform> transforms;
  for (auto count = fields.number<std::uint32_t>(); count > 0; --count) {
    const auto [t_ns, parent] = fields.headerAndFrame();
    const std::string_view child = fields.text();
    transforms.push_back({frameName(parent), frameName(child), t_ns, takePose(fields)});
  }
  return transforms;
}

CameraModel decodeCameraInfo(const BagMessage& message) {
  constexpr std::uint32_t kMaxCoefficients = 14;
  MessageFields fields(message);
  fields.header();
  const CameraSize size = fields.size();
  CameraModel model;
  model.width = size.width;
  model.height = size.height;
  const std::string name(fields.text());
  const std::uint32_t count = fields.number<std::uint32_t>();
  if (count > kMaxCoefficients) {
    throw std::runtime_error(
        fmt::format("{} distortion coefficients: expected at most {}", count, kMaxCoefficients));
  }
  for (std::uint32_t i = 0; i < count; ++i) model.coefficients.push_back(fields.finite("D"));
  std::array<double, 9> matrix;  // fx 0 cx, 0 fy cy, 0 0 1
  for (double& value : matrix) value = fields.finite("K");
  model.fx = matrix[0];
  model.cx = matrix[2];
  model.fy = matrix[4];
  model.cy = matrix[5];
  if (name == "equidistant" || name == "fisheye") {
    model.distortion = DistortionModel::kEquidistant;
  } else if (name == "plumb_bob" && count > 0) {
    model.distortion = DistortionModel::kRadtan;
  } else if (std::all_of(model.coefficients.begin(), model.coefficients.end(),
                         [](double value) { return value == 0; })) {
    model.coefficients.clear();
  } else {
    throw std::runtime_error(fmt::format(
        "distortion_model = {}: expected plumb_bob, equidistant or fisheye", inQuotes(name)));
  }
  if (model.fx == 0) return model;
  for (int k = 0; k < 9 + 12; ++k) fields.number<double>();  // R and P
  SensorArea area;
  area.binning_x = fields.number<std::uint32_t>();
  area.binning_y = fields.number<std::uint32_t>();
  area.x = fields.number<std::uint32_t>();
  area.y = fields.number<std::uint32_t>();
  area.height = fields.number<std::uint32_t>();
  area.width = fields.number<std::uint32_t>();
  return cutTo(area, std::move(model));
}

}  // namespace efm
