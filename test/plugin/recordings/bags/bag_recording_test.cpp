// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/bags/bag_recording.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <tuple>

#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/open/open_recording.h"
#include "plugin/recordings/open/recording_formats.h"
#include "plugin/recordings/streams/event_packets.h"
#include "test/paths.h"
#include "test/plugin/recordings/bags/bag_bytes.h"
#include "test/plugin/recordings/bags/ros_message_bytes.h"
#include "test/plugin/recordings/streams/reading.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

constexpr const char* kArray = "dvs_msgs/EventArray";
constexpr const char* kPacket = "event_camera_msgs/EventPacket";
constexpr const char* kPose = "geometry_msgs/PoseStamped";
constexpr const char* kOdometry = "nav_msgs/Odometry";
constexpr std::int64_t kStartNs = 1'700'000'000'000'000'000;
constexpr std::int64_t kMsNs = 1'000'000;

/// Returns `count` events of an interval in time order, in whole microseconds.
std::vector<Event> someEvents(std::int64_t from_ns, std::int64_t length_ns, int count) {
  std::mt19937 random(static_cast<unsigned>(from_ns / 1000));
  std::vector<Event> events;
  for (int i = 0; i < count; ++i) {
    events.push_back({from_ns + length_ns / 1000 * i / count * 1000,
                      static_cast<std::uint16_t>(random() % 346),
                      static_cast<std::uint16_t>(random() % 260), (random() & 1U) != 0});
  }
  return events;
}

/// Returns a camera's packets of 10 ms. Each is recorded 2 ms after its end.
std::vector<std::vector<Event>> packetsFrom(std::int64_t from_ns, int count) {
  std::vector<std::vector<Event>> packets;
  for (int i = 0; i < count; ++i) {
    packets.push_back(someEvents(from_ns + i * 10 * kMsNs, 10 * kMsNs, 50));
  }
  return packets;
}

RecordedMessages arraysOf(const std::string& topic, const std::vector<std::vector<Event>>& packets,
                          RosBytes kind) {
  RecordedMessages messages;
  for (const auto& packet : packets) {
    messages.push_back({topic, kArray, packet.front().t_ns + 12 * kMsNs, eventArray(kind, packet)});
  }
  return messages;
}

/// Returns EVT3 packets. The sensor's clock is zero at kStartNs - 3 s. The host is late by 3, 2, 1,
/// 0, … ms plus `late_ns`.
RecordedMessages evt3Of(const std::string& topic, const std::vector<std::vector<Event>>& packets,
                        RosBytes kind, std::int64_t late_ns = 0) {
  RecordedMessages messages;
  for (const auto& packet : packets) {
    std::vector<Event> sensor = packet;
    for (Event& event : sensor) event.t_ns -= kStartNs - 3'000 * kMsNs;
    const auto number = static_cast<std::int64_t>(messages.size());
    const std::int64_t stamp_ns = packet.front().t_ns + (3 - number % 4) * kMsNs + late_ns;
    messages.push_back({topic, kPacket, stamp_ns + 12 * kMsNs,
                        eventPacket(kind, stamp_ns, 100 + static_cast<std::uint64_t>(number),
                                    "evt3", evtBytes(EvtEncoding::kEvt3, sensor))});
  }
  return messages;
}

RecordedMessage poseAt(const std::string& topic, const char* type, std::int64_t t_ns,
                       RosBytes kind) {
  RosMessage message(kind);
  message.header(t_ns);
  if (type == std::string(kOdometry)) message.text("cam");
  message.pose({Eigen::Quaterniond::Identity(), {static_cast<double>(t_ns - kStartNs), 2, 3}});
  if (type == std::string(kOdometry)) message.numbers(std::vector<double>(78));
  return {topic, type, t_ns + kMsNs, message.bytes()};
}

RecordedMessages together(RecordedMessages a, const RecordedMessages& b) {
  a.insert(a.end(), b.begin(), b.end());
  std::stable_sort(a.begin(), a.end(), [](const RecordedMessage& x, const RecordedMessage& y) {
    return x.log_ns < y.log_ns;
  });
  return a;
}

std::vector<Event> flat(const std::vector<std::vector<Event>>& packets) {
  std::vector<Event> events;
  for (const auto& packet : packets) events.insert(events.end(), packet.begin(), packet.end());
  return events;
}

class BagRecording : public TemporaryFolder {
 protected:
  enum class Container { kRos1, kRos1SmallChunks, kMcap, kDb3 };
  static constexpr Container kContainers[] = {Container::kRos1, Container::kRos1SmallChunks,
                                              Container::kMcap, Container::kDb3};

  static RosBytes bytesOf(Container container) {
    return container <= Container::kRos1SmallChunks ? RosBytes::kRos1 : RosBytes::kCdr;
  }
  fs::path write(const std::string& name, Container container, const RecordedMessages& messages) {
    const fs::path file = folder() / name;
    if (container == Container::kRos1) writeFile(file, ros1BagBytes(messages));
    if (container == Container::kRos1SmallChunks) writeFile(file, ros1BagBytes(messages, 3));
    if (container == Container::kMcap) writeFile(file, mcapBytes(messages));
    if (container == Container::kDb3) writeDb3(file, messages);
    return file;
  }
  static RecordingParts open(const std::vector<fs::path>& files,
                             const std::vector<std::string>& topics = {}) {
    const RecordingFormat* format = detectFormat(files.front());
    EXPECT_NE(format, nullptr) << files.front();
    ReaderOptions options;
    options.topics = topics;
    return format->open(files, options);
  }
};

TEST_F(BagRecording, EachContainerGivesAllPosesAndTheEventsFromTheSoughtTimeOn) {
  // In 40 s the clock of EVT3 wraps twice. 300 of 4000 periods have events.
  std::vector<std::vector<Event>> packets;
  for (int i = 0; i < 300; ++i) {
    packets.push_back(someEvents(kStartNs + i * 133 * kMsNs, 10 * kMsNs, 20));
  }
  const std::vector<Event> all = flat(packets);
  for (const Container container : kContainers) {
    const RosBytes kind = bytesOf(container);
    RecordedMessages messages =
        together(arraysOf("/a/events", packets, kind), evt3Of("/b/events", packets, kind));
    for (int i = 0; i < 20; ++i) {
      messages.push_back(poseAt("/pose", kPose, kStartNs + i * 10 * kMsNs, kind));
    }
    messages = together(messages, {{"/imu", "sensor_msgs/Imu", kStartNs, "any bytes"}});
    const auto half = messages.begin() + static_cast<std::ptrdiff_t>(messages.size() / 2);
    // The files are in the wrong order: the reader sorts bags by time.
    const std::vector<fs::path> files = {write("b ?#%20", container, {half, messages.end()}),
                                         write("a", container, {messages.begin(), half})};
    for (const double t_s : {-1.0, 0.0, 0.5, 13.77, 20.0, 30.0, 39.7, 60.0}) {
      const std::int64_t t_ns = kStartNs + static_cast<std::int64_t>(t_s * 1e9);
      RecordingParts recording = open(files);
      ASSERT_EQ(recording.cameras.size(), 2U);
      EXPECT_EQ(recording.cameras[0]->size()->width, 346);
      EXPECT_EQ(recording.cameras[1]->size()->width, 640);
      ASSERT_EQ(recording.poses.size(), 20U);
      EXPECT_EQ(recording.poses[3].t_ns, kStartNs + 30 * kMsNs);
      EXPECT_EQ(recording.poses[3].T_world_rig.translation.x(), 30e6);
      for (const auto& camera : recording.cameras) {
        camera->seek(t_ns);
        const std::vector<Event> read = readStream(*camera);
        // The reader gives the last part of all events, with few events before the time.
        ASSERT_LE(read.size(), all.size());
        EXPECT_TRUE(std::equal(read.rbegin(), read.rend(), all.rbegin()));
        const auto from = std::partition_point(
            all.begin(), all.end(), [&](const Event& event) { return event.t_ns < t_ns; });
        const auto wanted = static_cast<std::size_t>(all.end() - from);
        EXPECT_GE(read.size(), wanted) << camera->name() << " " << t_s;
        EXPECT_LE(read.size(), wanted + 60) << camera->name() << " " << t_s;
        EXPECT_EQ(camera->lostPackets(), 0U);
        EXPECT_EQ(camera->progress(), 1);
      }
    }
  }
}

TEST_F(BagRecording, TopicsAreFoundByTypeOrGiven) {
  const auto packets = packetsFrom(kStartNs, 1);
  RecordedMessages messages;
  for (const char* topic : {"/cama/events", "/cam10/events", "/cam002/events", "/cam2/events"}) {
    messages = together(messages, arraysOf(topic, packets, RosBytes::kCdr));
  }
  messages.push_back({"/cam2/triggers", kPacket, kStartNs,
                      eventPacket(RosBytes::kCdr, kStartNs, 0, "trigger", "12345678")});
  const auto add_pose = [&](const char* topic, const char* type, std::int64_t t_ns) {
    messages.push_back(poseAt(topic, type, t_ns, RosBytes::kCdr));
  };
  for (int i = 0; i < 2; ++i) {
    add_pose("/left/odometry", kOdometry, kStartNs + 1 + i * 10 * kMsNs);
    add_pose("/left/pose", kPose, kStartNs + 2 + i * 10 * kMsNs);
  }
  const fs::path one = write("one.mcap", Container::kMcap, messages);
  add_pose("/other/pose", kPose, kStartNs + 3);
  add_pose("/other/pose", kPose, kStartNs + 3 + 10 * kMsNs);
  const fs::path two = write("two.mcap", Container::kMcap, messages);

  struct Case {
    fs::path file;
    std::vector<std::string> topics;
    std::vector<std::string> cameras;
    std::int64_t pose_ns;  // 0 if there are no poses
  };
  const std::vector<std::string> natural = {"/cam002/events", "/cam2/events", "/cam10/events",
                                            "/cama/events"};
  for (const Case& each : std::vector<Case>{
           {one, {}, natural, kStartNs + 2},
           {two, {}, natural, 0},
           {two, {"/other/pose"}, natural, kStartNs + 3},
           {two, {"/left/odometry"}, natural, kStartNs + 1},
           {one, {"/cam10/events", "/cam2/events"}, {natural[2], natural[1]}, kStartNs + 2},
           {one, {"/left/pose", "/cam10/events"}, {natural[2]}, kStartNs + 2}}) {
    const RecordingParts recording = open({each.file}, each.topics);
    std::vector<std::string> names;
    for (const auto& camera : recording.cameras) names.push_back(camera->name());
    for (std::string& name : names) name.erase(0, each.file.string().size() + 2);
    EXPECT_EQ(names, each.cameras);
    ASSERT_EQ(recording.poses.size(), each.pose_ns == 0 ? 0U : 2U);
    if (each.pose_ns > 0) {
      EXPECT_EQ(recording.poses[0].t_ns, each.pose_ns);
    }
  }
  EXPECT_EQ(open({two}).expected_poses,
            "the choice of one by --topics, of /left/odometry, /left/pose, /other/pose");
  writeFile(folder() / "json.mcap",
            replaced(mcapBytes(arraysOf("/events", packets, RosBytes::kCdr)), "cdr", "jso"));
  EXPECT_THAT(open({folder() / "json.mcap"}).cameras, IsEmpty()) << "of another encoding";
  ReaderOptions options;
  options.topics = {"/events/of/another/bag", "/other/pose"};
  EXPECT_EQ(readPoses(two, options).at(0).t_ns, kStartNs + 3);
  options.topics.pop_back();
  EXPECT_THAT(errorOf([&] { readPoses(two, options); }),
              HasSubstr("the choice of one by --topics"));
  EXPECT_THAT(errorOf([&] { open({one}, {"/left"}); }),
              AllOf(StartsWith(one.string()), HasSubstr("no topic /left"),
                    HasSubstr("/cam2/events"), HasSubstr("/left/odometry")));
}

TEST_F(BagRecording, PosesAreOfTheDensestTopicThatCoversTheEvents) {
  struct PoseTopic {
    const char* name;
    const char* type;
    std::int64_t from_ms, until_ms, period_ms;
  };
  const PoseTopic goal = {"/goal", kPose, 40, 41, 1};
  const PoseTopic mocap = {"/mocap", kPose, 0, 900, 10};
  const PoseTopic twin = {"/twin", kPose, 0, 900, 10};
  const PoseTopic sparse = {"/sparse", kPose, 0, 900, 100};
  const PoseTopic odometry = {"/odom", kOdometry, 0, 900, 10};
  const PoseTopic fast_odometry = {"/odom", kOdometry, 0, 900, 1};
  const PoseTopic half = {"/half", kPose, 0, 450, 1};
  struct Case {
    std::vector<PoseTopic> topics;
    std::string expected;  // empty: the choice is asked for
  };
  const std::vector<Case> cases = {{{goal, odometry}, "/odom"},   {{sparse, odometry}, "/odom"},
                                   {{mocap, odometry}, "/mocap"}, {{mocap, fast_odometry}, "/odom"},
                                   {{half, mocap}, "/mocap"},     {{sparse, mocap, goal}, "/mocap"},
                                   {{mocap, twin}, ""},           {{mocap}, "/mocap"}};
  for (const Container container : kContainers) {
    const RosBytes kind = bytesOf(container);
    for (const bool events : {true, false}) {
      for (const Case& each : cases) {
        RecordedMessages messages;
        if (events) messages = arraysOf("/events", packetsFrom(kStartNs, 90), kind);
        std::map<std::string, std::size_t> counts;
        for (const PoseTopic& topic : each.topics) {
          for (std::int64_t t_ms = topic.from_ms; t_ms <= topic.until_ms; t_ms += topic.period_ms) {
            messages.push_back(poseAt(topic.name, topic.type, kStartNs + t_ms * kMsNs, kind));
            ++counts[topic.name];
          }
        }
        // The index of a bag has the times of its chunks: this short bag may have one alone.
        const bool is_one = container == Container::kRos1 && each.topics[0].name == half.name;
        if (is_one) continue;
        const RecordingParts parts = open({write("bag", container, together(messages, {}))});
        const std::size_t expected = each.expected.empty() ? 0 : counts[each.expected];
        EXPECT_EQ(parts.poses.size(), expected) << each.expected;
        if (each.topics.size() == 1) {
          EXPECT_THAT(parts.warnings, IsEmpty());
          continue;
        }
        ASSERT_EQ(parts.warnings.size(), 1U);
        EXPECT_EQ(parts.warnings[0].name, "pose-topic");
        for (const PoseTopic& topic : each.topics) {
          EXPECT_THAT(parts.warnings[0].text, HasSubstr(topic.name));
        }
        EXPECT_THAT(parts.warnings[0].text,
                    StartsWith(expected == 0 ? "no poses: expected the choice of one by --topics"
                                             : "the poses are those of " + each.expected + ","));
      }
    }
  }
}

TEST_F(BagRecording, TopicsMayBeThoseOfEventsInOneBagAndOfPosesInAnother) {
  RecordingSource source;
  source.files = {write("events", Container::kMcap,
                        arraysOf("/events", packetsFrom(kStartNs, 2), RosBytes::kCdr))};
  RecordedMessages poses;
  for (int i = 0; i < 4; ++i) {
    for (const char* topic : {"/a", "/b"}) {
      poses.push_back(poseAt(topic, kPose, kStartNs + i * 10 * kMsNs, RosBytes::kCdr));
    }
  }
  source.poses = write("poses", Container::kMcap, poses);
  source.complete = false;
  EXPECT_THAT(errorOf([&] { openRecording(source); }), HasSubstr("--topics, of /a, /b"));
  source.reader.topics = {"/events", "/b"};
  EXPECT_EQ(openRecording(source)->rig().cameras.size(), 1U);
  writeFile(folder() / "poses.txt", "0 0 0 0 0 0 0 1\n");
  source.poses = folder() / "poses.txt";
  EXPECT_THAT(errorOf([&] { openRecording(source); }), HasSubstr("no topic /b with events"));
}

TEST_F(BagRecording, TopicsHaveTheNumberAndTimesOfTheirMessages) {
  for (const Container container : kContainers) {
    const RosBytes kind = bytesOf(container);
    RecordedMessages messages = arraysOf("/b/events", packetsFrom(kStartNs, 20), kind);
    messages.push_back({"/a", "any_msgs/Any", kStartNs + 40 * kMsNs, "any bytes"});
    messages = together(messages, {});
    const auto half = messages.begin() + 10;
    ReaderOptions options;
    options.lists_topics = true;
    const fs::path first = write("a", container, {messages.begin(), half});
    const fs::path second = write("b", container, {half, messages.end()});
    const auto topics = openBags({second, first}, options).topics;
    ASSERT_EQ(topics.size(), 2U);
    const auto text = [](const RecordedTopic& topic) {
      return fmt::format("{} {} {} {} {}", topic.name, topic.type, topic.messages,
                         (topic.from_ns - kStartNs) / kMsNs, (topic.until_ns - kStartNs) / kMsNs);
    };
    EXPECT_THAT(text(topics[0]), StartsWith("/a any_msgs/Any 1 "));
    EXPECT_LE(topics[0].from_ns, kStartNs + 40 * kMsNs) << "of its chunk";
    EXPECT_GE(topics[0].until_ns, kStartNs + 40 * kMsNs);
    EXPECT_EQ(text(topics[1]), "/b/events dvs_msgs/EventArray 20 12 202");
  }
}

TEST_F(BagRecording, TransformsGiveThePosesOfAFrame) {
  const Rigid3 T_world_odom = {Eigen::Quaterniond(0.5, 0.5, 0.5, 0.5), {1, 0, 0}};
  const Rigid3 T_base_cam = {Eigen::Quaterniond(0, 1, 0, 0), {0, 2, 0}};
  const auto moving = [](int i) {
    return Rigid3{Eigen::Quaterniond(0.8, 0, 0.6, 0), {0.1 * i, 0.2, 3}};
  };
  for (const Container container : kContainers) {
    const RosBytes kind = bytesOf(container);
    const auto message = [&](const char* topic, const char* parent, const char* child,
                             std::int64_t t_ns, const Rigid3& T) {
      RosMessage transforms(kind);
      transforms.u32(1).header(t_ns, parent).text(child).pose(T);
      return RecordedMessage{topic, "tf2_msgs/TFMessage", std::max(t_ns, kStartNs),
                             transforms.bytes()};
    };
    // As trees of frames are: constant transforms once, or again and again in /tf.
    RecordedMessages messages = {message("/tf_static", "base", "cam", 0, T_base_cam)};
    for (int i = 0; i < 10; ++i) {
      const std::int64_t t_ns = kStartNs + i * 10 * kMsNs;
      messages.push_back(message("/tf", "odom", "/base", t_ns, moving(i)));
      messages.push_back(message("/tf", "/world", "odom", t_ns, T_world_odom));
      messages.push_back(message("/tf", "cam", "wheel", t_ns, moving(3 * i)));
    }
    const fs::path file = write("bag", container, messages);
    for (const auto& [frames, T_world_a, T_b_body, backward] :
         std::vector<std::tuple<std::string, Rigid3, Rigid3, bool>>{
             {"odom->base", {}, {}, false},
             {"world->cam", T_world_odom, T_base_cam, false},
             {"cam->world", T_base_cam.inverse(), T_world_odom.inverse(), true}}) {
      const RecordingParts parts = open({file}, {"/tf:" + frames});
      ASSERT_EQ(parts.poses.size(), 10U) << frames;
      for (int i = 0; i < 10; ++i) {
        const StampedPose& pose = parts.poses[static_cast<std::size_t>(i)];
        const Rigid3 T = T_world_a * (backward ? moving(i).inverse() : moving(i)) * T_b_body;
        EXPECT_EQ(pose.t_ns, kStartNs + i * 10 * kMsNs);
        EXPECT_LT(differenceOf(T.inverse() * pose.T_world_rig).norm(), 1e-12) << frames;
      }
    }
    const RecordingParts none = open({file});
    EXPECT_THAT(none.poses, IsEmpty());
    EXPECT_THAT(none.expected_poses,
                HasSubstr("--topics \"/tf:cam->wheel\", --topics \"/tf:odom->wheel\""));
    const std::string frames =
        "base->cam (constant), cam->wheel, odom->base, world->odom (constant)";
    for (const char* wrong : {"/tf:nowhere->cam", "/tf:cam", "/tf:", "/tf:cam->"}) {
      EXPECT_THAT(errorOf([&] { open({file}, {wrong}); }),
                  AllOf(StartsWith(std::string("--topics ") + wrong), HasSubstr("of " + frames)));
    }
    EXPECT_THAT(errorOf([&] { open({file}, {"/tf:base->cam"}); }), HasSubstr("constant"));
    EXPECT_THAT(errorOf([&] { open({file}, {"/other:world->cam"}); }),
                HasSubstr("no topic /other"));
  }
}

/// A robot: localisation map->odom (5 Hz, it jumps), odometry odom->base (20 Hz), a mast, and a
/// camera whose transform was published backwards.
class RobotBag {
 public:
  static constexpr int kPoses = 41;  // of the odometry

  explicit RobotBag(RosBytes kind) : kind_(kind) {
    messages = arraysOf("/left/events", packetsFrom(kStartNs, 200), kind);
    transform("/tf_static", kStartNs, "base", "mast", T_base_mast);
    transform("/tf_static", kStartNs, "/cam", "mast", T_mast_cam.inverse());
    for (int i = 0; i < kPoses; ++i) {
      transform("/tf", odomNs(i), "odom", "base", T_odom_base(odomNs(i)));
    }
    for (int i = 0; i < 10; ++i) {
      transform("/tf", mapNs(i), "map", "odom", T_map_odom(i));
      transform("/tf", mapNs(i), "base", "wheel", {rotationBy({0.5 * i, 0, 0}), {0, 1, 0}});
    }
  }
  void transform(const char* topic, std::int64_t t_ns, const char* parent, const char* child,
                 const Rigid3& T) {
    RosMessage bytes(kind_);
    bytes.u32(1).header(t_ns, parent).text(child).pose(T);
    messages.push_back({topic, "tf2_msgs/TFMessage", t_ns, bytes.bytes()});
  }
  /// Adds a message of a pose. @param child empty: the type has none.
  void pose(const char* topic, const char* type, std::int64_t t_ns, const char* frame,
            const std::string& child, const Rigid3& T) {
    RosMessage bytes(kind_);
    bytes.header(t_ns, frame);
    if (!child.empty()) bytes.text(child);
    bytes.pose(T).numbers(std::vector<double>(78));
    messages.push_back({topic, type, t_ns, bytes.bytes()});
  }
  void odometry(const char* child) {
    for (int i = 0; i < kPoses; ++i) {
      pose("/odom", kOdometry, odomNs(i), "odom", child, T_odom_base(odomNs(i)));
    }
  }

  static std::int64_t odomNs(int i) { return kStartNs + i * 50 * kMsNs; }
  static std::int64_t mapNs(int i) { return kStartNs + (100 + i * 200) * kMsNs; }
  static Rigid3 T_odom_base(std::int64_t t_ns) {
    const double t_s = 1e-9 * static_cast<double>(t_ns - kStartNs);
    return {rotationBy({0, 0, 0.3 * t_s}), {t_s, 0.1 * t_s, 0}};
  }
  static Rigid3 T_map_odom(int i) {
    return {rotationBy({0, 0, i > 5 ? 0.2 : 0.1}), {i > 5 ? 0.3 : 0.2, 1, 0}};
  }
  /// Returns T_map_odom between two messages, at a time that has both.
  static Rigid3 T_map_odomAt(std::int64_t t_ns) {
    const auto i = static_cast<int>((t_ns - mapNs(0)) / (200 * kMsNs));
    const double part = 1e-9 * static_cast<double>(t_ns - mapNs(i)) / 0.2;
    return part > 0 ? interpolate(T_map_odom(i), T_map_odom(i + 1), part) : T_map_odom(i);
  }

  const Rigid3 T_base_mast = {Eigen::Quaterniond(0.8, 0, 0.6, 0), {0.5, 0, 1}};
  const Rigid3 T_mast_cam = {Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5), {0, 0.2, 0}};
  const Rigid3 T_base_cam = T_base_mast * T_mast_cam;
  RecordedMessages messages;

 private:
  RosBytes kind_;
};

TEST_F(BagRecording, ChainsOfTransformsEndInTheFrameOfTheEvents) {
  const auto expectPoses = [](const RecordingParts& parts, int first, int count,
                              const std::function<Rigid3(std::int64_t)>& T_world_rig,
                              const std::string& what) {
    ASSERT_EQ(parts.poses.size(), static_cast<std::size_t>(count)) << what;
    for (int i = 0; i < count; ++i) {
      const StampedPose& pose = parts.poses[static_cast<std::size_t>(i)];
      ASSERT_EQ(pose.t_ns, RobotBag::odomNs(first + i)) << what;
      const Rigid3 error = T_world_rig(pose.t_ns).inverse() * pose.T_world_rig;
      ASSERT_LT(differenceOf(error).norm(), 1e-9) << what << " " << i;
    }
  };
  for (const Container container : kContainers) {
    const auto opened = [&](const RobotBag& bag, const std::vector<std::string>& topics = {},
                            bool hand_eye = false) {
      ReaderOptions options;
      options.topics = topics;
      options.has_hand_eye = hand_eye;
      return openBags({write("bag", container, together(bag.messages, {}))}, options);
    };
    const RobotBag robot(bytesOf(container));
    const auto T_odom_cam = [&](std::int64_t t_ns) {
      return RobotBag::T_odom_base(t_ns) * robot.T_base_cam;
    };
    const auto T_map_cam = [&](std::int64_t t_ns) {
      return RobotBag::T_map_odomAt(t_ns) * T_odom_cam(t_ns);
    };
    for (const char* frames : {"/tf:map->cam", "/tf:/map->/cam", "/tf:map->base",
                               "/tf:map->odom->base->mast->cam", "/tf:map->mast"}) {
      const RecordingParts parts = opened(robot, {frames});
      expectPoses(parts, 2, 37, T_map_cam, frames);
      ASSERT_EQ(parts.notes.size(), 1U) << "the localisation begins later and ends earlier";
      EXPECT_THAT(parts.notes[0].text, HasSubstr("4 poses are left out"));
    }
    expectPoses(opened(robot, {"/tf:odom->cam"}), 0, RobotBag::kPoses, T_odom_cam, "odom->cam");
    EXPECT_THAT(
        errorOf([&] { opened(robot, {"/tf:cam->map"}); }),
        HasSubstr("expected the camera's poses, --topics \"/tf:map->odom->base->mast->cam\""));
    const RecordingParts none = opened(robot);
    EXPECT_THAT(none.poses, IsEmpty());
    EXPECT_THAT(none.expected_poses,
                HasSubstr("--topics \"/tf:odom->cam\", --topics \"/tf:map->cam\""));

    RobotBag odometry = robot;
    odometry.odometry("base");
    RecordingParts parts = opened(odometry);
    expectPoses(parts, 0, RobotBag::kPoses, T_odom_cam, "odometry of the base");
    EXPECT_THAT(parts.warnings, IsEmpty());
    EXPECT_THAT(parts.notes, IsEmpty());
    parts = opened(odometry, {}, true);
    expectPoses(parts, 0, RobotBag::kPoses, RobotBag::T_odom_base, "with a hand-eye transform");
    ASSERT_EQ(parts.notes.size(), 1U);
    EXPECT_THAT(parts.notes[0].text, HasSubstr("--hand-eye replaces the transform base->cam"));

    RobotBag other = robot;
    other.odometry("body");
    parts = opened(other);
    expectPoses(parts, 0, RobotBag::kPoses, RobotBag::T_odom_base, "odometry of another frame");
    ASSERT_EQ(parts.warnings.size(), 1U);
    EXPECT_EQ(parts.warnings[0].name, "pose-frame");
    EXPECT_THAT(parts.warnings[0].text, AllOf(HasSubstr("frame body"), HasSubstr("frame cam"),
                                              HasSubstr("--hand-eye FILE")));
    EXPECT_THAT(opened(other, {}, true).warnings, IsEmpty());

    RobotBag nameless(bytesOf(container));  // events of an old driver
    for (RecordedMessage& message : nameless.messages) {
      if (message.type != kArray) continue;
      message.data = eventArray(bytesOf(container), someEvents(message.log_ns, kMsNs, 5), "");
    }
    nameless.odometry("base");
    parts = opened(nameless);
    ASSERT_EQ(parts.warnings.size(), 1U);
    EXPECT_THAT(parts.warnings[0].text,
                AllOf(HasSubstr("do not name their frame"), HasSubstr("/tf:odom->CAMERA")));
    expectPoses(opened(nameless, {"/tf:odom->cam"}), 0, RobotBag::kPoses, T_odom_cam, "named");

    RobotBag seen(bytesOf(container));  // a tag that the camera sees, and the camera's own poses
    for (int i = 0; i < RobotBag::kPoses; ++i) {
      const std::int64_t t_ns = RobotBag::odomNs(i);
      seen.pose("/tag", "geometry_msgs/TransformStamped", t_ns, "cam", "tag",
                T_odom_cam(t_ns).inverse());
    }
    expectPoses(opened(seen), 0, RobotBag::kPoses, T_odom_cam, "poses of a tag");
  }
}

TEST_F(BagRecording, TransformsThatContradictEachOtherAreErrors) {
  const auto errorOfBag = [&](const RobotBag& bag, const std::vector<std::string>& topics) {
    return errorOf(
        [&] { open({write("bag", Container::kMcap, together(bag.messages, {}))}, topics); });
  };
  const RobotBag robot(RosBytes::kCdr);
  RobotBag moved = robot;
  moved.transform("/tf_static", kStartNs + 5 * kMsNs, "base", "mast",
                  {{1, 0, 0, 0}, {0.5, 0.1, 1}});
  EXPECT_THAT(errorOfBag(moved, {"/tf:map->cam"}),
              AllOf(HasSubstr("base->mast is constant, but has another value at 1700000000.005"),
                    HasSubstr("--hand-eye FILE")));
  RobotBag repeated = robot;
  repeated.transform("/tf_static", kStartNs + 5 * kMsNs, "base", "mast",
                     {robot.T_base_mast.rotation, robot.T_base_mast.translation * 1.0001});
  EXPECT_EQ(errorOfBag(repeated, {"/tf:map->cam"}), "no error");
  RobotBag twice = robot;  // a second publisher of the odometry
  for (int i = 0; i + 1 < RobotBag::kPoses; ++i) {
    const std::int64_t t_ns = RobotBag::odomNs(i) + 3 * kMsNs;
    twice.transform("/tf", t_ns, "odom", "base", {{1, 0, 0, 0}, {0, 3, 0}});
  }
  EXPECT_THAT(errorOfBag(twice, {"/tf:map->cam"}),
              HasSubstr("the transform odom->base: poses of two bodies"));
  RobotBag ways = robot;
  for (int i = 0; i < RobotBag::kPoses; ++i) {
    ways.transform("/tf", RobotBag::odomNs(i), "gps", "base",
                   RobotBag::T_odom_base(RobotBag::odomNs(i)));
  }
  ways.transform("/tf_static", kStartNs, "map", "gps", {});
  const std::string error = errorOfBag(ways, {"/tf:map->cam"});
  EXPECT_THAT(error, HasSubstr("several ways from map to cam: expected one of \"/tf:map->"));
  for (const char* way : {"map->gps->base->mast->cam", "map->odom->base->mast->cam"}) {
    EXPECT_THAT(error, HasSubstr(way));
    EXPECT_EQ(errorOfBag(ways, {std::string("/tf:") + way}), "no error")
        << "the way that the error names";
  }
  ways.transform("/tf", kStartNs, "map", "base", {});
  ways.transform("/tf", kStartNs + 9 * kMsNs, "map", "base", {{1, 0, 0, 0}, {0, 0, 0.001}});
  const RecordingParts named =
      open({write("bag", Container::kMcap, together(ways.messages, {}))}, {"/tf:map->base"});
  EXPECT_EQ(named.poses.size(), 2U) << "the transform of just these two frames";
  RobotBag direct = robot;  // nobody named the direct way from the base to the camera
  direct.transform("/tf_static", kStartNs, "base", "cam", {});
  EXPECT_THAT(errorOfBag(direct, {"/tf:map->base"}), HasSubstr("several ways from base to cam"));
  EXPECT_EQ(errorOfBag(direct, {"/tf:map->base->cam"}), "no error");
  RobotBag early = robot;
  for (RecordedMessage& message : early.messages) {
    if (message.topic == "/tf" && message.data.find("map") != std::string::npos)
      message.data.clear();
  }
  early.messages.erase(std::remove_if(early.messages.begin(), early.messages.end(),
                                      [](const auto& message) { return message.data.empty(); }),
                       early.messages.end());
  early.transform("/tf", 5 * kMsNs, "map", "odom", {});
  early.transform("/tf", 9 * kMsNs, "map", "odom", {{1, 0, 0, 0}, {1, 0, 0}});
  EXPECT_THAT(errorOfBag(early, {"/tf:map->base"}), HasSubstr("have no time in common"));
  RobotBag broken = robot;  // poses that need no transforms are read
  broken.messages.push_back({"/tf", "tf2_msgs/TFMessage", kStartNs, "no message"});
  broken.messages.push_back(poseAt("/pose", kPose, kStartNs, RosBytes::kCdr));
  EXPECT_EQ(errorOfBag(broken, {}), "no error");
  EXPECT_THAT(errorOfBag(broken, {"/tf:map->base"}), HasSubstr("/tf: message of 1700000000.0"));
  RobotBag bodies = robot;
  bodies.odometry("base");
  bodies.pose("/odom", kOdometry, kStartNs + 7 * kMsNs, "odom", "other", {});
  EXPECT_THAT(errorOfBag(bodies, {}), HasSubstr("a pose of 'other' beside poses of 'base'"));
}

TEST_F(BagRecording, CamerasFramesAreComparedWithTheirCalibration) {
  for (const double apart_m : {0.1, 0.109, 0.111, -0.1}) {
    RobotBag robot(RosBytes::kCdr);
    for (int i = 0; i < 200; ++i) {
      const auto events = someEvents(kStartNs + i * 10 * kMsNs, 10 * kMsNs, 50);
      robot.messages.push_back({"/right/events", kArray, events.back().t_ns,
                                eventArray(RosBytes::kCdr, events, "right")});
    }
    robot.transform("/tf_static", kStartNs, "mast", "right",
                    robot.T_mast_cam * Rigid3{{1, 0, 0, 0}, {apart_m, 0, 0}});
    writeFile(folder() / "camchain.yaml",
              "cam0: {camera_model: pinhole, distortion_model: none, distortion_coeffs: [], "
              "intrinsics: [226, 226, 173, 130], resolution: [346, 260]}\n"
              "cam1: {camera_model: pinhole, distortion_model: none, distortion_coeffs: [], "
              "intrinsics: [226, 226, 173, 130], resolution: [346, 260], T_cn_cnm1: [[1, 0, 0, "
              "-0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}\n");
    RecordingSource source;
    source.files = {write("bag", Container::kMcap, together(robot.messages, {}))};
    source.calibration = folder() / "camchain.yaml";
    source.reader.topics = {"/tf:map->cam"};
    const std::vector<Warning> warnings = openRecording(source)->counts().warnings;
    if (std::abs(apart_m - 0.1) < 0.01) {
      EXPECT_THAT(warnings, IsEmpty()) << apart_m;
    } else {
      ASSERT_EQ(warnings.size(), 1U) << apart_m;
      EXPECT_EQ(warnings[0].name, "camera-frame");
      EXPECT_THAT(warnings[0].text, HasSubstr("camera 1 is 0."));
    }
    // The poses may be in another bag than the events and the constant transforms.
    RecordedMessages events, poses;
    for (const RecordedMessage& message : robot.messages) {
      (message.topic == "/tf" ? poses : events).push_back(message);
    }
    source.files = {write("events", Container::kMcap, together(events, {}))};
    source.poses = write("poses", Container::kMcap, together(poses, {}));
    const auto recording = openRecording(source);
    std::size_t count = 0;
    while (const auto sample = recording->next()) {
      const auto* pose = std::get_if<PoseSample>(&*sample);
      if (pose == nullptr) continue;
      ++count;
      const Rigid3 T_map_cam =
          RobotBag::T_map_odomAt(pose->t_ns) * RobotBag::T_odom_base(pose->t_ns) * robot.T_base_cam;
      EXPECT_LT(differenceOf(T_map_cam.inverse() * pose->T_world_body).norm(), 1e-6);
    }
    EXPECT_EQ(count, 37U);
  }
}

TEST_F(BagRecording, AllMessagesOfAPathCount) {
  const auto T_world_rig = [](int i, double y = 0) {
    return Rigid3{{1, 0, 0, 0}, {0.01 * i, y, 0}};
  };
  const auto path = [&](const char* topic, int at, int first, int end, double y,
                        std::int64_t stamp_ns = -1) {
    RosMessage message(RosBytes::kCdr);
    const std::int64_t now_ns = kStartNs + at * 10 * kMsNs;
    message.header(now_ns, "world").u32(static_cast<std::size_t>(end - first));
    for (int i = first; i < end; ++i) {
      message.header(stamp_ns < 0 ? kStartNs + i * 10 * kMsNs : stamp_ns, "world");
      message.pose(T_world_rig(i, y));
    }
    return RecordedMessage{topic, "nav_msgs/Path", now_ns, message.bytes()};
  };
  struct Case {
    const char* name;
    std::vector<RecordedMessage> messages;
    std::size_t poses;
    std::string said;
  };
  std::vector<Case> cases = {{"growing", {}, 100, ""},
                             {"sliding", {}, 100, ""},
                             {"started anew", {}, 100, ""},
                             {"corrected", {}, 100, ""},
                             {"a plan", {}, 0, "/path is no trajectory: its poses have no times"},
                             {"a plan with times", {}, 0, "its poses lie ahead"}};
  for (int i = 1; i <= 100; ++i) {
    cases[0].messages.push_back(path("/path", i, 0, i, 0));
    cases[1].messages.push_back(path("/path", i, std::max(0, i - 20), i, 0));
    cases[2].messages.push_back(path("/path", i, i > 70 ? 70 : 0, i, 0));
    cases[3].messages.push_back(path("/path", i, 0, i, i == 100 ? 0 : 1));
    cases[4].messages.push_back(path("/path", i, i, i + 50, 0, kStartNs + i * 10 * kMsNs));
    cases[5].messages.push_back(path("/path", i, i, i + 50, 0));
  }
  for (const Case& each : cases) {
    const RecordingParts parts = open({write("bag", Container::kMcap, each.messages)});
    ASSERT_EQ(parts.poses.size(), each.poses) << each.name;
    for (std::size_t i = 0; i < each.poses; ++i) {
      EXPECT_EQ(parts.poses[i].t_ns, kStartNs + static_cast<std::int64_t>(i) * 10 * kMsNs);
      EXPECT_TRUE(isSame(parts.poses[i].T_world_rig, T_world_rig(static_cast<int>(i)))) << i;
    }
    EXPECT_THAT(parts.expected_poses, HasSubstr(each.said));
    if (each.poses > 0) continue;
    // The tracker's topic is used, and the plan is named.
    RecordedMessages both = each.messages;
    for (int i = 0; i < 20; ++i) {
      both.push_back({"/tracker", kPose, kStartNs + i * 50 * kMsNs,
                      poseStamped(RosBytes::kCdr, kStartNs + i * 50 * kMsNs, T_world_rig(i))});
    }
    const RecordingParts tracked = open({write("bag", Container::kMcap, together(both, {}))});
    EXPECT_EQ(tracked.poses.size(), 20U) << each.name;
    ASSERT_EQ(tracked.warnings.size(), 1U);
    EXPECT_THAT(tracked.warnings[0].text, AllOf(HasSubstr("of /tracker"), HasSubstr(each.said)));
    RecordingSource source;
    source.files = {write("events", Container::kMcap,
                          arraysOf("/events", packetsFrom(kStartNs, 90), RosBytes::kCdr))};
    source.poses = write("bag", Container::kMcap, together(both, {}));
    source.complete = false;
    ASSERT_EQ(openRecording(source)->counts().warnings.size(), 1U) << "a bag given by --poses";
    EXPECT_EQ(openRecording(source)->counts().warnings[0].name, "pose-topic");
  }
}

TEST_F(BagRecording, OneCameraHasItsCalibrationFromCameraInfo) {
  const auto packets = packetsFrom(kStartNs, 1);
  RecordedMessages messages = arraysOf("/dvs/events", packets, RosBytes::kCdr);
  const auto info = [](const char* topic, const char* model) {
    return RecordedMessage{topic, "sensor_msgs/CameraInfo", kStartNs,
                           cameraInfo(RosBytes::kCdr, model, {0.1, 0.2, 0.3, 0.4})};
  };
  messages.push_back(info("/colour/camera_info", "plumb_bob"));
  const fs::path file = folder() / "bag.mcap";
  writeFile(file, mcapBytes(messages));
  EXPECT_FALSE(open({file}).calibration) << "of another camera";

  messages.push_back(info("/dvs/camera_info", "equidistant"));
  writeFile(file, mcapBytes(messages));
  const RecordingParts recording = open({file});
  ASSERT_TRUE(recording.calibration);
  EXPECT_EQ(recording.calibration->rig.cameras.at(0).model.distortion,
            DistortionModel::kEquidistant);

  messages = together(messages, arraysOf("/dvs2/events", packets, RosBytes::kCdr));
  writeFile(file, mcapBytes(messages));
  EXPECT_FALSE(open({file}).calibration);
  EXPECT_THAT(open({file}).expected_calibration, HasSubstr("which messages of sensor_msgs"));
}

TEST_F(BagRecording, LostPacketsAreCountedAndTheClockGoesOn) {
  const auto packets = packetsFrom(kStartNs, 3'000);  // 30 s of packets
  for (const Container container : {Container::kRos1, Container::kDb3}) {
    RecordedMessages messages = evt3Of("/events", packets, bytesOf(container));
    std::vector<std::vector<Event>> left = packets;
    for (const auto& [first, count] : {std::pair(2'500, 1), std::pair(200, 2'000)}) {  // 20 s
      messages.erase(messages.begin() + first, messages.begin() + first + count);
      left.erase(left.begin() + first, left.begin() + first + count);
    }
    // The last packet does not contain its time.
    const std::int64_t stamp_ns = kStartNs + 40'000 * kMsNs;
    messages.push_back({"/events", kPacket, stamp_ns,
                        eventPacket(bytesOf(container), stamp_ns, 3'110, "evt3",
                                    evt3Words({0x2002, 0x2003, 0x2004}))});
    RecordingParts recording = open({write("bag", container, messages)});
    EXPECT_TRUE(readStream(*recording.cameras.at(0)) == flat(left));
    EXPECT_EQ(recording.cameras[0]->lostPackets(), 2'011U);
    EXPECT_EQ(recording.cameras[0]->undatedEvents(), 3U);
  }
}

TEST_F(BagRecording, CamerasSynchronisedByWireAndBagsOfARecordingKeepTheirCommonClock) {
  const auto first = packetsFrom(kStartNs, 30);
  const auto second = packetsFrom(kStartNs + 2'000 * kMsNs, 30);
  const auto late = [](std::vector<Event> events, std::int64_t late_ns) {
    for (Event& event : events) event.t_ns += late_ns;
    return events;
  };
  for (const std::int64_t over_ns : {0, 1'000}) {
    for (const std::int64_t sign : {-1, 1}) {
      std::int64_t late_ns = sign * (10 * kMsNs + over_ns);
      RecordingParts cameras =
          open({write("cameras", Container::kMcap,
                      together(evt3Of("/a/events", first, RosBytes::kCdr),
                               evt3Of("/b/events", first, RosBytes::kCdr, late_ns)))});
      EXPECT_TRUE(readStream(*cameras.cameras.at(1)) ==
                  late(readStream(*cameras.cameras.at(0)), over_ns > 0 ? late_ns : 0));
      late_ns = sign * (50 * kMsNs + over_ns);
      RecordingParts bags = open(
          {write("one", Container::kMcap, evt3Of("/events", first, RosBytes::kCdr)),
           write("two", Container::kMcap, evt3Of("/events", second, RosBytes::kCdr, late_ns))});
      std::vector<Event> expected = flat(first);
      for (const Event& event : late(flat(second), over_ns > 0 ? late_ns : 0)) {
        expected.push_back(event);
      }
      EXPECT_TRUE(readStream(*bags.cameras.at(0)) == expected) << late_ns;
    }
  }
}

TEST_F(BagRecording, MonoTimesAreTheHostsOrTheSensorsByTheirFirstOffset) {
  const auto packets = packetsFrom(kStartNs, 10);
  constexpr std::int64_t kSecondNs = 1'000 * kMsNs;
  for (const auto& [behind_ns, is_host] : {std::pair<std::int64_t, bool>{0, true},
                                           {kSecondNs - 2 * kMsNs, true},
                                           {kSecondNs + 1, false},
                                           {-kSecondNs, true},
                                           {-kSecondNs - 1, false},
                                           {kStartNs - 7, false}}) {
    RecordedMessages messages;
    for (const auto& packet : packets) {
      const std::int64_t base_ns = packet.front().t_ns - behind_ns;
      const std::int64_t stamp_ns = packet.front().t_ns + (messages.empty() ? 0 : 2 * kMsNs);
      messages.push_back({"/events", kPacket, stamp_ns,
                          eventPacket(RosBytes::kCdr, stamp_ns, messages.size(), "mono",
                                      monoWords(packet, packet.front().t_ns),
                                      static_cast<std::uint64_t>(base_ns))});
    }
    const RecordingParts recording = open({write("bag", Container::kDb3, messages)});
    std::vector<Event> expected = flat(packets);
    for (Event& event : expected) event.t_ns -= is_host ? behind_ns : 0;
    EXPECT_TRUE(readStream(*recording.cameras.at(0)) == expected) << behind_ns;
  }
}

TEST_F(BagRecording, LibcaersTimesAreTheHostsWhateverTheStamps) {
  constexpr std::int64_t kWrapNs = (std::int64_t{1} << 31) * 1'000;
  for (const Container container : kContainers) {
    const RosBytes kind = bytesOf(container);
    for (const bool packed : {false, true}) {
      RecordedMessages messages;
      std::vector<std::vector<Event>> packets;
      for (std::int64_t i = 0; i < 30; ++i) {
        if (i == 10 || i == 11) continue;  // lost packets
        packets.push_back(someEvents(kStartNs + i * 10 * kMsNs, 10 * kMsNs, 30));
        // The time of 31 bits starts again at 0 in packet 20.
        const std::int64_t low_base_ns =
            kStartNs + 205 * kMsNs - kWrapNs + (i > 20 ? kWrapNs : std::int64_t{0});
        const std::int64_t base_ns = packed ? packets.back().front().t_ns : low_base_ns;
        // The difference between the sensor's and the host's clock grows by 0.1 s per packet.
        const std::int64_t stamp_ns = kStartNs + i * 110 * kMsNs;
        messages.push_back({"/events", kPacket, stamp_ns,
                            eventPacket(kind, stamp_ns, static_cast<std::uint64_t>(i),
                                        packed ? "libcaer_cmp" : "libcaer",
                                        packed ? libcaerCmpWords(packets.back(), base_ns)
                                               : libcaerWords(packets.back(), base_ns),
                                        static_cast<std::uint64_t>(base_ns))});
      }
      const fs::path file = write("bag", container, messages);
      const RecordingParts recording = open({file});
      EventStream& camera = *recording.cameras.at(0);
      EXPECT_EQ(camera.size()->height, 480);
      EXPECT_TRUE(readStream(camera) == flat(packets)) << packed;
      EXPECT_EQ(camera.lostPackets(), 2U);
      EXPECT_EQ(camera.undatedEvents(), 0U);
      const RecordingParts again = open({file});
      again.cameras[0]->seek(kStartNs + 250 * kMsNs);
      const std::vector<Event> end = readStream(*again.cameras[0]);
      EXPECT_LE(end.front().t_ns, kStartNs + 250 * kMsNs);
      EXPECT_GT(end.front().t_ns, kStartNs + 100 * kMsNs);
    }
  }
}

TEST_F(BagRecording, AnEventBesideTheSensorNamesItsMessageAndNumber) {
  const std::string words =
      libcaerCmpWords({{kStartNs, 639, 479, true}, {kStartNs, 640, 2, true}}, kStartNs);
  const fs::path file =
      write("bag", Container::kMcap,
            {{"/events", kPacket, kStartNs,
              eventPacket(RosBytes::kCdr, kStartNs, 0, "libcaer_cmp", words, kStartNs)}});
  EventPackets packets(std::move(open({file}).cameras.at(0)), {640, 480});
  EXPECT_EQ(packets.nextPacket().size(), 1U);
  EXPECT_THAT(packets.damage(),
              StartsWith(file.string() +
                         ": /events: message of 1700000000.000000000: event 1: x = '640': expected "
                         "a whole number from 0 to 639"));
}

TEST_F(BagRecording, AnotherEncodingOrAnotherClockIsAnErrorThatNamesTheMessage) {
  const auto packet = [](std::int64_t t_ns, const std::string& encoding, const std::string& data) {
    return RecordedMessage{"/events", kPacket, t_ns,
                           eventPacket(RosBytes::kCdr, t_ns, 0, encoding, data, kStartNs)};
  };
  RecordedMessages anew = evt3Of("/events", packetsFrom(kStartNs, 110), RosBytes::kCdr);
  anew.push_back(packet(kStartNs + 8'000 * kMsNs, "evt3",
                        evtBytes(EvtEncoding::kEvt3, someEvents(0, kMsNs, 3))));
  const std::pair<RecordedMessages, std::vector<std::string>> rows[] = {
      {{packet(kStartNs, "libcaer", ""), packet(kStartNs, "libcaer_raw", "")},
       {"'libcaer_raw': expected 'libcaer'"}},
      {{packet(kStartNs, "libcaer_raw", "")},
       {"expected evt3, evt21, evt2, mono, libcaer or libcaer_cmp"}},
      {anew,
       {": /events: message of 1700000008.000000000", "header.stamp = 1700000008.000000000",
        "expected one clock"}}};
  for (const auto& [messages, parts] : rows) {
    const fs::path file = write("bag", Container::kMcap, messages);
    const std::string error = errorOf([&] { readStream(*open({file}).cameras.at(0)); });
    EXPECT_THAT(error, StartsWith(file.string()));
    for (const std::string& part : parts) EXPECT_THAT(error, HasSubstr(part));
  }
}

TEST_F(BagRecording, WrongFilesAreErrorsThatSayWhatToDo) {
  const auto ros1 = arraysOf("/events", packetsFrom(kStartNs, 3), RosBytes::kRos1);
  const auto cdr = arraysOf("/events", packetsFrom(kStartNs, 3), RosBytes::kCdr);
  const std::string bag = ros1BagBytes(ros1);
  std::string unindexed = bag;
  const std::size_t index = bag.find("index_pos=") + 10;
  unindexed.replace(index, 8, std::string(8, '\0'));
  std::string packed = bag;
  packed.replace(packed.find("compression=none"), 16, "compression=zlib");
  struct Case {
    std::string name;
    std::string bytes;
    const char* expected;
  };
  const std::string zstd = "\x28\xb5\x2f\xfd\x20";
  for (const Case& wrong : std::vector<Case>{
           {"unindexed.bag", unindexed, "`rosbag reindex` repairs it"},
           {"cut.bag", bag.substr(0, 5000), "`rosbag reindex` repairs it"},
           {"cut_index.bag", bag.substr(0, bag.size() - 5), "the data ends at byte"},
           {"old.bag", "#ROSBAG V1.2\n", "expected a bag of version 2.0"},
           {"packed.bag", packed, "compression = 'zlib': expected 'none', 'bz2', 'lz4'"},
           {"locked.bag", replaced(bag, "chunk_count=", "encryptor=ab"), "encrypted with 'ab"},
           {"field.bag", replaced(bag, "conn_count=", "conn_count:"), "expected NAME=VALUE"},
           {"op.bag", replaced(bag, "op=\3", "op=\2"), "another record: expected the bag's header"},
           {"chunk.bag", replaced(bag, "op=\5", "op=\4"), "record of op 4: expected a chunk"},
           {"infos.bag", replaced(bag, "op=\6", "op=\5"),
            "record of op 5: expected connections an"},
           {"a.db3.zstd", zstd, "a compressed bag: expected an uncompressed one"},
           {"a.mcap.zstd", zstd, "a compressed bag"},
           {"other.db3", std::string("SQLite format 3\0 and other text", 32), "SQLite: "},
           {"folder/metadata.yaml", "rosbag2_bagfile_information:\n  compression_mode: FILE\n",
            "a compressed bag"},
           {"folder2/metadata.yaml",
            "rosbag2_bagfile_information:\n  relative_file_paths: [none.db3]\n",
            "none.db3: no such file: expected a bag"},
           {"folder3/metadata.yaml", "rosbag2_bagfile_information:\n  version: 5\n",
            "relative_file_paths is missing or empty"}}) {
    const fs::path file = folder() / wrong.name;
    writeFile(file, wrong.bytes);
    const fs::path source = file.filename() == "metadata.yaml" ? file.parent_path() : file;
    EXPECT_THAT(errorOf([&] { readStream(*open({source}).cameras.at(0)); }),
                AllOf(StartsWith(source.string()), HasSubstr(wrong.expected)));
  }
  writeDb3(folder() / "good/part.db3", cdr);
  writeFile(folder() / "good/metadata.yaml",
            "rosbag2_bagfile_information:\n  relative_file_paths: [good/part.db3]\n");
  EXPECT_EQ(readStream(*open({folder() / "good"}).cameras.at(0)).size(), 150U);
  const fs::path views = folder() / "good/part.db3";  // a view could be an endless query
  sqlite3* database = nullptr;
  sqlite3_open(views.c_str(), &database);
  sqlite3_exec(database,
               "ALTER TABLE topics RENAME TO other; CREATE VIEW topics AS SELECT * FROM other",
               nullptr, nullptr, nullptr);
  sqlite3_close(database);
  EXPECT_THAT(errorOf([&] { open({views}); }),
              StartsWith(views.string() + ": expected the tables `topics` and `messages`"));
}

TEST_F(BagRecording, ARealBagOfAPropheseeCameraHasAllEvents) {
  const fs::path file = EFM_SHARED_DATA "/raw_formats/event_camera_py_test_events_1.bag";
  if (!fs::exists(file)) GTEST_SKIP() << file << " is not there";
  RecordingParts recording = open({file});
  EventStream& camera = *recording.cameras.at(0);
  EXPECT_EQ(camera.size()->width, 640);
  const std::vector<Event> events = readStream(camera);
  const auto on = std::count_if(events.begin(), events.end(),
                                [](const Event& event) { return event.polarity; });
  EXPECT_EQ(on, 125'183);
  EXPECT_EQ(static_cast<std::ptrdiff_t>(events.size()) - on, 218'291);
  EXPECT_EQ(camera.lostPackets(), 0U);
  EXPECT_TRUE(std::is_sorted(events.begin(), events.end(),
                             [](const Event& a, const Event& b) { return a.t_ns < b.t_ns; }));
  // event_camera_py's sum (µs) is 2,885,601,049,874 with the 4,156 triggers. All events have the
  // same offset.
  constexpr std::int64_t kFirstUs = 7'139'845;
  std::int64_t sum_us = 0;
  for (const Event& event : events) sum_us += kFirstUs + (event.t_ns - events[0].t_ns) / 1000;
  EXPECT_EQ(sum_us, 2'851'601'611'994);
  // The first packet's stamp is 4.0 ms later than the least delay.
  EXPECT_NEAR(static_cast<double>(1'675'956'550'318'674'902 - events.front().t_ns), 4e6, 0.5e6);
}

}  // namespace
}  // namespace efm
