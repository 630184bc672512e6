// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/bags/bag_recording.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/bags/bag_events.h"
#include "plugin/recordings/bags/bag_source.h"
#include "plugin/recordings/bags/frame_tree.h"
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
  std::string type_name;
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

/// Returns the topics in all bags, in the natural order of their names.
RosTopics topicsOf(const std::vector<std::shared_ptr<BagSource>>& bags) {
  RosTopics topics;
  for (const auto& bag : bags) {
    for (std::size_t i = 0; i < bag->topics().size(); ++i) {
      const BagTopic& topic = bag->topics()[i];
      const RosType type = rosTypeOf(topic.type);
      auto found = std::find_if(topics.begin(), topics.end(), [&](const RosTopic& other) {
        return other.name == topic.name && other.type_name == topic.type;
      });
      if (found == topics.end()) found = topics.insert(found, {topic.name, topic.type, type, {}});
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

/// Returns the messages of a topic in all bags.
RecordedTopic recorded(const RosTopic& topic) {
  RecordedTopic all = {topic.name, topic.type_name};
  for (const BagTopicPart& part : topic.parts) {
    const RecordedTopic& in_bag = part.bag->topics()[part.topic];
    all.add(in_bag.messages, in_bag.from_ns, in_bag.until_ns);
  }
  return all;
}

/// Returns the topic in the value of an option: "/tf" in "/tf:world->body".
std::string topicIn(const std::string& option) { return option.substr(0, option.find(':')); }

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
  const RosTopics known = chosen(topics, {}, [](RosType type) { return type != RosType::kOther; });
  for (const std::string& name : options.topics) {
    if (std::any_of(known.begin(), known.end(), [&](const RosTopic& topic) {
          return topic.name == (topic.type == RosType::kTransforms ? topicIn(name) : name);
        })) {
      continue;
    }
    throw std::runtime_error(fmt::format("{}: no topic {} with events or poses: expected {}",
                                         file.string(), name, namesOf(known)));
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

/// Returns the frame of a topic's first message; empty if it has none.
std::string frameOf(const RosTopic& topic) {
  std::string frame;
  try {
    forMessages(topic, [&](const BagMessage& message) {
      frame = framesOf(message, topic.type).frame;
      return false;
    });
  } catch (const std::runtime_error&) {
    return {};  // the reader of the messages reports the damage
  }
  return frame;
}

/// Returns the tree of frames. It is read at the first call: most bags do not need it.
using Frames = std::function<const FrameTree&()>;

/// Returns the transforms of topics, which must outlive the tree.
FrameTree treeOf(const RosTopics& topics) {
  return FrameTree([&topics](const FrameTree::Take& take) {
    std::string damage;
    for (const RosTopic& topic : topics) {
      if (topic.type != RosType::kTransforms) continue;
      const bool latched = topic.name.find("tf_static") != std::string::npos;
      const std::string ended = forMessages(topic, [&](const BagMessage& message) {
        for (const FrameTransform& transform : decodeTransforms(message)) take(transform, latched);
        return true;
      });
      if (damage.empty()) damage = ended;
    }
    return damage;
  });
}

/// Says why the poses of a path are no trajectory; std::nullopt if they may be one. A planner's
/// poses have the time of their message, or none, or they lie ahead.
std::optional<std::string> whyNoTrajectory(const RosTopic& topic) {
  constexpr int kMostMessages = 20;  // the first paths may have one pose
  constexpr std::int64_t kAheadNs = 100'000'000;
  std::optional<std::string> why;
  int count = 0;
  if (topic.type != RosType::kPath) return why;
  try {
    forMessages(topic, [&](const BagMessage& message) {
      std::int64_t stamp_ns;
      const std::vector<PathPose> poses = decodePath(message, stamp_ns);
      if (poses.size() > 1 && poses.front().t_ns == poses.back().t_ns) {
        why = "its poses have no times of their own";
      } else if (!poses.empty() && stamp_ns > 0 && poses.back().t_ns > stamp_ns + kAheadNs) {
        why = "its poses lie ahead of the time of their message";
      }
      return !why && ++count < kMostMessages;
    });
  } catch (const std::runtime_error&) {
    return std::nullopt;  // the reader of the poses reports the damage
  }
  return why;
}

/// Returns the topic with the most messages per second of those that cover the events.
/// @return null if another one is as dense, within 10 %.
const RosTopic* densest(const RosTopics& candidates, const RosTopics& cameras) {
  constexpr double kAlike = 0.9;
  RecordedTopic events;
  for (const RosTopic& camera : cameras) {
    const RecordedTopic of_camera = recorded(camera);
    events.add(0, of_camera.from_ns, of_camera.until_ns);
  }
  if (cameras.empty()) events.add(0, -kEndOfTimeNs, kEndOfTimeNs);
  struct Rated {
    const RosTopic* topic;
    double covered_s, per_second;
  };
  std::vector<Rated> rated;
  double most_s = 0;
  for (const RosTopic& topic : candidates) {
    const RecordedTopic poses = recorded(topic);
    const double weight = topic.type == RosType::kOdometry ? 0.5 : 1;  // odometry drifts
    const double seconds = std::max(secondsBetween(poses.from_ns, poses.until_ns), 1e-9);
    rated.push_back({&topic,
                     std::max(secondsBetween(std::max(poses.from_ns, events.from_ns),
                                             std::min(poses.until_ns, events.until_ns)),
                              0.0),
                     weight * static_cast<double>(poses.messages) / seconds});
    most_s = std::max(most_s, rated.back().covered_s);
  }
  rated.erase(std::remove_if(rated.begin(), rated.end(),
                             [&](const Rated& topic) { return topic.covered_s < kAlike * most_s; }),
              rated.end());
  std::stable_sort(rated.begin(), rated.end(),
                   [](const Rated& a, const Rated& b) { return a.per_second > b.per_second; });
  const bool alike = rated.size() > 1 && rated[1].per_second >= kAlike * rated[0].per_second;
  return rated.empty() || alike ? nullptr : rated[0].topic;
}

/// Reads the poses of paths. A later path corrects the times that it has.
std::string readPaths(const RosTopic& topic, std::vector<StampedPose>& poses) {
  std::map<std::int64_t, PoseNumbers> by_time;
  std::vector<PathPose> last;
  std::string damage = forMessages(topic, [&](const BagMessage& message) {
    std::int64_t stamp_ns;
    std::vector<PathPose> path = decodePath(message, stamp_ns);
    for (std::size_t i = 0; i < path.size(); ++i) {
      const bool same = i < last.size() && path[i].t_ns == last[i].t_ns &&
                        path[i].numbers == last[i].numbers;  // most paths grow at their end
      if (!same) by_time[path[i].t_ns] = path[i].numbers;
    }
    last = std::move(path);
    return true;
  });
  for (const auto& [t_ns, numbers] : by_time) {
    try {
      poses.push_back({t_ns, transformOf(numbers)});
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("{}: {}: pose of {}: {}",
                                           topic.parts.front().bag->file().string(), topic.name,
                                           formatSeconds(t_ns), error.what()));
    }
  }
  return damage;
}

/// Poses of a bag, and their frames as the messages name them.
struct FramedPoses {
  std::string name;  // of the topic
  FrameChain chain;  // from the world to the child frame
  MessageFrames frames = {};
  bool is_transform = false;  // geometry_msgs/TransformStamped
};

/// @return the error of damage that ends the poses; empty if there is none.
std::string readPoses(const RosTopic& topic, FramedPoses& poses) {
  std::vector<StampedPose>& all = poses.chain.emplace_back();
  if (topic.type == RosType::kPath) return readPaths(topic, all);
  return forMessages(topic, [&](const BagMessage& message) {
    const MessageFrames frames = framesOf(message, topic.type);
    if (all.empty()) poses.frames = frames;
    if (frames.child != poses.frames.child) {
      throw std::runtime_error(fmt::format("a pose of {} beside poses of {}: expected one body",
                                           inQuotes(frames.child), inQuotes(poses.frames.child)));
    }
    all.push_back(decodePoses(message, topic.type).front());
    return true;
  });
}

/// Takes the poses. Joins their frame to the frame of camera 0's events, as far as the transforms
/// tell.
void takeJoined(const Frames& tree, const std::string& camera, FramedPoses poses,
                const ReaderOptions& options, RecordingParts& parts) {
  const std::string& body = poses.frames.child;
  const bool differ = !camera.empty() && !body.empty() && body != camera;
  const auto say = [&](std::vector<Warning>& to, const std::string& text) {
    to.push_back({"pose-frame", text});
  };
  FrameTree::Way way;
  if (camera.empty() && !body.empty() && !options.has_hand_eye && tree().hasBelow(body)) {
    say(parts.warnings,
        fmt::format(
            "{}: the poses are those of the frame {}, but transforms join it to others, and "
            "the events do not name their frame: if they are those of another one, give "
            "--topics \"/tf:{}->CAMERA\", or --hand-eye FILE (T_body_rig, the pose of the "
            "camera in {})",
            poses.name, body, poses.frames.frame.empty() ? "WORLD" : poses.frames.frame, body));
  }
  if (differ && poses.is_transform && poses.frames.frame == camera && !options.has_hand_eye) {
    // The camera sees a body that rests: the inverse is the camera's pose.
    for (StampedPose& pose : poses.chain[0]) pose.T_world_rig = pose.T_world_rig.inverse();
  } else if (differ) {
    try {
      way = tree().way(body, camera);
    } catch (const std::runtime_error&) {
      if (!options.has_hand_eye) throw;  // it replaces all ways
    }
    if (options.has_hand_eye && !way.empty()) {
      say(parts.notes,
          fmt::format("--hand-eye replaces the transform {}->{} of the bag", body, camera));
      way.clear();
    } else if (!options.has_hand_eye && way.empty()) {
      say(parts.warnings,
          fmt::format(
              "{}: the poses are those of the frame {}, the events are in the frame {}, and "
              "no transform joins them: if the two differ, give --hand-eye FILE "
              "(T_body_rig, the pose of {} in {}), or record /tf_static, too",
              poses.name, body, camera, camera, body));
    }
  }
  if (!way.empty()) {
    for (auto& transform : tree().along(way, parts.warnings))
      poses.chain.push_back(std::move(transform));
    if (parts.poses_damage.empty()) parts.poses_damage = tree().damage();
  }
  std::uint64_t left_out;
  parts.poses = productOf(poses.chain, left_out);
  if (parts.poses.empty()) {
    throw std::runtime_error("the transforms of the chain have no time in common (one clock?)");
  }
  if (left_out == 0) return;
  say(parts.notes,
      fmt::format("{}: {} poses are left out, as a transform begins later, ends earlier "
                  "or has a gap there",
                  poses.name, left_out));
}

/// Reads the poses of "/tf:world->body". @param option value of `--topics`.
void addPosesOfFrames(const Frames& frames, const std::string& camera, const std::string& option,
                      const ReaderOptions& options, RecordingParts& parts) {
  const FrameTree& tree = frames();
  try {
    const std::string topic = topicIn(option);
    const FrameTree::Way way =
        tree.wayThrough(option.substr(std::min(topic.size() + 1, option.size())));
    if (way.front() == camera) {
      throw std::runtime_error(fmt::format(
          "poses of {} in the camera's frame: expected the camera's poses, --topics \"{}:{}\"",
          way.back(), topic, fmt::join(way.rbegin(), way.rend(), "->")));
    }
    FramedPoses poses = {option, tree.along(way, parts.warnings), {way.front(), way.back()}};
    parts.poses_damage = tree.damage();
    if (std::all_of(poses.chain.begin(), poses.chain.end(),
                    [](const auto& transform) { return transform.size() == 1; })) {
      throw std::runtime_error("constant: expected frames that move against each other");
    }
    takeJoined(frames, camera, std::move(poses), options, parts);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("--topics {}: {}{}", option, error.what(),
                                         tree.damage().empty() ? "" : beforeThe(tree.damage())));
  }
}

/// @param candidates topics with poses. @param cameras topics with events.
void addPoses(const RosTopics& topics, RosTopics candidates, const RosTopics& cameras,
              const Frames& tree, const ReaderOptions& options, RecordingParts& parts) {
  const std::string camera =
      parts.camera_frames.empty() ? options.camera_frame : parts.camera_frames.front().name;
  std::string transforms;  // the name of a topic
  for (const RosTopic& topic : topics) {
    if (topic.type != RosType::kTransforms) continue;
    if (transforms.empty() || topic.name == "/tf") transforms = topic.name;
    for (const std::string& option : options.topics) {
      if (topicIn(option) == topic.name) {
        return addPosesOfFrames(tree, camera, option, options, parts);
      }
    }
  }
  parts.expected_poses = "messages with poses";
  std::string plans;
  for (std::size_t i = candidates.size(); i-- > 0;) {
    if (const auto why = whyNoTrajectory(candidates[i])) {
      plans += fmt::format("; {} is no trajectory: {}", candidates[i].name, *why);
      candidates.erase(candidates.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  parts.expected_poses += plans;
  if (candidates.empty()) {
    for (const std::string& choice : tree().choices(camera)) {
      parts.expected_poses += fmt::format(
          "{} --topics \"{}:{}\"",
          parts.expected_poses.back() == '"' ? "," : "; or those of a frame,", transforms, choice);
    }
    if (transforms.empty() && plans.empty()) return;
    parts.warnings.push_back({"pose-topic", "no poses: expected " + parts.expected_poses});
    return;
  }
  const RosTopic* topic = &candidates.front();
  if (candidates.size() > 1) topic = densest(candidates, cameras);
  if (candidates.size() > 1 || !plans.empty()) {
    const std::string all = namesOf(candidates) + plans;
    if (topic == nullptr) parts.expected_poses = "the choice of one by --topics, of " + all;
    parts.warnings.push_back(
        {"pose-topic",
         topic == nullptr
             ? "no poses: expected " + parts.expected_poses
             : fmt::format("the poses are those of {}, the densest topic that covers the events; "
                           "--topics chooses one, of {}",
                           topic->name, all)});
    if (topic == nullptr) return;
  }
  FramedPoses poses = {topic->name, {}};
  poses.is_transform = topic->type == RosType::kTransform;
  const std::string damage = readPoses(*topic, poses);
  parts.poses_damage = damage;
  try {
    if (!poses.chain[0].empty()) takeJoined(tree, camera, std::move(poses), options, parts);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(
        fmt::format("{}: from the poses' frame to the camera's: {} (or "
                    "--hand-eye FILE)",
                    topic->name, error.what()));
  }
  if (!damage.empty()) parts.expected_poses += beforeThe(damage);
}

/// Takes the frames of the cameras' events, and the cameras' poses by the transforms.
void addCameraFrames(const RosTopics& cameras, const Frames& tree, RecordingParts& parts) {
  for (const RosTopic& camera : cameras) {
    auto& frame = parts.camera_frames.emplace_back();
    frame.name = frameOf(camera);
    const std::string& first = parts.camera_frames.front().name;
    if (frame.name.empty() || frame.name == first) continue;
    std::vector<Warning> ignored;  // a constant transform has no times
    try {
      const FrameChain chain = tree().along(tree().way(first, frame.name), ignored);
      Rigid3 T_cam0_cam;
      bool constant = !chain.empty();
      for (const auto& transform : chain) {
        constant = constant && transform.size() == 1;
        if (constant) T_cam0_cam = T_cam0_cam * transform[0].T_world_rig;
      }
      if (constant) frame.T_cam0_cam = T_cam0_cam;
    } catch (const std::runtime_error& error) {
      parts.warnings.push_back({"camera-frame", fmt::format("{}: {}", frame.name, error.what())});
    }
  }
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
  const RosTopics with_poses = chosen(topics, options, hasPoses);
  for (const auto& bag : bags) {
    if (options.lists_topics || with_poses.size() > 1) bag->countMessages();
  }
  RosTopics with_frames = topics;
  for (const std::filesystem::path& file : options.events_files) {
    for (RosTopic& topic : topicsOf(openBagFiles(file))) with_frames.push_back(std::move(topic));
  }
  std::optional<FrameTree> read;
  const Frames tree = [&]() -> const FrameTree& {
    if (!read) read = treeOf(with_frames);
    return *read;
  };
  addCameraFrames(cameras, tree, parts);
  if (options.lists_topics) {
    std::transform(topics.begin(), topics.end(), std::back_inserter(parts.topics), recorded);
    try {
      parts.transforms =
          tree().transforms(cameras.empty() ? options.camera_frame : parts.camera_frames[0].name);
    } catch (const std::runtime_error& error) {  // the poses may not need them
      parts.notes.push_back({"pose-frame", fmt::format("no transforms: {}", error.what())});
    }
  }
  if (!options.leaves_out_poses) addPoses(topics, with_poses, cameras, tree, options, parts);
  addCalibration(topics, cameras, parts);
  return parts;
}

}  // namespace efm
