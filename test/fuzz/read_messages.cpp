// SPDX-License-Identifier: BSD-3-Clause
// Reads any bytes as the messages of a bag's topic. The first byte chooses the type and the
// serialisation; then each message has its length in two bytes.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "plugin/recordings/bags/bag_events.h"
#include "plugin/recordings/bags/ros_messages.h"
#include "test/fuzz/reading.h"

namespace {

constexpr const char* kName = "any.bag";
constexpr std::int64_t kPeriodNs = 10'000'000;
constexpr const char* kTypes[] = {
    "dvs_msgs/EventArray",       "event_camera_msgs/EventPacket",
    "geometry_msgs/PoseStamped", "geometry_msgs/PoseWithCovarianceStamped",
    "nav_msgs/Odometry",         "geometry_msgs/TransformStamped",
    "sensor_msgs/CameraInfo",    "nav_msgs/Path",
    "tf2_msgs/TFMessage",
};

/// Messages in memory, recorded 10 ms apart.
class Messages : public efm::BagSource {
 public:
  Messages(const std::uint8_t* data, std::size_t size) : BagSource(kName) {
    const std::uint8_t kind = *data;
    addTopic({"/events", kTypes[(kind >> 1) % std::size(kTypes)]});
    for (std::size_t at = 1; at + 2 <= size;) {
      const std::size_t length = data[at] + data[at + 1] * std::size_t{256};
      at += 2;
      // A separate copy, so that no byte after a message can be read.
      messages_.emplace_back(data + at, data + at + std::min(length, size - at));
      at += std::min(length, size - at);
    }
    cdr_ = kind % 2 != 0;
    if (!messages_.empty()) setLogTimes(0, timeOf(messages_.size() - 1));
  }

  efm::BagCursor messages(std::size_t, std::int64_t from_log_ns) override {
    std::size_t next = 0;
    while (next < messages_.size() && timeOf(next) < from_log_ns) ++next;
    return [this, next](efm::BagMessage& message) mutable {
      if (next == messages_.size()) return false;
      const std::vector<std::uint8_t>& bytes = messages_[next];
      message = {timeOf(next++), bytes.data(), bytes.size(), cdr_};
      return true;
    };
  }

 private:
  static std::int64_t timeOf(std::size_t index) {
    return static_cast<std::int64_t>(index) * kPeriodNs;
  }

  std::vector<std::vector<std::uint8_t>> messages_;
  bool cdr_ = false;
};

void decodeAll(Messages& bag, efm::RosType type) {
  const auto cursor = bag.messages(0, 0);
  efm::BagMessage message;
  while (cursor(message)) {
    // The caller of the decoders knows the file's name.
    efm::fuzz::readOrReject("", [&] {
      if (efm::hasPoses(type)) {
        efm::decodePoses(message, type);
      } else if (type == efm::RosType::kTransforms) {
        efm::decodeTransforms(message);
      } else {
        efm::decodeCameraInfo(message);
      }
    });
  }
}

}  // namespace

// NOLINTNEXTLINE(readability-identifier-naming)
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto bag = std::make_shared<Messages>(data, size);
  const efm::RosType type = efm::rosTypeOf(bag->topics()[0].type);
  if (!efm::hasEvents(type)) {
    decodeAll(*bag, type);
    return 0;
  }
  std::int64_t middle_ns = 0;
  efm::fuzz::readOrReject(kName, [&] {
    middle_ns = efm::fuzz::readStream(*efm::openBagEvents({{{bag, 0}}}).front());
  });
  efm::fuzz::readOrReject(kName, [&] {
    const auto cameras = efm::openBagEvents({{{bag, 0}}});
    cameras.front()->seek(middle_ns);
    efm::fuzz::readStream(*cameras.front());
  });
  return 0;
}
