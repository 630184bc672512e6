// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "mapping/base/atomic_file.h"
#include "plugin/recordings/bags/bag_source.h"
#include "plugin/recordings/writers/recording_writer.h"

namespace efm {

/// Writes an MCAP file as rosbag2 has it (CDR messages, ros2msg schemas, zstd chunks of 1 MiB,
/// index and checksums):
///   /camN/events       event_camera_msgs/EventPacket, encoding mono: the times are exact (ns), and
///                      event_camera_py and our reader decode it
///   /camN/camera_info  sensor_msgs/CameraInfo, once, of a calibrated camera
///   /pose              geometry_msgs/PoseStamped, T_world_rig
/// The cameras' poses on the rig have no message: a rig of several cameras needs a calibration
/// file.
class McapWriter : public RecordingWriter {
 public:
  /// @param rig whose frame is that of the poses.
  McapWriter(const std::filesystem::path& file, const Rig& rig);

  /// @throws std::runtime_error also for times that a ROS message cannot hold (before 0, or from
  /// 2^31 s on), and for rows above 32767.
  void addEvents(std::size_t camera, const std::vector<Event>& events) override;
  void addPose(const StampedPose& pose) override;
  void close() override;

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
    void add(std::uint64_t t_ns);
  };

  std::uint16_t addChannel(const char* schema_name, const char* schema, const std::string& topic);
  void addPacket(std::size_t camera, const Event* begin, const Event* end);
  void addMessage(std::uint16_t channel, std::int64_t t_ns, const std::string& data);
  std::uint32_t stampSeconds(std::int64_t t_ns) const;
  std::string channelRecords() const;
  std::string statistics() const;
  void write(const std::string& bytes);
  /// @throws std::runtime_error if the last bytes could not be written.
  void requireWritten() const;
  void finishChunk();

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

}  // namespace efm
