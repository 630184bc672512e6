// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "mapping/base/number_bytes.h"
#include "plugin/recordings/bags/mcap_records.h"

namespace efm {

/// Writes a ROS 2 message in CDR: after 4 bytes of header, values are at multiples of their size.
class CdrWriter {
 public:
  /// Adds numbers, texts (which end with a zero), and lists of numbers after their length.
  template <typename... Values>
  CdrWriter& add(const Values&... values) {
    (addOne(values), ...);
    return *this;
  }
  /// The whole message; bytes may be appended to it.
  std::string& bytes() { return bytes_; }
  const std::string& bytes() const { return bytes_; }

 private:
  void addOne(std::string_view text) {
    addOne(static_cast<std::uint32_t>(text.size() + 1));
    bytes_.append(text).push_back('\0');
  }
  template <typename Number, typename = std::enable_if_t<std::is_arithmetic_v<Number>>>
  void addOne(Number value) {
    align(sizeof(Number));
    appendLittleEndian(bytes_, value);
  }
  template <typename Number>
  void addOne(const std::vector<Number>& list) {
    addOne(static_cast<std::uint32_t>(list.size()));
    if (list.empty()) return;
    align(sizeof(Number));
    bytes_.reserve(bytes_.size() + list.size() * sizeof(Number));
    for (const Number value : list) appendLittleEndian(bytes_, value);
  }
  void align(std::size_t size) {
    const std::size_t over = (bytes_.size() - kHeader) % size;
    if (over > 0) bytes_.append(size - over, '\0');
  }

  static constexpr std::size_t kHeader = 4;
  std::string bytes_ = std::string("\0\1\0\0", kHeader);  // little-endian
};

/// Definitions of ROS 2 messages and of the types inside them, in MCAP's form (schema encoding
/// ros2msg).
namespace ros_schema {

#define EFM_RULE \
  "================================================================================\n"
#define EFM_HEADER                                                                  \
  EFM_RULE                                                                          \
  "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" EFM_RULE \
  "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
#define EFM_POSE                                                                                  \
  EFM_RULE                                                                                        \
  "MSG: geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion "              \
  "orientation\n" EFM_RULE "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n" EFM_RULE \
  "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"

inline constexpr const char* kEventPacket =
    "std_msgs/Header header\nuint32 height\nuint32 width\nuint64 seq\nuint64 time_base\n"
    "string encoding\nbool is_bigendian\nuint8[] events\n" EFM_HEADER;

inline constexpr const char* kPoseStamped =
    "std_msgs/Header header\ngeometry_msgs/Pose pose\n" EFM_HEADER EFM_POSE;

inline constexpr const char* kPath =
    "std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses\n" EFM_HEADER EFM_RULE
    "MSG: geometry_msgs/PoseStamped\nstd_msgs/Header header\ngeometry_msgs/Pose pose\n" EFM_POSE;

inline constexpr const char* kCameraInfo =
    "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\n"
    "float64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\n"
    "sensor_msgs/RegionOfInterest roi\n" EFM_HEADER EFM_RULE
    "MSG: sensor_msgs/RegionOfInterest\nuint32 x_offset\nuint32 y_offset\nuint32 height\n"
    "uint32 width\nbool do_rectify\n";

inline constexpr const char* kPointCloud2 =
    "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\n"
    "bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool "
    "is_dense\n" EFM_HEADER EFM_RULE
    "MSG: sensor_msgs/PointField\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n";

inline constexpr const char* kTransforms =
    "geometry_msgs/TransformStamped[] transforms\n" EFM_RULE
    "MSG: geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\n"
    "geometry_msgs/Transform transform\n" EFM_HEADER EFM_RULE
    "MSG: geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion "
    "rotation\n" EFM_RULE "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n" EFM_RULE
    "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n";

inline constexpr const char* kString = "string data\n";

#undef EFM_POSE
#undef EFM_HEADER
#undef EFM_RULE

}  // namespace ros_schema

/// A channel of an MCAP file with messages in CDR.
struct McapTopic {
  std::string type;    ///< "geometry_msgs/msg/PoseStamped"
  std::string schema;  ///< See `ros_schema`.
  std::string topic;
};

/// Returns the CRC-32 of bytes.
std::uint32_t mcapChecksum(std::string_view bytes);

/// Puts messages into an MCAP file as rosbag2 has it: CDR messages, ros2msg schemas, zstd chunks
/// with checksums, and an index at the end. Every channel has its own schema. A chunk and its index
/// are given to `write` at once.
class McapFile {
 public:
  /// Writes bytes at the end of the file, which is this position.
  using Write = std::function<void(std::uint64_t position, const std::string& bytes)>;

  /// @param topics their channels have the numbers from 1 on.
  McapFile(std::vector<McapTopic> topics, Write write)
      : topics_(std::move(topics)), write_(std::move(write)), channels_(topics_.size()) {}

  /// Writes the begin of the file.
  void begin();
  /// Adds a message to the current chunk.
  void add(int channel, std::uint64_t log_ns, std::string_view message);
  std::size_t pendingBytes() const { return chunk_.size(); }
  /// Writes the current chunk.
  void finishChunk();
  /// Writes the rest and the index.
  void end();

  /// Goes on with a file: takes what it has before its first chunk, as `begin` wrote it.
  void takeBegin() { position_ = beginRecords().size(); }
  /// Goes on with a file: takes its next chunk, as if it had been written now.
  /// @param chunk the fields of its record; @param record_size bytes of the record in the file.
  /// @param records of the chunk, not compressed.
  /// @return the index that follows the chunk in the file.
  std::string takeChunk(const McapChunk& chunk, std::uint64_t record_size,
                        std::string_view records);
  /// Returns the number of bytes of the file so far.
  std::uint64_t position() const { return position_; }

 private:
  struct Channel {
    std::uint64_t messages = 0;
    std::string index;  // of the current chunk: time and position of each message
  };
  struct Span {
    std::uint64_t first_ns = std::numeric_limits<std::uint64_t>::max();
    std::uint64_t last_ns = 0;
  };

  std::string beginRecords() const;
  std::string channelRecords() const;
  std::string closeChunk(const McapChunk& chunk, std::uint64_t record_size);
  void note(std::uint16_t channel, std::uint64_t log_ns, std::uint64_t position);
  std::string statistics() const;

  std::vector<McapTopic> topics_;
  Write write_;
  std::uint64_t position_ = 0;
  std::vector<Channel> channels_;
  std::string chunk_;  // records
  Span chunk_span_, file_span_;
  std::string chunk_indexes_;  // records
  std::uint32_t chunks_ = 0;
};

}  // namespace efm
