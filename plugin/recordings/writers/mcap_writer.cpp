// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

#include "mapping/base/number_bytes.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/bags/mcap_records.h"
#include "plugin/recordings/writers/recording_writer.h"

namespace efm {
namespace {

/// Writes a ROS 2 message in CDR: after 4 bytes of header, values are at multiples of their size.
class CdrWriter {
 public:
  /// Adds numbers, and texts, which end with a zero.
  template <typename... Values>
  CdrWriter& add(const Values&... values) {
    (addOne(values), ...);
    return *this;
  }
  /// The whole message; bytes may be appended to it.
  std::string& bytes() { return bytes_; }

 private:
  void addOne(std::string_view text) {
    addOne(static_cast<std::uint32_t>(text.size() + 1));
    bytes_.append(text).push_back('\0');
  }
  template <typename Number, typename = std::enable_if_t<std::is_arithmetic_v<Number>>>
  void addOne(Number value) {
    const std::size_t over = (bytes_.size() - kHeader) % sizeof(Number);
    if (over > 0) bytes_.append(sizeof(Number) - over, '\0');
    appendLittleEndian(bytes_, value);
  }

  static constexpr std::size_t kHeader = 4;
  std::string bytes_ = std::string("\0\1\0\0", kHeader);  // little-endian
};

/// The definitions of the written ROS 2 messages and of the types inside them, in MCAP's form
/// (schema encoding ros2msg).

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

/// Returns a camera's channel of events; its camera info is the next one. Poses have channel 1.
std::uint16_t eventsChannel(std::size_t camera) {
  return static_cast<std::uint16_t>(kPoseChannel + 1 + 2 * camera);
}

std::string frameOf(std::size_t camera) { return fmt::format("cam{}", camera); }

void addSize(CdrWriter& message, const CameraModel& model) {
  message.add(static_cast<std::uint32_t>(model.height), static_cast<std::uint32_t>(model.width));
}

void addCamera(CdrWriter& message, const CameraModel& model) {
  addSize(message, model);
  message.add(model.distortion == DistortionModel::kEquidistant ? "equidistant" : "plumb_bob");
  message.add(static_cast<std::uint32_t>(model.coefficients.size()));
  for (const double value : model.coefficients) message.add(value);
  const double fx = model.fx, fy = model.fy, cx = model.cx, cy = model.cy;
  message.add(fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0);                 // K
  message.add(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);             // R
  message.add(fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0);  // P
  message.add(0U, 0U, 0U, 0U, 0U, 0U, std::uint8_t{0});  // binning, region of interest
}

class McapWriter : public RecordingWriter {
 public:
  McapWriter(const std::filesystem::path& file, const Rig& rig)
      : file_(file),
        output_(file_.temporary(), file_.path()),
        rig_(rig),
        next_sequence_(rig.cameras.size()) {
    channels_.push_back({"geometry_msgs/msg/PoseStamped", kPoseStampedSchema, "/pose"});
    for (std::size_t camera = 0; camera < rig.cameras.size(); ++camera) {
      const std::string name = "/" + frameOf(camera);
      channels_.push_back(
          {"event_camera_msgs/msg/EventPacket", kEventPacketSchema, name + "/events"});
      channels_.push_back({"sensor_msgs/msg/CameraInfo", kCameraInfoSchema, name + "/camera_info"});
    }
    std::string begin(kMcapMagic);
    appendMcapRecord(begin, McapHeader{"ros2", "event-fusion-mapper"});
    write(begin + channelRecords());
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
    CdrWriter message = messageAt(pose.t_ns, "world");
    for (const double value : pose.T_world_rig.translation) message.add(value);
    for (const double value : pose.T_world_rig.rotation.coeffs()) message.add(value);  // x y z w
    addMessage(kPoseChannel, pose.t_ns, message.bytes());
  }

  void close() override {
    finishChunk();
    write(McapDataEnd{});  // the data have no checksum: each chunk has one
    std::string summary = channelRecords() + chunk_indexes_ + statistics();
    McapFooter footer = {position_};
    appendMcapRecord(summary, footer);
    summary.resize(summary.size() - sizeof(footer.checksum));
    appendLittleEndian(summary, checksumOf(summary));
    write(summary.append(kMcapMagic));
    output_.close();
    file_.replace();
  }

 private:
  struct Channel {
    std::string schema_name;
    std::string schema;
    std::string topic;
    std::uint64_t messages = 0;
    std::string index = {};  // index of the chunk: time and position of each message
  };
  struct Span {
    std::uint64_t first_ns = std::numeric_limits<std::uint64_t>::max();
    std::uint64_t last_ns = 0;
    void add(std::uint64_t t_ns) {
      first_ns = std::min(first_ns, t_ns);
      last_ns = std::max(last_ns, t_ns);
    }
  };

  /// Returns schemas and channels. Each channel has its own schema, with the channel's id.
  std::string channelRecords() const {
    std::string schemas;
    std::string channels;
    std::uint16_t id = 0;
    for (const Channel& channel : channels_) {
      ++id;
      appendMcapRecord(schemas, McapSchema{id, channel.schema_name, "ros2msg", channel.schema});
      appendMcapRecord(channels, McapChannel{id, id, channel.topic, "cdr", {}});
    }
    return schemas + channels;
  }

  /// Returns a message that has only its header.
  CdrWriter messageAt(std::int64_t t_ns, std::string_view frame) const {
    const std::int64_t seconds = t_ns / kNanosecondsPerSecond;
    if (t_ns < 0 || seconds > std::numeric_limits<std::int32_t>::max()) {
      throw std::runtime_error(
          fmt::format("{}: a time of {} s: expected 0 to 2147483647, as ROS has it",
                      file_.path().string(), formatSeconds(t_ns)));
    }
    return CdrWriter().add(static_cast<std::uint32_t>(seconds),
                           static_cast<std::uint32_t>(t_ns % kNanosecondsPerSecond), frame);
  }

  void addPacket(std::size_t camera, const Event* begin, const Event* end) {
    const CameraModel& model = rig_.cameras.at(camera).model;
    const std::int64_t t_ns = begin->t_ns;
    CdrWriter packet = messageAt(t_ns, frameOf(camera));
    std::uint64_t& sequence = next_sequence_[camera];
    if (sequence == 0 && model.fx > 0) {  // calibrated
      CdrWriter info = packet;
      addCamera(info, model);
      addMessage(eventsChannel(camera) + 1, t_ns, info.bytes());
    }
    addSize(packet, model);
    packet.add(sequence++, static_cast<std::uint64_t>(t_ns), "mono", std::uint8_t{0},
               static_cast<std::uint32_t>((end - begin) * 8));
    for (const Event* event = begin; event != end; ++event) {
      constexpr std::uint16_t kMaxRow = 0x7fff;
      if (event->y > kMaxRow) {
        throw std::runtime_error(fmt::format("{}: y = {}: expected at most {} in encoding mono",
                                             file_.path().string(), event->y, kMaxRow));
      }
      appendLittleEndian(packet.bytes(), static_cast<std::uint64_t>(event->t_ns - t_ns) |
                                             std::uint64_t{event->x} << 32 |
                                             std::uint64_t{event->y} << 48 |
                                             static_cast<std::uint64_t>(event->polarity) << 63);
    }
    addMessage(eventsChannel(camera), t_ns, packet.bytes());
  }

  void addMessage(int channel, std::int64_t t_ns, const std::string& data) {
    const auto log_ns = static_cast<std::uint64_t>(t_ns);
    Channel& entry = channels_[static_cast<std::size_t>(channel - 1)];
    appendMcapFields(entry.index, log_ns, std::uint64_t{chunk_.size()});
    const auto number = static_cast<std::uint32_t>(entry.messages++);
    appendMcapRecord(
        chunk_, McapMessage{static_cast<std::uint16_t>(channel), number, log_ns, log_ns}, data);
    chunk_span_.add(log_ns);
    file_span_.add(log_ns);
    if (chunk_.size() >= kMcapChunkBytes) finishChunk();
  }

  void finishChunk() {
    if (chunk_.empty()) return;
    std::string packed(ZSTD_compressBound(chunk_.size()), '\0');
    const std::uint64_t size =
        ZSTD_compress(packed.data(), packed.size(), chunk_.data(), chunk_.size(), kZstdLevel);
    if (ZSTD_isError(size) != 0) {
      throw std::runtime_error(file_.path().string() + ": " + ZSTD_getErrorName(size));
    }
    packed.resize(size);
    const auto [first_ns, last_ns] = chunk_span_;
    const std::uint64_t begin = position_;
    write(McapChunk{first_ns, last_ns, chunk_.size(), checksumOf(chunk_), "zstd", size}, packed);

    const std::uint64_t end = position_;
    std::string positions;
    std::uint16_t id = 0;
    for (Channel& channel : channels_) {
      ++id;
      if (channel.index.empty()) continue;
      appendMcapFields(positions, id, position_);
      write(McapMessageIndex{id, channel.index});
      channel.index.clear();
    }
    appendMcapRecord(chunk_indexes_,
                     McapChunkIndex{first_ns, last_ns, begin, end - begin, positions,
                                    position_ - end, "zstd", size, chunk_.size()});
    ++chunks_;
    chunk_.clear();
    chunk_span_ = {};
  }

  std::string statistics() const {
    std::uint64_t messages = 0;
    std::string counts;
    std::uint16_t id = 0;
    for (const Channel& channel : channels_) {
      messages += channel.messages;
      appendMcapFields(counts, ++id, channel.messages);
    }
    McapStatistics statistics = {messages, id, id};
    statistics.chunks = chunks_;
    statistics.first_log_ns = messages > 0 ? file_span_.first_ns : 0;
    statistics.last_log_ns = file_span_.last_ns;
    statistics.channel_messages = counts;
    std::string record;
    appendMcapRecord(record, statistics);
    return record;
  }

  template <typename Record>
  void write(const Record& record, std::string_view data = {}) {
    std::string bytes;
    appendMcapRecord(bytes, record, data);
    write(bytes);
  }
  void write(const std::string& bytes) {
    output_.stream().write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    position_ += bytes.size();
    output_.requireWritten();
  }

  AtomicFile file_;
  OutputFile output_;
  std::uint64_t position_ = 0;
  Rig rig_;
  std::vector<Channel> channels_;             // the first has id 1
  std::vector<std::uint64_t> next_sequence_;  // per camera
  std::string chunk_;                         // records
  Span chunk_span_;
  Span file_span_;
  std::string chunk_indexes_;  // records
  std::uint32_t chunks_ = 0;
};

}  // namespace

std::unique_ptr<RecordingWriter> openMcapWriter(const std::filesystem::path& file, const Rig& rig) {
  return std::make_unique<McapWriter>(file, rig);
}

}  // namespace efm
