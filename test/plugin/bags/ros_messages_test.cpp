// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/bags/ros_messages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "plugin/bags/sensor_clock.h"
#include "test/plugin/bags/ros_message_bytes.h"
#include "test/plugin/formats/files.h"

namespace efm {
namespace {

using testing::HasSubstr;

constexpr RosBytes kKinds[] = {RosBytes::kRos1, RosBytes::kCdr, RosBytes::kCdrBigEndian};

const std::vector<Event> kEvents = {{1'700'000'000'123'456'789, 345, 259, true},
                                    {1'700'000'000'123'456'790, 0, 1, false},
                                    {1'700'000'001'000'000'000, 2, 3, true}};

BagMessage messageOf(const std::string& bytes, RosBytes kind) {
  return {0, reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(),
          kind != RosBytes::kRos1};
}

/// Calls `decode` for all lengths of a message. Each is an error or a result.
template <typename Decode>
void cutEverywhere(const std::string& bytes, RosBytes kind, const Decode& decode) {
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const std::string cut = bytes.substr(0, size);  // of its own, for the sanitizer
    EXPECT_THAT(errorOf([&] { decode(messageOf(cut, kind)); }), testing::Ne("")) << size;
  }
}

TEST(RosMessages, EventsAreTheSameInEachSerialisation) {
  for (const RosBytes kind : kKinds) {
    const std::string bytes = eventArray(kind, kEvents);
    std::vector<Event> events;
    const CameraSize size = decodeEventArray(messageOf(bytes, kind), events);
    EXPECT_EQ(events, kEvents);
    EXPECT_EQ(size.width, 346);
    EXPECT_EQ(size.height, 260);
    cutEverywhere(bytes, kind, [](const BagMessage& message) {
      std::vector<Event> few;
      decodeEventArray(message, few);
    });
  }
}

TEST(RosMessages, PacketsHaveTheirFieldsAndMonoEventsTheirExactTimes) {
  const std::int64_t base_ns = kEvents[0].t_ns - 1;
  for (const RosBytes kind : kKinds) {
    const std::string bytes =
        eventPacket(kind, 17, std::uint64_t{1} << 40, "mono", monoWords(kEvents, base_ns),
                    static_cast<std::uint64_t>(base_ns));
    const EventPacketMessage packet = decodeEventPacket(messageOf(bytes, kind));
    EXPECT_EQ(packet.stamp_ns, 17);
    EXPECT_EQ(packet.sequence, std::uint64_t{1} << 40);
    EXPECT_EQ(packet.encoding, "mono");
    EXPECT_EQ(packet.size.width, 640);
    std::vector<Event> events;
    decodeMonoEvents(packet, events);
    EXPECT_EQ(events, kEvents);
    cutEverywhere(bytes, kind, decodeEventPacket);
  }
}

TEST(RosMessages, PosesComeFromAllTypes) {
  const Rigid3 T = {Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5), {1.25, -2, 3}};
  struct Case {
    const char* name;
    bool child_frame;
    int more;  // numbers behind the pose
  };
  for (const Case& each : {Case{"geometry_msgs/PoseStamped", false, 0},
                           Case{"geometry_msgs/PoseWithCovarianceStamped", false, 36},
                           Case{"geometry_msgs/TransformStamped", true, 0},
                           Case{"nav_msgs/Odometry", true, 36 + 6 + 36}}) {
    const RosType type = rosTypeOf(each.name);
    ASSERT_TRUE(hasPoses(type)) << each.name;
    for (const RosBytes kind : kKinds) {
      RosMessage message(kind);
      message.header(1'700'000'000'000'000'001, "map");
      if (each.child_frame) message.text("base");
      message.pose(T).numbers(std::vector<double>(static_cast<std::size_t>(each.more)));
      const StampedPose pose = decodePose(messageOf(message.bytes(), kind), type);
      EXPECT_EQ(pose.t_ns, 1'700'000'000'000'000'001);
      EXPECT_TRUE(isSame(pose.T_world_rig, T)) << each.name;
    }
  }
}

TEST(RosMessages, CameraInfoGivesTheModel) {
  struct Case {
    const char* name;
    std::vector<double> D;
    DistortionModel model;
  };
  for (const Case& each :
       {Case{"plumb_bob", {0.1, 0.2, 0.3, 0.4, 0}, DistortionModel::kRadtan},
        Case{"plumb_bob", {}, DistortionModel::kNone}, Case{"", {}, DistortionModel::kNone},
        Case{"rational_polynomial", std::vector<double>(8), DistortionModel::kNone},
        Case{"equidistant", {0, 0, 0, 0}, DistortionModel::kEquidistant},
        Case{"fisheye", {0.1, 0, 0, 0}, DistortionModel::kEquidistant}}) {
    for (const RosBytes kind : kKinds) {
      const std::string bytes = cameraInfo(kind, each.name, each.D);
      const CameraModel model = decodeCameraInfo(messageOf(bytes, kind));
      EXPECT_EQ(model.distortion, each.model) << each.name;
      EXPECT_EQ(model.coefficients.size(),
                each.model == DistortionModel::kNone ? 0 : each.D.size());
      EXPECT_EQ(model.fx, 226.5);
      EXPECT_EQ(model.fy, 227.5);
      EXPECT_EQ(model.cx, 173);
      EXPECT_EQ(model.cy, 130);
      EXPECT_EQ(model.width, 346);
      EXPECT_EQ(model.height, 260);
    }
  }
}

TEST(RosMessages, WrongValuesAreErrors) {
  const auto ros1 = [](const RosMessage& message) { return message.bytes(); };
  std::vector<Event> events;
  const auto array = [&](const std::string& bytes) {
    decodeEventArray(messageOf(bytes, RosBytes::kRos1), events);
  };
  const auto packet = [&](const std::string& bytes) {
    decodeMonoEvents(decodeEventPacket(messageOf(bytes, RosBytes::kRos1)), events);
  };
  const auto pose = [](const std::string& bytes) {
    decodePose(messageOf(bytes, RosBytes::kRos1), RosType::kPose);
  };
  const auto cdr = [&](const std::string& bytes) {
    decodeEventArray(messageOf(bytes, RosBytes::kCdr), events);
  };
  const auto info = [](const std::string& bytes) {
    decodeCameraInfo(messageOf(bytes, RosBytes::kRos1));
  };
  const auto header = [] { return RosMessage(RosBytes::kRos1).header(1); };
  struct Case {
    std::function<void(const std::string&)> decode;
    std::string bytes;
    const char* expected;
  };
  for (const Case& wrong : std::vector<Case>{
           {array, ros1(header().u32(1).u32(1).u32(0xffff'ffff)), "4294967295 events in 0 bytes"},
           {array, ros1(header().u32(70'000).u32(1).u32(0)), "height = 70000: expected 0 to 65535"},
           {packet, eventPacket(RosBytes::kRos1, 1, 0, "mono", "12345"),
            "expected a multiple of 8"},
           {packet, eventPacket(RosBytes::kRos1, 1, 0, "mono", "", ~std::uint64_t{0}), "time_base"},
           {packet, ros1(header().u32(1).u32(1).add(0.0).add(0.0).text("evt3").u8(1)),
            "is_bigendian = 1"},
           {pose, ros1(header().numbers({0, 0, NAN, 0, 0, 0, 1})), "position = nan"},
           {pose, ros1(header().numbers({0, 0, 0, 0, 0, 0, 0})), "orientation of length 0"},
           {cdr, std::string("\0\7\0\0", 4), "CDR header = 0 7"},
           {info, cameraInfo(RosBytes::kRos1, "rational_polynomial", {1, 0, 0, 0, 0, 0, 0, 0}),
            "distortion_model = 'rational_polynomial': expected plumb_bob"},
           {info, ros1(header().u32(1).u32(1).text("").u32(99)), "99 distortion coefficients"}}) {
    EXPECT_THAT(errorOf([&] { wrong.decode(wrong.bytes); }), HasSubstr(wrong.expected));
  }
}

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kWrapNs = 16'777'216'000;
constexpr std::int64_t kUnixNs = 1'700'000'000'000'000'000;

TEST(SensorClock, TheLeastDelayIsTheOffsetForTheWholeRecording) {
  SensorClock clock(kWrapNs);
  clock.observe(kUnixNs + 4 * kMs, 0);
  clock.observe(kUnixNs + 10 * kMs, 10 * kMs);
  clock.observe(kUnixNs + 22 * kMs, 20 * kMs);
  EXPECT_EQ(clock.shiftFor(kUnixNs + 4 * kMs, 0), kUnixNs);
  EXPECT_EQ(clock.shiftFor(kUnixNs + 900 * kMs, 800 * kMs), kUnixNs) << "however late the host is";
  EXPECT_EQ(clock.shiftFor(kUnixNs + 3 * kWrapNs + 5 * kMs, 5 * kMs), kUnixNs + 3 * kWrapNs);
  EXPECT_EQ(clock.shiftFor(kUnixNs - kWrapNs + 5 * kMs, 5 * kMs), kUnixNs - kWrapNs);
  EXPECT_THAT(errorOf([&] { clock.shiftFor(kUnixNs + 5'000 * kMs, 0); }),
              HasSubstr("5.000000000 s from the sensor's clock"));
}

TEST(SensorClock, SynchronisedCamerasShareAnOffset) {
  SensorClock first(kWrapNs);
  first.observe(kUnixNs, 0);
  for (const auto& [difference_ns, shared] :
       {std::make_pair(3 * kMs, true), std::make_pair(2 * kWrapNs - 3 * kMs, true),
        std::make_pair(11 * kMs, false), std::make_pair(5'000 * kMs, false)}) {
    SensorClock second(kWrapNs);
    second.observe(kUnixNs + difference_ns, 0);
    EXPECT_EQ(second.share(first, 10 * kMs), shared);
    const std::int64_t shift_ns = second.shiftFor(kUnixNs + difference_ns, 0);
    EXPECT_EQ((shift_ns - kUnixNs) % kWrapNs == 0, shared) << shift_ns - kUnixNs;
  }
}

}  // namespace
}  // namespace efm
