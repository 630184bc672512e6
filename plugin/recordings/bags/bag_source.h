// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace efm {

struct BagTopic {
  std::string name;  ///< "/davis/left/events"
  std::string type;  ///< "dvs_msgs/EventArray", also where ROS 2 has "dvs_msgs/msg/EventArray".
};

/// A message as a bag stores it: of ROS 1 (little-endian, packed), or CDR with its header of 4
/// bytes.
struct BagMessage {
  std::int64_t log_ns = 0;  ///< When it was recorded.
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;
  bool cdr = false;
};

/// The messages of one topic.
class BagCursor {
 public:
  virtual ~BagCursor() = default;
  /// The next message in the order of the recording. Its bytes stay valid until the next call.
  /// @return false at the end.
  /// @throws std::runtime_error at damaged data, naming file, position and what was expected.
  virtual bool next(BagMessage& message) = 0;
};

/// A file of recorded ROS messages. Cursors are independent of each other and do not outlive it.
class BagSource {
 public:
  explicit BagSource(std::filesystem::path file) : file_(std::move(file)) {}
  virtual ~BagSource() = default;
  BagSource(const BagSource&) = delete;
  BagSource& operator=(const BagSource&) = delete;

  const std::filesystem::path& file() const { return file_; }
  const std::vector<BagTopic>& topics() const { return topics_; }
  /// The first and last time at which a message was recorded, of all topics.
  std::int64_t firstLogNs() const { return first_log_ns_; }
  std::int64_t lastLogNs() const { return last_log_ns_; }

  /// @param topic index in `topics`.
  /// @param from_log_ns messages that were recorded earlier are left out. Cost: one search in the
  /// bag's index.
  virtual std::unique_ptr<BagCursor> messages(std::size_t topic, std::int64_t from_log_ns) = 0;

 protected:
  /// @return its index, the same for a topic of the same name and type.
  std::size_t addTopic(const BagTopic& topic) {
    const auto same = [&](const BagTopic& other) {
      return other.name == topic.name && other.type == topic.type;
    };
    const auto found = std::find_if(topics_.begin(), topics_.end(), same);
    const auto index = static_cast<std::size_t>(found - topics_.begin());
    if (found == topics_.end()) topics_.push_back(topic);
    return index;
  }
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

/// "dvs_msgs/EventArray" for "dvs_msgs/msg/EventArray".
inline std::string typeWithoutMsg(std::string type) {
  const std::size_t msg = type.find("/msg/");
  if (msg != std::string::npos) type.erase(msg, 4);
  return type;
}

}  // namespace efm
