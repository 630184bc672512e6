// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/bags/bag_source.h"
#include "plugin/recordings/writers/recording_writer.h"

namespace efm {
namespace {

/// Appends a number as the machine has it: little-endian.
template <typename T>
void appendNumber(std::string& bytes, T value) {
  static_assert(std::is_arithmetic_v<T>);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

/// A ROS 2 message in CDR: values at multiples of their size from the end of the header of 4 bytes.
class CdrWriter {
 public:
  template <typename T>
  CdrWriter& number(T value) {
    const std::size_t over = (bytes_.size() - kHeader) % sizeof(T);
    if (over > 0) bytes_.append(sizeof(T) - over, '\0');
    appendNumber(bytes_, value);
    return *this;
  }
  /// Ends with a zero.
  CdrWriter& text(std::string_view text) {
    number(static_cast<std::uint32_t>(text.size() + 1));
    bytes_.append(text).push_back('\0');
    return *this;
  }
  /// The whole message, also to append bytes.
  std::string& bytes() { return bytes_; }

 private:
  static constexpr std::size_t kHeader = 4;
  std::string bytes_ = std::string("\0\1\0\0", kHeader);  // little-endian
};

/// The definitions of the ROS 2 messages that are written, with those of the types inside them, as
/// MCAP has them (schema encoding ros2msg).

#define EFM_RULE \
  "================================================================================\n"
#define EFM_HEADER                                                                  \
  EFM_RULE                                                                          \
  "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" EFM_RULE \
  "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"

constexpr const char* kEventPacketSchema =
    "std_msgs/Header header\nuint32 height\nuint32 width\nuint64 seq\nuint64 time_base\n"
    "string encoding\nbool is_bigendian\nuint8[] events\n" EFM_HEADER;

constexpr const char* kPoseStampedSchema =
    "std_msgs/Header header\ngeometry_msgs/Pose pose\n" EFM_HEADER EFM_RULE
    "MSG: geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion "
    "orientation\n" EFM_RULE "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n" EFM_RULE
    "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n";

constexpr const char* kCameraInfoSchema =
    "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\n"
    "float64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\n"
    "sensor_msgs/RegionOfInterest roi\n" EFM_HEADER EFM_RULE
    "MSG: sensor_msgs/RegionOfInterest\nuint32 x_offset\nuint32 y_offset\nuint32 height\n"
    "uint32 width\nbool do_rectify\n";

#undef EFM_HEADER
#undef EFM_RULE

constexpr std::size_t kMcapChunkBytes = 1 << 20;
constexpr int kZstdLevel = 1;
constexpr std::uint16_t kPoseChannel = 1;

std::uint32_t checksumOf(std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

void appendText(std::string& bytes, std::string_view text) {
  appendNumber(bytes, static_cast<std::uint32_t>(text.size()));
  bytes.append(text);
}

std::string mcapRecord(McapOp op, std::string_view content) {
  std::string record(1, static_cast<char>(op));
  appendNumber(record, static_cast<std::uint64_t>(content.size()));
  return record.append(content);
}

/// The channels of a camera come after that of the poses.
std::uint16_t eventsChannel(std::size_t camera) {
  return static_cast<std::uint16_t>(kPoseChannel + 1 + 2 * camera);
}
std::uint16_t infoChannel(std::size_t camera) {
  return static_cast<std::uint16_t>(eventsChannel(camera) + 1);
}

std::string frameOf(std::size_t camera) { return fmt::format("cam{}", camera); }

void addHeader(CdrWriter& message, std::uint32_t seconds, std::int64_t t_ns,
               std::string_view frame) {
  message.number(seconds).number(static_cast<std::uint32_t>(t_ns % kNanosecondsPerSecond));
  message.text(frame);
}

void addCamera(CdrWriter& message, const CameraModel& model) {
  message.number(static_cast<std::uint32_t>(model.height));
  message.number(static_cast<std::uint32_t>(model.width));
  message.text(model.distortion == DistortionModel::kEquidistant ? "equidistant" : "plumb_bob");
  message.number(static_cast<std::uint32_t>(model.coefficients.size()));
  for (const double value : model.coefficients) message.number(value);
  for (const double k : {model.fx, 0.0, model.cx, 0.0, model.fy, model.cy, 0.0, 0.0, 1.0}) {
    message.number(k);
  }
  for (const double r : {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}) message.number(r);
  for (const double p :
       {model.fx, 0.0, model.cx, 0.0, 0.0, model.fy, model.cy, 0.0, 0.0, 0.0, 1.0, 0.0}) {
    message.number(p);
  }
  for (int i = 0; i < 6; ++i) message.number(std::uint32_t{0});  // binning, region of interest
  message.number(std::uint8_t{0});
}

class McapWriter : public RecordingWriter {
 public:
  McapWriter(const std::filesystem::path& file, const Rig& rig)
      : file_(file), rig_(rig), next_sequence_(rig.cameras.size()) {
    stream_.open(file_.temporary(), std::ios::binary);
    if (!stream_) throw std::runtime_error(file.string() + ": cannot be made");
    addChannel("geometry_msgs/msg/PoseStamped", kPoseStampedSchema, "/pose");
    for (std::size_t camera = 0; camera < rig.cameras.size(); ++camera) {
      const std::string name = "/" + frameOf(camera);
      addChannel("event_camera_msgs/msg/EventPacket", kEventPacketSchema, name + "/events");
      addChannel("sensor_msgs/msg/CameraInfo", kCameraInfoSchema, name + "/camera_info");
    }
    std::string header;
    appendText(header, "ros2");
    appendText(header, "event-fusion-mapper");
    write(std::string(kMcapMagic) + mcapRecord(McapOp::kHeader, header) + channelRecords());
  }

  void addEvents(std::size_t camera, const std::vector<Event>& events) override {
    constexpr std::ptrdiff_t kMaxEvents = 100'000;  // 800 kB
    constexpr std::int64_t kMaxSpanNs = std::numeric_limits<std::uint32_t>::max();
    const Event* begin = events.data();
    const Event* const end = begin + events.size();
    while (begin != end) {
      const Event* const most = end - begin > kMaxEvents ? begin + kMaxEvents : end;
      const Event* const last = std::find_if(
          begin, most, [&](const Event& event) { return event.t_ns - begin->t_ns > kMaxSpanNs; });
      addPacket(camera, begin, last);
      begin = last;
    }
  }

  void addPose(const StampedPose& pose) override {
    CdrWriter message;
    addHeader(message, stampSeconds(pose.t_ns), pose.t_ns, "world");
    for (const double value : pose.T_world_rig.translation) message.number(value);
    for (const double value : pose.T_world_rig.rotation.coeffs()) message.number(value);  // x y z w
    addMessage(kPoseChannel, pose.t_ns, message.bytes());
  }

  void close() override {
    finishChunk();
    std::string end;
    appendNumber(end, std::uint32_t{0});  // no checksum of the data: the chunks have theirs
    write(mcapRecord(McapOp::kDataEnd, end));

    std::string summary = channelRecords();
    for (const std::string& index : chunk_indexes_) summary += index;
    summary += statistics();
    std::string footer(1, static_cast<char>(McapOp::kFooter));
    appendNumber(footer, static_cast<std::uint64_t>(kMcapFooterContent));
    appendNumber(footer, position_);
    appendNumber(footer, std::uint64_t{0});  // no summary offsets
    summary += footer;
    appendNumber(summary, checksumOf(summary));
    write(summary.append(kMcapMagic));
    stream_.close();
    requireWritten();
    file_.replace();
  }

 private:
  struct Channel {
    std::string schema_name;
    std::string schema;
    std::string topic;
    std::uint64_t messages = 0;
    std::string index;  // of the chunk: time and position of each message
  };
  struct Span {
    std::uint64_t first_ns = 0;
    std::uint64_t last_ns = 0;
    bool empty = true;
    void add(std::uint64_t t_ns) {
      first_ns = empty ? t_ns : std::min(first_ns, t_ns);
      last_ns = empty ? t_ns : std::max(last_ns, t_ns);
      empty = false;
    }
  };

  std::uint16_t addChannel(const char* schema_name, const char* schema, const std::string& topic) {
    channels_.push_back({schema_name, schema, topic, 0, {}});
    return static_cast<std::uint16_t>(channels_.size());
  }

  /// Each channel has a schema of its own, with the channel's id.
  std::string channelRecords() const {
    std::string records;
    std::uint16_t id = 0;
    for (const Channel& channel : channels_) {
      std::string schema;
      appendNumber(schema, ++id);
      appendText(schema, channel.schema_name);
      appendText(schema, "ros2msg");
      appendText(schema, channel.schema);
      records += mcapRecord(McapOp::kSchema, schema);
    }
    id = 0;
    for (const Channel& channel : channels_) {
      std::string content;
      appendNumber(content, ++id);
      appendNumber(content, id);
      appendText(content, channel.topic);
      appendText(content, "cdr");
      appendText(content, "");  // metadata
      records += mcapRecord(McapOp::kChannel, content);
    }
    return records;
  }

  std::uint32_t stampSeconds(std::int64_t t_ns) const {
    const std::int64_t seconds = t_ns / kNanosecondsPerSecond;
    if (t_ns >= 0 && seconds <= std::numeric_limits<std::int32_t>::max()) {
      return static_cast<std::uint32_t>(seconds);
    }
    throw std::runtime_error(
        fmt::format("{}: a time of {} s: expected 0 to 2147483647, as ROS has it",
                    file_.path().string(), formatSeconds(t_ns)));
  }

  void addPacket(std::size_t camera, const Event* begin, const Event* end) {
    const CameraModel& model = rig_.cameras.at(camera).model;
    const std::int64_t t_ns = begin->t_ns;
    const std::uint32_t seconds = stampSeconds(t_ns);
    std::uint64_t& sequence = next_sequence_[camera];
    if (sequence == 0 && model.fx > 0) {  // calibrated
      CdrWriter info;
      addHeader(info, seconds, t_ns, frameOf(camera));
      addCamera(info, model);
      addMessage(infoChannel(camera), t_ns, info.bytes());
    }
    CdrWriter packet;
    addHeader(packet, seconds, t_ns, frameOf(camera));
    packet.number(static_cast<std::uint32_t>(model.height));
    packet.number(static_cast<std::uint32_t>(model.width));
    packet.number(sequence++).number(static_cast<std::uint64_t>(t_ns)).text("mono");
    packet.number(std::uint8_t{0});
    packet.number(static_cast<std::uint32_t>((end - begin) * 8));
    for (const Event* event = begin; event != end; ++event) {
      constexpr std::uint16_t kMaxRow = 0x7fff;
      if (event->y > kMaxRow) {
        throw std::runtime_error(fmt::format("{}: y = {}: expected at most {} in encoding mono",
                                             file_.path().string(), event->y, kMaxRow));
      }
      appendNumber(packet.bytes(), static_cast<std::uint64_t>(event->t_ns - t_ns) |
                                       std::uint64_t{event->x} << 32 |
                                       std::uint64_t{event->y} << 48 |
                                       static_cast<std::uint64_t>(event->polarity) << 63);
    }
    addMessage(eventsChannel(camera), t_ns, packet.bytes());
  }

  void addMessage(std::uint16_t channel, std::int64_t t_ns, const std::string& data) {
    const auto log_ns = static_cast<std::uint64_t>(t_ns);
    Channel& entry = channels_[channel - 1U];
    appendNumber(entry.index, log_ns);
    appendNumber(entry.index, static_cast<std::uint64_t>(chunk_.size()));
    std::string head;
    appendNumber(head, channel);
    appendNumber(head, static_cast<std::uint32_t>(entry.messages++));
    appendNumber(head, log_ns);
    appendNumber(head, log_ns);  // published
    chunk_.push_back(static_cast<char>(McapOp::kMessage));
    appendNumber(chunk_, static_cast<std::uint64_t>(head.size() + data.size()));
    chunk_ += head;
    chunk_ += data;
    chunk_span_.add(log_ns);
    file_span_.add(log_ns);
    if (chunk_.size() >= kMcapChunkBytes) finishChunk();
  }

  void finishChunk() {
    if (chunk_.empty()) return;
    std::string packed(ZSTD_compressBound(chunk_.size()), '\0');
    const std::size_t size =
        ZSTD_compress(packed.data(), packed.size(), chunk_.data(), chunk_.size(), kZstdLevel);
    if (ZSTD_isError(size) != 0) {
      throw std::runtime_error(file_.path().string() + ": " + ZSTD_getErrorName(size));
    }
    packed.resize(size);

    std::string index;
    appendNumber(index, chunk_span_.first_ns);
    appendNumber(index, chunk_span_.last_ns);
    std::string content = index;
    appendNumber(content, static_cast<std::uint64_t>(chunk_.size()));
    appendNumber(content, checksumOf(chunk_));
    appendText(content, "zstd");
    appendNumber(content, static_cast<std::uint64_t>(packed.size()));
    content += packed;
    const std::uint64_t begin = position_;
    write(mcapRecord(McapOp::kChunk, content));

    const std::uint64_t end = position_;
    std::string positions;
    std::uint16_t id = 0;
    for (Channel& channel : channels_) {
      ++id;
      if (channel.index.empty()) continue;
      appendNumber(positions, id);
      appendNumber(positions, position_);
      std::string messages;
      appendNumber(messages, id);
      appendText(messages, channel.index);
      write(mcapRecord(McapOp::kMessageIndex, messages));
      channel.index.clear();
    }
    appendNumber(index, begin);
    appendNumber(index, end - begin);
    appendText(index, positions);
    appendNumber(index, position_ - end);
    appendText(index, "zstd");
    appendNumber(index, static_cast<std::uint64_t>(packed.size()));
    appendNumber(index, static_cast<std::uint64_t>(chunk_.size()));
    chunk_indexes_.push_back(mcapRecord(McapOp::kChunkIndex, index));
    chunk_.clear();
    chunk_span_ = {};
  }

  std::string statistics() const {
    std::uint64_t messages = 0;
    std::string counts;
    std::uint16_t id = 0;
    for (const Channel& channel : channels_) {
      messages += channel.messages;
      appendNumber(counts, ++id);
      appendNumber(counts, channel.messages);
    }
    std::string content;
    appendNumber(content, messages);
    appendNumber(content, static_cast<std::uint16_t>(channels_.size()));  // schemas
    appendNumber(content, static_cast<std::uint32_t>(channels_.size()));
    appendNumber(content, std::uint32_t{0});  // attachments
    appendNumber(content, std::uint32_t{0});  // metadata
    appendNumber(content, static_cast<std::uint32_t>(chunk_indexes_.size()));
    appendNumber(content, file_span_.first_ns);
    appendNumber(content, file_span_.last_ns);
    appendText(content, counts);
    return mcapRecord(McapOp::kStatistics, content);
  }

  void write(const std::string& bytes) {
    stream_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    position_ += bytes.size();
    requireWritten();
  }

  /// @throws std::runtime_error if the last bytes could not be written.
  void requireWritten() const {
    if (stream_) return;
    const std::string why = reasonNotWritten(errno);
    throw std::runtime_error(file_.path().string() + ": " +
                             (why.empty() ? "cannot be written" : why));
  }

  AtomicFile file_;
  std::ofstream stream_;
  std::uint64_t position_ = 0;
  Rig rig_;
  std::vector<Channel> channels_;             // id 1 is the first
  std::vector<std::uint64_t> next_sequence_;  // per camera
  std::string chunk_;                         // records
  Span chunk_span_;
  Span file_span_;
  std::vector<std::string> chunk_indexes_;
};

}  // namespace

std::unique_ptr<RecordingWriter> openMcapWriter(const std::filesystem::path& file, const Rig& rig) {
  return std::make_unique<McapWriter>(file, rig);
}

}  // namespace efm
