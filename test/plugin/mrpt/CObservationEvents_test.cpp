// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <mrpt/opengl/CPointCloudColoured.h>
#include <mrpt/opengl/CSetOfLines.h>
#include <mrpt/opengl/CSetOfObjects.h>
#include <rapidcheck/gtest.h>

#include <limits>

#include "mapping/geometry/timestamp.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/mrpt/event_encoding.h"
#include "plugin/mrpt/pose_observation.h"
#include "test/plugin/mrpt/observations.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kTodayNs = 1'700'000'000'123'456'789;

std::string errorOfReading(const Bytes& bytes) {
  return messageOf([&] { objectFrom<CObservationEvents>(bytes); });
}

CObservationEvents examplePacket() {
  CObservationEvents packet;
  packet.sensorLabel = "cam1";
  packet.timestamp = mrptTimeFrom(kTodayNs);
  packet.camera_index = 1;
  packet.camera = {346, 260, 226.5, 226.25, 173, 130, DistortionModel::kRadtan, {.1, .2, .3, .4}};
  packet.time_offset_ns = -2'500'000;
  packet.camera_pose = mrpt::poses::CPose3D(0.1, 0.2, 0.3, 0.4, 0.5, 0.6);
  packet.covered_until_ns = kTodayNs + 10'000'000;
  for (int i = 0; i < 100; ++i) {
    packet.events.push_back({kTodayNs + 1000 * i * i, static_cast<std::uint16_t>(3 * i),
                             static_cast<std::uint16_t>(2 * i), i % 3 == 0});
  }
  return packet;
}

void expectSame(const CObservationEvents& a, const CObservationEvents& b) {
  EXPECT_EQ(a.sensorLabel, b.sensorLabel);
  EXPECT_EQ(a.timestamp, b.timestamp);
  EXPECT_EQ(a.camera_index, b.camera_index);
  EXPECT_EQ(a.camera, b.camera);
  EXPECT_EQ(a.time_offset_ns, b.time_offset_ns);
  EXPECT_EQ(a.covered_until_ns, b.covered_until_ns);
  EXPECT_TRUE(a.events == b.events);
  const Rigid3 apart = rigidFrom(a.camera_pose).inverse() * rigidFrom(b.camera_pose);
  EXPECT_LT(apart.translation.norm(), 1e-15);
  EXPECT_LT(apart.rotation.vec().norm(), 1e-14);
}

TEST(CObservationEvents, IsTheSameAfterAnArchive) {
  CObservationEvents packet = examplePacket();
  for (const EventCompression compression : {EventCompression::kNone, EventCompression::kZstd}) {
    packet.compression = compression;
    expectSame(*objectFrom<CObservationEvents>(bytesOf(packet)), packet);
    std::swap(packet.events[3], packet.events[70]);  // the order of the events is kept
  }
  CObservationEvents empty;
  empty.timestamp = mrptTimeFrom(0);
  expectSame(*objectFrom<CObservationEvents>(bytesOf(empty)), empty);
}

/// Generates times of real recordings and any other times.
rc::Gen<std::int64_t> someTime() {
  return rc::gen::oneOf(rc::gen::inRange<std::int64_t>(kTodayNs, kTodayNs + 10'000'000),
                        rc::gen::map(rc::gen::inRange<std::int64_t>(0, 10'000),
                                     [](std::int64_t us) { return kTodayNs + 1000 * us; }),
                        rc::gen::arbitrary<std::int64_t>(),
                        rc::gen::element(std::numeric_limits<std::int64_t>::min(),
                                         std::numeric_limits<std::int64_t>::max()));
}

rc::Gen<std::vector<Event>> someEvents() {
  return rc::gen::container<std::vector<Event>>(
      rc::gen::build<Event>(rc::gen::set(&Event::t_ns, someTime()), rc::gen::set(&Event::x),
                            rc::gen::set(&Event::y), rc::gen::set(&Event::polarity)));
}

RC_GTEST_PROP(EventEncoding, AnyEventsAreTheSameAfterEncoding, ()) {
  const std::vector<Event> events = *someEvents();
  const auto compression = *rc::gen::element(EventCompression::kNone, EventCompression::kZstd);
  RC_ASSERT(decodeEvents(encodeEvents(events, compression), events.size()) == events);
}

RC_GTEST_PROP(EventEncoding, AnyBytesAreEventsOrAnError, ()) {
  auto bytes = *rc::gen::arbitrary<Bytes>();
  if (*rc::gen::arbitrary<bool>()) bytes.insert(bytes.begin(), {1, 1});  // a valid header
  const auto count =
      *rc::gen::oneOf(rc::gen::inRange<std::size_t>(0, 20), rc::gen::arbitrary<std::size_t>());
  try {
    RC_ASSERT(decodeEvents(bytes, count).size() == count);
  } catch (const std::runtime_error&) {
    RC_SUCCEED("an error");
  }
}

TEST(EventEncoding, AShortStepOfWholeMicrosecondsTakesAByte) {
  std::vector<Event> events;
  events.reserve(80);
  for (int i = 0; i < 80; ++i) events.push_back({kTodayNs + 63'000 * i, 0, 0, false});
  // bytes of encoding, tick and first time; steps; columns; polarities
  EXPECT_EQ(encodeEvents(events).size(), 10 + 79 + 4 * 80 + 10);
  EXPECT_LT(encodeEvents(events, EventCompression::kZstd).size(), 60U) << "the same ones";
}

// --- Damage ------------------------------------------------------------------------------------

TEST(CObservationEvents, AnyChangedByteIsAnErrorOrChangesNothing) {
  const CObservationEvents packet = examplePacket();
  const Bytes bytes = bytesOf(packet);
  int errors = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    Bytes damaged = bytes;
    damaged[i] ^= 0x10;
    try {
      const auto read = objectFrom<CObservationEvents>(damaged);
      ASSERT_TRUE(read) << "byte " << i;
      expectSame(*read, packet);
    } catch (const std::exception&) {
      ++errors;
    }
  }
  // MRPT also finds a class if the namespace in its name is unknown.
  EXPECT_EQ(errors, static_cast<int>(bytes.size() - std::string("efm").size()));
}

/// Position of the content's size: after the length of the class's name, the name and the version.
constexpr std::size_t kSizeAt = 1 + sizeof("efm::CObservationEvents") - 1 + 1;

TEST(CObservationEvents, DamageIsAnErrorThatNamesThePacket) {
  const Bytes bytes = bytesOf(examplePacket());
  const auto with = [&](std::size_t at, std::uint8_t byte) {
    Bytes damaged = bytes;
    damaged[at] = byte;
    return errorOfReading(damaged);
  };
  const std::string damaged = "a packet of events is damaged: ";
  EXPECT_THAT(with(kSizeAt + 3, 0x3f), HasSubstr(damaged)) << "about 1 GB";
  EXPECT_THAT(with(kSizeAt + 3, 0xff), HasSubstr(damaged + "a size that cannot be"));
  EXPECT_THAT(with(kSizeAt - 1, 2),
              HasSubstr("events of version 2: this program reads versions 0 and 1"));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const Bytes cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_NE(errorOfReading(cut), "no error") << "cut to " << size << " bytes";
  }
}

// --- Description -------------------------------------------------------------------------------

TEST(CObservationEvents, IsDescribedByEventsTimesAndCamera) {
  const auto description = [](const CObservationEvents& packet) {
    std::ostringstream text;
    packet.getDescriptionAsText(text);
    return text.str();
  };
  const CObservationEvents packet = examplePacket();
  EXPECT_THAT(description(packet), HasSubstr("cam1"));
  EXPECT_THAT(
      description(packet),
      HasSubstr("Events of camera 1: 100\n"
                "From 1700000000.123456789 s to 1700000000.133257789 s, 34 of them brighter\n"
                "Everything before 1700000000.133456789 s is here by now\n"
                "Sensor: 346x260 pixels, fx 226.5 fy 226.25 cx 173 cy 130, distortion "
                "radtan 0.1 0.2 0.3 0.4\nPose on the rig: " +
                packet.camera_pose.asString()));
  CObservationEvents last;
  last.covered_until_ns = kEndOfTimeNs;
  EXPECT_THAT(description(last), HasSubstr("Events of camera 0: 0\nThe last packet of its camera\n"
                                           "Sensor: "));
  mrpt::poses::CPose3D pose;
  packet.getSensorPose(pose);
  EXPECT_EQ(pose, packet.camera_pose);
  last.setSensorPose(pose);
  EXPECT_EQ(last.camera_pose, pose);
}

TEST(CObservationEvents, IsExportedAsALineWithItsEvents) {
  CObservationEvents packet;
  EXPECT_TRUE(packet.exportTxtSupported());
  EXPECT_EQ(packet.exportTxtDataRow(), "0");
  packet.events = {{kTodayNs, 5, 6, true}, {kTodayNs + 1000, 7, 8, false}};
  EXPECT_EQ(packet.exportTxtDataRow(), "2 1700000000.123456789 5 6 1 1700000000.123457789 7 8 0");
  EXPECT_THAT(packet.exportTxtHeader(), HasSubstr("TIME_S X Y POLARITY"));
}

using mrpt::opengl::CPointCloudColoured;
using mrpt::opengl::CSetOfObjects;

/// Returns a packet of 240 x 180 pixels, f = 200 and 150: a line of brighter events on the left, a
/// line of darker events on the right.
CObservationEvents twoLines() {
  CObservationEvents packet;
  packet.camera = {240, 180, 200, 150, 119.5, 89.5, DistortionModel::kNone, {}};
  for (std::uint16_t y = 20; y < 160; ++y) {
    packet.events.push_back({1000 * y, 40, y, true});
    packet.events.push_back({1000 * y, 200, y, false});
  }
  return packet;
}

CPointCloudColoured::Ptr pointsOf(const CObservationEvents& packet) {
  const auto camera = packet.getVisualization()->getByClass<CSetOfObjects>();
  return camera->getByClass<CPointCloudColoured>();
}

TEST(EventDrawing, AnEventIsAPointOnTheImagePlaneOfItsCameraInTheColourOfItsPolarity) {
  CObservationEvents packet = twoLines();
  packet.camera_pose = mrpt::poses::CPose3D(1, 2, 3, 0.1, 0.2, 0.3);
  for (const bool calibrated : {true, false}) {  // otherwise the width is the focal length
    if (!calibrated) packet.camera = {240, 180, 0, 0, 0, 0, DistortionModel::kNone, {}};
    const double fx = calibrated ? 200 : 240;
    const double fy = calibrated ? 150 : 240;
    const auto points = pointsOf(packet);
    ASSERT_EQ(points->size(), packet.events.size());
    EXPECT_NEAR(points->getPoint3Df(0).x, (40 - 119.5) / fx * kDrawnPlaneM, 1e-6);
    EXPECT_NEAR(points->getPoint3Df(0).y, (20 - 89.5) / fy * kDrawnPlaneM, 1e-6);
    EXPECT_EQ(points->getPoint3Df(0).z, kDrawnPlaneM);
    for (const int i : {0, 1}) {
      EXPECT_EQ(points->getPointColor(i).R, i == 0 ? 220 : 0);
      EXPECT_EQ(points->getPointColor(i).G, 0);
      EXPECT_EQ(points->getPointColor(i).B, i == 0 ? 0 : 220);
    }
    // Lines go from the camera to each corner of the image, and around the image.
    const auto camera = packet.getVisualization()->getByClass<CSetOfObjects>();
    EXPECT_LT(mrpt::poses::CPose3D(camera->getPose()).distanceTo(packet.camera_pose), 1e-6);
    EXPECT_NEAR(camera->getPose().yaw, 0.1, 1e-6);
    const auto lines = camera->getByClass<mrpt::opengl::CSetOfLines>();
    const std::vector<mrpt::math::TSegment3D> segments(lines->begin(), lines->end());
    ASSERT_EQ(segments.size(), 8U);
    const double x_m = 120 / fx * kDrawnPlaneM;
    const double y_m = 90 / fy * kDrawnPlaneM;
    const mrpt::math::TPoint3D corners[] = {{-x_m, -y_m, kDrawnPlaneM},
                                            {x_m, -y_m, kDrawnPlaneM},
                                            {x_m, y_m, kDrawnPlaneM},
                                            {-x_m, y_m, kDrawnPlaneM}};
    for (std::size_t i = 0; i < 4; ++i) {
      const auto& ray = segments[2 * i];
      const auto& edge = segments[2 * i + 1];
      EXPECT_EQ(ray.point1, mrpt::math::TPoint3D(0, 0, 0));
      EXPECT_LT((ray.point2 - corners[i]).norm(), 1e-6) << i;
      EXPECT_LT((edge.point1 - corners[i]).norm(), 1e-6) << i;
      EXPECT_LT((edge.point2 - corners[(i + 1) % 4]).norm(), 1e-6) << i;
    }
  }
  packet.events.clear();
  EXPECT_EQ(pointsOf(packet)->size(), 0U);
}

TEST(EventDrawing, OfALargePacketAnEvenSelectionOfEventsIsDrawn) {
  CObservationEvents packet = twoLines();
  packet.events.assign(3 * kMaxDrawnEvents, {0, 10, 10, true});
  for (std::size_t i = 0; i < packet.events.size(); i += 3) packet.events[i].polarity = false;
  const auto points = pointsOf(packet);
  ASSERT_EQ(points->size(), kMaxDrawnEvents);
  for (std::size_t i = 0; i < points->size(); ++i) ASSERT_EQ(points->getPointColor(i).B, 220) << i;
}

}  // namespace

}  // namespace efm
