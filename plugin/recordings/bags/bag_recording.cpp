// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/bags/bag_recording.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/bags/bag_events.h"
#include "plugin/recordings/bags/bag_source.h"
#include "plugin/recordings/bags/mcap_records.h"
#include "plugin/recordings/bags/ros_messages.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kRos1Start = "#ROSBAG V";
constexpr std::string_view kDb3Start("SQLite format 3\0", 16);
constexpr std::string_view kZstdStart = "\x28\xb5\x2f\xfd";
constexpr const char* kMetadata = "metadata.yaml";

/// Returns whether a file is a bag like "recording.db3.zstd".
bool isCompressedBag(const fs::path& file) {
  const fs::path inner = file.stem().extension();
  return (inner == ".db3" || inner == ".mcap") && beginsWith(file, kZstdStart);
}

[[noreturn]] void rejectCompressed(const fs::path& file) {
  throw std::runtime_error(fmt::format(
      "{}: a compressed bag: expected an uncompressed one, by `zstd -d` (files) or `ros2 bag "
      "convert` (messages)",
      file.string()));
}

std::shared_ptr<BagSource> openBagFile(const fs::path& file) {
  if (isCompressedBag(file)) rejectCompressed(file);
  const bool ros1 = looksLikeRosbag(file);
#ifdef EFM_WITH_ROSBAG
  if (ros1) return openRos1Bag(file);
#endif
#ifdef EFM_WITH_ROS2
  if (beginsWith(file, kDb3Start)) return openDb3(file);
  if (beginsWith(file, kMcapMagic)) return openMcap(file);
#endif
  if (ros1 || looksLikeRosbag2(file)) {
    throw std::runtime_error(fmt::format("{}: this build does not read bags of ROS {} ({})",
                                         file.string(), ros1 ? 1 : 2,
                                         ros1 ? "EFM_READ_ROSBAG" : "EFM_READ_ROS2"));
  }
  if (!isFile(file)) throw std::runtime_error(file.string() + ": no such file: expected a bag");
  throw std::runtime_error(file.string() +
                           ": not a bag: expected one of ROS 1 (.bag) or ROS 2 (.db3, .mcap)");
}

/// Returns the files that metadata.yaml lists, in its folder.
std::vector<fs::path> filesOfMetadata(const fs::path& metadata) {
  std::vector<fs::path> files;
  std::string compression;
  try {
    const YAML::Node root = YAML::LoadFile(metadata.string())["rosbag2_bagfile_information"];
    if (root["compression_mode"]) compression = root["compression_mode"].as<std::string>();
    for (const YAML::Node& file : root["relative_file_paths"]) {
      // Older bags have the folder's name in front.
      files.push_back(metadata.parent_path() / fs::path(file.as<std::string>()).filename());
    }
  } catch (const YAML::Exception& error) {
    throw std::runtime_error(fmt::format("{}: {}: expected the metadata of a ROS 2 bag",
                                         metadata.string(), error.what()));
  }
  if (!compression.empty() && compression != "NONE") rejectCompressed(metadata);
  if (files.empty()) {
    throw std::runtime_error(
        fmt::format("{}: relative_file_paths is missing or empty: expected the bag's files",
                    metadata.string()));
  }
  return files;
}

/// Opens the bag in a file, or the bags in a folder in the order of its metadata.yaml.
std::vector<std::shared_ptr<BagSource>> openBagFiles(const fs::path& source) {
  std::vector<std::shared_ptr<BagSource>> bags;
  if (!isFile(source / kMetadata)) {
    bags.push_back(openBagFile(source));
    return bags;
  }
  for (const fs::path& file : filesOfMetadata(source / kMetadata)) {
    bags.push_back(openBagFile(file));
  }
  return bags;
}

/// A topic of the recording, in all bags that have it.
struct RosTopic {
  std::string name;
  RosType type = RosType::kOther;
  std::vector<BagTopicPart> parts;  // in time order
};
using RosTopics = std::vector<RosTopic>;

bool isDecimal(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

/// Compares numbers in names by their value: cam2 before cam10.
bool naturallyBefore(std::string_view a, std::string_view b) {
  while (!a.empty() && !b.empty()) {
    if (isDecimal(a[0]) && isDecimal(b[0])) {
      const auto digits = [](std::string_view& text) {
        text.remove_prefix(std::min(text.find_first_not_of('0'), text.size()));
        std::size_t count = 0;
        while (count < text.size() && isDecimal(text[count])) ++count;
        const std::string_view number = text.substr(0, count);
        text.remove_prefix(count);
        return number;
      };
      const std::string_view left = digits(a);
      const std::string_view right = digits(b);
      if (left.size() != right.size()) return left.size() < right.size();
      if (left != right) return left < right;
      continue;
    }
    if (a[0] != b[0]) return a[0] < b[0];
    a.remove_prefix(1);
    b.remove_prefix(1);
  }
  return a.size() < b.size();
}

/// Returns the topics of known types in all bags, in the natural order of their names.
RosTopics topicsOf(const std::vector<std::shared_ptr<BagSource>>& bags) {
  RosTopics topics;
  for (const auto& bag : bags) {
    for (std::size_t i = 0; i < bag->topics().size(); ++i) {
      const BagTopic& topic = bag->topics()[i];
      const RosType type = rosTypeOf(topic.type);
      if (type == RosType::kOther) continue;
      auto found = std::find_if(topics.begin(), topics.end(), [&](const RosTopic& other) {
        return other.name == topic.name && other.type == type;
      });
      if (found == topics.end()) found = topics.insert(found, {topic.name, type, {}});
      found->parts.push_back({bag, i});
    }
  }
  for (RosTopic& topic : topics) {
    std::stable_sort(topic.parts.begin(), topic.parts.end(),
                     [](const BagTopicPart& a, const BagTopicPart& b) {
                       return a.bag->firstLogNs() < b.bag->firstLogNs();
                     });
  }
  std::stable_sort(topics.begin(), topics.end(), [](const RosTopic& a, const RosTopic& b) {
    return naturallyBefore(a.name, b.name);
  });
  return topics;
}

/// Calls `take` for the messages of a topic until `take` returns false.
/// @return the error of damage that ends the messages; empty if there is no damage.
/// @throws std::runtime_error naming the message for which `take` throws.
template <typename Take>
std::string forMessages(const RosTopic& topic, const Take& take) {
  for (const BagTopicPart& part : topic.parts) {
    const auto cursor = part.bag->messages(part.topic, kMinTimeNs);
    BagMessage message;
    std::string damage;
    const auto next = [&] {
      try {
        return cursor(message);
      } catch (const std::runtime_error& error) {
        damage = error.what();
        return false;
      }
    };
    while (next()) {
      try {
        if (!take(message)) return {};
      } catch (const std::runtime_error& error) {
        throw std::runtime_error(fmt::format("{}: {}: message of {}: {}", part.bag->file().string(),
                                             topic.name, formatSeconds(message.log_ns),
                                             error.what()));
      }
    }
    if (!damage.empty()) return damage;
  }
  return {};
}

std::string namesOf(const RosTopics& topics) {
  std::string names;
  for (const RosTopic& topic : topics) names += (names.empty() ? "" : ", ") + topic.name;
  return names.empty() ? "none" : names;
}

/// Returns the topics of a kind that the options name; all of this kind if the options name none.
template <typename IsKind>
RosTopics chosen(const RosTopics& topics, const ReaderOptions& options, const IsKind& is_kind) {
  RosTopics all;
  RosTopics named;
  std::copy_if(topics.begin(), topics.end(), std::back_inserter(all),
               [&](const RosTopic& topic) { return is_kind(topic.type); });
  for (const std::string& name : options.topics) {
    std::copy_if(all.begin(), all.end(), std::back_inserter(named),
                 [&](const RosTopic& topic) { return topic.name == name; });
  }
  return named.empty() ? all : named;
}

void requireTopics(const RosTopics& topics, const ReaderOptions& options,
                   const std::filesystem::path& file) {
  for (const std::string& name : options.topics) {
    if (std::any_of(topics.begin(), topics.end(),
                    [&](const RosTopic& topic) { return topic.name == name; })) {
      continue;
    }
    throw std::runtime_error(fmt::format("{}: no topic {} with events or poses: expected {}",
                                         file.string(), name, namesOf(topics)));
  }
}

/// Returns whether the topic's messages are triggers of a camera, which have the type of events.
bool isTrigger(const RosTopic& topic) {
  bool trigger = false;
  if (topic.type != RosType::kEventPacket) return false;
  try {
    forMessages(topic, [&](const BagMessage& message) {
      trigger = decodeEventPacket(message).encoding == "trigger";
      return false;
    });
  } catch (const std::runtime_error&) {
    return false;  // the reader of events reports the damage
  }
  return trigger;
}

std::string beforeThe(const std::string& damage) { return " before the damage (" + damage + ")"; }

void addPoses(const RosTopics& all, RecordingParts& parts) {
  RosTopics topics = all;
  if (topics.size() > 1) {
    topics.erase(
        std::remove_if(topics.begin(), topics.end(),
                       [](const RosTopic& topic) { return topic.type == RosType::kOdometry; }),
        topics.end());
    if (topics.empty()) topics = all;
  }
  parts.expected_poses = "messages with poses";
  if (topics.size() > 1) {
    parts.expected_poses = fmt::format("the choice of one by --topics, of {}", namesOf(topics));
    return;
  }
  if (topics.empty()) return;
  parts.poses_damage = forMessages(topics.front(), [&](const BagMessage& message) {
    parts.poses.push_back(decodePose(message, topics.front().type));
    return true;
  });
  if (!parts.poses_damage.empty()) parts.expected_poses += beforeThe(parts.poses_damage);
}

std::string_view namespaceOf(std::string_view topic) { return topic.substr(0, topic.rfind('/')); }

/// Adds the calibration if there is only one camera.
void addCalibration(const RosTopics& topics, const RosTopics& cameras, RecordingParts& parts) {
  parts.expected_calibration = "messages sensor_msgs/CameraInfo";
  if (cameras.size() > 1) {
    parts.expected_calibration =
        "the cameras' poses on the rig, which messages of sensor_msgs/CameraInfo do not have";
  }
  if (cameras.size() != 1) return;
  for (const RosTopic& topic : topics) {
    if (topic.type != RosType::kCameraInfo ||
        namespaceOf(topic.name) != namespaceOf(cameras.front().name)) {
      continue;
    }
    const std::string damage = forMessages(topic, [&](const BagMessage& message) {
      const CameraModel model = decodeCameraInfo(message);
      if (model.fx == 0) return false;
      try {
        model.validate();
      } catch (const std::invalid_argument& error) {
        throw std::runtime_error(error.what());
      }
      Calibration calibration;
      calibration.file = topic.parts.front().bag->file();
      calibration.rig.cameras.push_back({model, {}, 0});
      parts.calibration = std::move(calibration);
      return false;
    });
    if (!damage.empty()) parts.expected_calibration += beforeThe(damage);
    return;
  }
}

}  // namespace

bool looksLikeRosbag(const fs::path& file) { return beginsWith(file, kRos1Start); }

bool looksLikeRosbag2(const fs::path& source) {
  if (isFile(source / kMetadata)) {
    std::ifstream stream(source / kMetadata);
    std::string line;
    return std::getline(stream, line) && line.rfind("rosbag2_bagfile_information", 0) == 0;
  }
  return beginsWith(source, kDb3Start) || beginsWith(source, kMcapMagic) || isCompressedBag(source);
}

RecordingParts openBags(const std::vector<std::filesystem::path>& files,
                        const ReaderOptions& options) {
  std::vector<std::shared_ptr<BagSource>> bags;
  for (const std::filesystem::path& file : files) {
    for (auto& bag : openBagFiles(file)) bags.push_back(std::move(bag));
  }
  const RosTopics topics = topicsOf(bags);
  if (!options.topics_of_other_files) requireTopics(topics, options, files.front());

  RosTopics cameras = chosen(topics, options, hasEvents);
  cameras.erase(std::remove_if(cameras.begin(), cameras.end(), isTrigger), cameras.end());
  RecordingParts parts;
  std::vector<std::vector<BagTopicPart>> camera_parts;
  for (const RosTopic& camera : cameras) camera_parts.push_back(camera.parts);
  parts.cameras = openBagEvents(camera_parts);
  addPoses(chosen(topics, options, hasPoses), parts);
  addCalibration(topics, cameras, parts);
  return parts;
}

}  // namespace efm
