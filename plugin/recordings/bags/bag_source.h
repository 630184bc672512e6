// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

using BagTopic = RecordedTopic;

/// A message as a bag stores it: in ROS 1's serialisation (little-endian, packed), or in CDR with
/// its header of 4 bytes.
struct BagMessage {
  std::int64_t log_ns = 0;  ///< Time at which it was recorded.
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;
  bool cdr = false;
};

/// Takes the next message of a topic, in the order of the recording. Its bytes stay valid until the
/// next call. Returns false at the end.
using BagCursor = std::function<bool(BagMessage& message)>;

/// A file of recorded ROS messages. Its cursors are independent and must not outlive it.
class BagSource {
 public:
  explicit BagSource(std::filesystem::path file) : file_(std::move(file)) {}
  virtual ~BagSource() = default;
  BagSource(const BagSource&) = delete;
  BagSource& operator=(const BagSource&) = delete;

  const std::filesystem::path& file() const { return file_; }
  const std::vector<BagTopic>& topics() const { return topics_; }
  /// The first and last time at which a message of any topic was recorded.
  std::int64_t firstLogNs() const { return first_log_ns_; }
  std::int64_t lastLogNs() const { return last_log_ns_; }

  /// @param topic index in `topics`.
  /// @param from_log_ns messages that were recorded earlier are left out. Cost: one search in the
  /// bag's index.
  virtual BagCursor messages(std::size_t topic, std::int64_t from_log_ns) = 0;

  /// Counts the messages of the topics, if opening the bag did not.
  virtual void countMessages() {}

 protected:
  /// @return the topic's index. Topics of the same name and type have the same index.
  std::size_t addTopic(const BagTopic& topic) {
    const auto same = [&](const BagTopic& other) {
      return other.name == topic.name && other.type == topic.type;
    };
    const auto found = std::find_if(topics_.begin(), topics_.end(), same);
    const auto index = static_cast<std::size_t>(found - topics_.begin());
    if (found == topics_.end()) topics_.push_back(topic);
    return index;
  }
  BagTopic& topic(std::size_t index) { return topics_[index]; }
  void setLogTimes(std::int64_t first_ns, std::int64_t last_ns) {
    first_log_ns_ = first_ns;
    last_log_ns_ = last_ns;
  }

 private:
  std::filesystem::path file_;
  std::vector<BagTopic> topics_;
  std::int64_t first_log_ns_ = 0;
  std::int64_t last_log_ns_ = 0;
};

/// Returns "dvs_msgs/EventArray" for "dvs_msgs/msg/EventArray".
inline std::string typeWithoutMsg(std::string type) {
  const std::size_t msg = type.find("/msg/");
  if (msg != std::string::npos) type.erase(msg, 4);
  return type;
}

/// Opens a ROS 1 bag of version 2.0 (wiki.ros.org/Bags/Format/2.0), uncompressed, bz2 or lz4.
///
/// It does not use rosbag_storage. With flipped bits, rosbag_storage reads beyond its buffers (9 of
/// 200 damaged bags crashed it) and takes unlimited memory (274 MB for a bag of 0.8 MB). It prints,
/// and its index takes some 70 bytes for each message. Here memory holds 48 bytes for each chunk.
/// @throws std::runtime_error naming the file, the byte and the expected value. If the bag has no
/// index (its recording was cut off), the error says that `rosbag reindex` repairs it.
std::unique_ptr<BagSource> openRos1Bag(const std::filesystem::path& file);

/// Opens a ROS 2 bag in SQLite: tables `topics` and `messages`, of any version of rosbag2.
std::unique_ptr<BagSource> openDb3(const std::filesystem::path& file);

/// Opens an MCAP file: chunks without compression, lz4 or zstd, or messages without chunks. The
/// channels with CDR or ROS 1 messages are topics. Checksums of chunks and of the summary are
/// verified. If a file has no summary, or its recording was cut off, it is read once from its
/// beginning to its end to find the channels and chunks.
std::unique_ptr<BagSource> openMcap(const std::filesystem::path& file);

}  // namespace efm
