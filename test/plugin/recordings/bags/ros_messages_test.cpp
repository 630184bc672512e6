// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/bags/ros_messages.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <string>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/bags/bag_events.h"
#include "test/plugin/recordings/bags/ros_message_bytes.h"
#include "test/plugin/temporary_folder.h"

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

/// Calls `decode` for every shorter length of a message. Each call must throw.
template <typename Decode>
void cutEverywhere(const std::string& bytes, RosBytes kind, const Decode& decode) {
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const std::string cut = bytes.substr(0, size);  // a separate copy, for the sanitizer
    EXPECT_NE(errorOf([&] { decode(messageOf(cut, kind)); }), "no error") << size;
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

constexpr std::int64_t kBaseNs = 1'700'000'000'123'456'789;
constexpr std::int64_t kBaseUsNs = 1'700'000'000'123'456'000;  // libcaer_cmp stores whole µs
constexpr std::int64_t kUsNs = 1'000;

/// Returns the error that ends the decoding of a packet. `events` has the events before it.
std::string decoded(const std::string& encoding, const std::string& data, std::uint64_t time_base,
                    std::vector<Event>& events) {
  const std::string bytes = eventPacket(RosBytes::kCdr, 17, 0, encoding, data, time_base);
  const auto decode = encoding == "libcaer" ? decodeLibcaerEvents : decodeLibcaerCmpEvents;
  return errorOf([&] { decode(decodeEventPacket(messageOf(bytes, RosBytes::kCdr)), events); });
}

// The words are written by hand from the definition of the encodings.
TEST(RosMessages, LibcaerWordsAreDecodedUpToAWrongOne) {
  const auto libcaer = [](std::initializer_list<std::pair<std::uint32_t, std::int32_t>> words) {
    std::string bytes;
    for (const auto& [address, t_us] : words) {
      putWord(bytes, address);
      putWord(bytes, static_cast<std::uint32_t>(t_us));
    }
    return bytes;
  };
  const auto from = [](std::int64_t base_ns) {
    return [=](std::int64_t t_us, int x, int y, bool polarity) {
      return Event{base_ns + t_us * kUsNs, static_cast<std::uint16_t>(x),
                   static_cast<std::uint16_t>(y), polarity};
    };
  };
  const auto at = from(kBaseNs);
  const auto cmp_at = from(kBaseUsNs);
  constexpr std::int32_t kLastUs = 0x7fff'ffff;
  constexpr std::int64_t kWrapUs = std::int64_t{1} << 31;
  const std::string whole = libcaer({{0x0006'000b, 5}});  // x 3, y 2, polarity on, valid
  struct Case {
    const char* encoding;
    std::string data;
    std::vector<Event> events;
    std::string error = "no error";
  };
  for (const Case& each : std::vector<Case>{
           {"libcaer",
            libcaer({{0xffff'fffe, 7}, {0xfffe'0000, 7}, {0x0001'fffc, 8}, {0x0000'0003, 6}}),
            {at(7, 32'767, 32'767, true), at(7, 32'767, 0, false), at(8, 0, 32'767, false),
             at(6, 0, 0, true)}},  // 1 µs late
           // The time wraps twice.
           {"libcaer",
            libcaer({{0x0002'0004, kLastUs}, {0x0004'0008, 0}, {0, kLastUs}, {0, 3}}),
            {at(kLastUs, 1, 1, false), at(kWrapUs, 2, 2, false), at(kWrapUs + kLastUs, 0, 0, false),
             at(2 * kWrapUs + 3, 0, 0, false)}},
           {"libcaer",
            whole + whole.substr(0, 7),
            {at(5, 3, 2, true)},
            "15 bytes of libcaer events: expected a multiple of 8"},
           {"libcaer",
            whole + libcaer({{0, -4}}),
            {at(5, 3, 2, true)},
            "libcaer events: word 1: t = -4 µs: expected 0 or more"},
           {"libcaer_cmp",
            evt3Words({0x3805, 0x1fff, 0x3006, 0x0fff, 0x27ff, 0x3fff, 0x1001, 0x3000}),
            {cmp_at(0, 0, 5, true), cmp_at(0xfff, 0, 6, false), cmp_at(0xff'ffff, 2047, 2047, true),
             cmp_at(0xff'f001, 2047, 0, false)}},
           // A vector without a row is in row 0 with polarity off. The next is 8 rows below.
           {"libcaer_cmp",
            evt3Words(
                {0x2009, 0x5081, 0x5f01, 0x3803, 0x5004, 0x4864, 0x2003, 0x5003, 0x5000, 0x5080}),
            {cmp_at(0, 9, 0, false), cmp_at(0, 9, 7, false), cmp_at(0, 9, 8, false),
             cmp_at(0, 9, 3, true), cmp_at(0, 9, 18, false), cmp_at(0, 3, 100, true),
             cmp_at(0, 3, 101, true), cmp_at(0, 3, 123, true)}},
           {"libcaer_cmp",
            evt3Words({0x3001, 0x6001, 0x3002}),
            {cmp_at(0, 0, 1, false)},
            "libcaer_cmp events: word 1: code 6: expected 0 to 5"},
           {"libcaer_cmp",
            evt3Words({0x3001}) + "\x02",
            {cmp_at(0, 0, 1, false)},
            "3 bytes of libcaer_cmp events: expected a multiple of 2"}}) {
    std::vector<Event> events;
    EXPECT_EQ(decoded(each.encoding, each.data, kBaseNs, events), each.error);
    EXPECT_EQ(events, each.events) << each.encoding;
  }
}

TEST(RosMessages, ATimeBaseOrTimeBeyondTheEndOfTimeIsAnError) {
  std::vector<Event> events;
  const std::string late = libcaerWords({{0, 1, 2, true}, {2'000'000, 1, 2, true}}, 0);
  const auto end = static_cast<std::uint64_t>(kEndOfTimeNs);
  EXPECT_THAT(decoded("libcaer", late, end - 1, events), HasSubstr("word 1: t = "));
  EXPECT_EQ(events.size(), 1U);
  EXPECT_EQ(decoded("libcaer", late, end - 2'000'001, events), "no error");
  EXPECT_THAT(decoded("libcaer", late, end - 2'000'000, events),
              HasSubstr("word 1: t = 4611686018427387903: expected a time"));
  EXPECT_THAT(decoded("libcaer", late, end, events), HasSubstr("time_base = "));
  EXPECT_THAT(decoded("libcaer_cmp", "", end, events), HasSubstr("time_base = "));
}

// Rows must not wrap: damaged data would then give events in valid rows.
TEST(RosMessages, RowsOfVectorsDoNotBeginAgain) {
  std::vector<Event> events;
  std::string data = evt3Words({0x47ff});
  for (int i = 0; i < 9'000; ++i) data += evt3Words({0x5001});
  EXPECT_EQ(decoded("libcaer_cmp", data, 0, events), "no error");
  ASSERT_EQ(events.size(), 9'000U);
  EXPECT_EQ(events[1].y, 2'055);
  EXPECT_TRUE(std::is_sorted(events.begin(), events.end(),
                             [](const Event& a, const Event& b) { return a.y < b.y; }));
}

TEST(RosMessages, PosesComeFromAllTypes) {
  const Rigid3 T = {Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5), {1.25, -2, 3}};
  struct Case {
    const char* name;
    bool child_frame;
    int more;  // numbers after the pose
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
      const StampedPose pose = decodePoses(messageOf(message.bytes(), kind), type).at(0);
      EXPECT_EQ(pose.t_ns, 1'700'000'000'000'000'001);
      EXPECT_TRUE(isSame(pose.T_world_rig, T)) << each.name;
    }
  }
}

TEST(RosMessages, PathsAndTransformsHaveManyPoses) {
  const Rigid3 T = {Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5), {1.25, -2, 3}};
  for (const RosBytes kind : kKinds) {
    RosMessage path(kind);
    path.header(9, "map").u32(2).header(1, "map").pose(T).header(2, "m").pose({});
    const auto poses = decodePoses(messageOf(path.bytes(), kind), rosTypeOf("nav_msgs/Path"));
    ASSERT_EQ(poses.size(), 2U);
    EXPECT_TRUE(poses[0].t_ns == 1 && isSame(poses[0].T_world_rig, T));
    EXPECT_TRUE(poses[1].t_ns == 2 && isSame(poses[1].T_world_rig, {}));

    RosMessage message(kind);  // a wrong transform between two right ones
    message.u32(3).header(1, "/map").text("base").pose(T).header(2, "m").text("odd");
    message.numbers(std::vector<double>(7)).header(3, "map").text("/base").pose(T);
    const auto transforms = decodeTransforms(messageOf(message.bytes(), kind));
    ASSERT_EQ(transforms.size(), 3U);
    for (const std::size_t i : {0, 2}) {
      EXPECT_EQ(transforms[i].parent + " " + transforms[i].child, "map base");
      EXPECT_TRUE(isSame(transformOf(transforms[i].numbers), T));
    }
    EXPECT_THAT(errorOf([&] { transformOf(transforms[1].numbers); }),
                HasSubstr("qx qy qz qw of length 0"));
    EXPECT_EQ(transforms[2].t_ns, 3);
  }
  EXPECT_EQ(rosTypeOf("tf2_msgs/TFMessage"), RosType::kTransforms);
  EXPECT_EQ(rosTypeOf("tf/tfMessage"), RosType::kTransforms);
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

TEST(RosMessages, CameraInfoOfAPartOfTheSensorGivesTheModelOfItsPixels) {
  for (const RosBytes kind : kKinds) {
    // binning_x, binning_y, x_offset, y_offset, height, width
    const CameraModel model =
        decodeCameraInfo(messageOf(cameraInfo(kind, "", {}, {2, 4, 100, 20, 200, 240}), kind));
    EXPECT_EQ(model.width, 120);
    EXPECT_EQ(model.height, 50);
    EXPECT_EQ(model.fx, 226.5 / 2);
    EXPECT_EQ(model.fy, 227.5 / 4);
    EXPECT_EQ(model.cx, (173 - 100 - 0.5) / 2);
    EXPECT_EQ(model.cy, (130 - 20 - 1.5) / 4);
    EXPECT_THAT(
        errorOf([&] {
          decodeCameraInfo(messageOf(cameraInfo(kind, "", {}, {0, 0, 200, 0, 0, 240}), kind));
        }),
        HasSubstr("240 pixels from 200 on"));
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
    decodePoses(messageOf(bytes, RosBytes::kRos1), RosType::kPose);
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
           {pose, ros1(header().numbers({0, 0, 0, 0, 0, 0, 0})), "qx qy qz qw of length 0"},
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
  for (const std::int64_t late_ns :
       {1'000 * kMs, kWrapNs - 1'000 * kMs, -2 * kWrapNs - 1'000 * kMs}) {
    EXPECT_EQ((clock.shiftFor(kUnixNs + late_ns, 0) - kUnixNs) % kWrapNs, 0) << late_ns;
  }
  EXPECT_THAT(errorOf([&] { clock.shiftFor(kUnixNs + 1'000 * kMs + 1, 0); }),
              HasSubstr("1.000000001 s from the sensor's clock"));
  EXPECT_THAT(errorOf([&] { clock.shiftFor(kUnixNs - 1'000 * kMs - 1, 0); }),
              HasSubstr("-1.000000001 s from the sensor's clock"));
}

TEST(SensorClock, SynchronisedCamerasShareAnOffset) {
  SensorClock first(kWrapNs);
  first.observe(kUnixNs, 0);
  EXPECT_FALSE(SensorClock(kWrapNs).share(first, 10 * kMs)) << "it was not observed";
  EXPECT_FALSE(SensorClock(first).share(SensorClock(kWrapNs), 10 * kMs));
  for (const auto& [difference_ns, shared] : {std::pair(3 * kMs, true),
                                              {2 * kWrapNs - 3 * kMs, true},
                                              {10 * kMs, true},
                                              {-10 * kMs, true},
                                              {-3 * kWrapNs - 10 * kMs, true},
                                              {10 * kMs + 1, false},
                                              {-10 * kMs - 1, false},
                                              {5'000 * kMs, false}}) {
    SensorClock other_wrap(kWrapNs * 2);
    other_wrap.observe(kUnixNs + difference_ns, 0);
    EXPECT_FALSE(other_wrap.share(first, 10 * kMs));
    SensorClock second(kWrapNs);
    second.observe(kUnixNs + difference_ns, 0);
    EXPECT_EQ(second.share(first, 10 * kMs), shared);
    const std::int64_t shift_ns = second.shiftFor(kUnixNs + difference_ns, 0);
    EXPECT_EQ((shift_ns - kUnixNs) % kWrapNs == 0, shared) << shift_ns - kUnixNs;
  }
}

}  // namespace
}  // namespace efm
