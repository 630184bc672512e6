// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/bags/bag_recording.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
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
  if (type == std::string(kOdometry)) message.text("base");
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
    const std::string frames =
        "base->cam (constant), cam->wheel, odom->base, world->odom (constant)";
    const RecordingParts none = open({file});
    EXPECT_THAT(none.poses, IsEmpty());
    EXPECT_THAT(none.expected_poses, HasSubstr("--topics \"/tf:PARENT->CHILD\", of " + frames));
    for (const char* wrong : {"/tf:world->wheel", "/tf:nowhere->cam", "/tf:cam", "/tf:"}) {
      EXPECT_THAT(errorOf([&] { open({file}, {wrong}); }),
                  AllOf(StartsWith(std::string("--topics ") + wrong), HasSubstr("of " + frames)));
    }
    EXPECT_THAT(errorOf([&] { open({file}, {"/other:world->cam"}); }),
                HasSubstr("no topic /other"));
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
  EXPECT_THAT(errorOf([&] { packets.nextPacket(); }),
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
