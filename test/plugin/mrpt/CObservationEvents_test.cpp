// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/CObservationEvents.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/serialization/CArchive.h>
#include <mrpt/serialization/archiveFrom_std_vector.h>
#include <rapidcheck/gtest.h>

#include <limits>

#include "mapping/geometry/timestamp.h"
#include "plugin/mrpt/event_encoding.h"
#include "plugin/mrpt/mrpt_pose.h"
#include "plugin/mrpt/mrpt_time.h"
#include "plugin/mrpt/registration.h"

namespace efm {
namespace {

using testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

constexpr std::int64_t kTodayNs = 1'700'000'000'123'456'789;

Bytes bytesOf(const CObservationEvents& packet) {
  Bytes bytes;
  auto archive = mrpt::serialization::archiveFrom(bytes);
  archive << packet;
  return bytes;
}

/// By its class's name, as from a rawlog.
CObservationEvents::Ptr packetFrom(const Bytes& bytes) {
  registerClasses();
  auto archive = mrpt::serialization::archiveFrom(bytes);
  return std::dynamic_pointer_cast<CObservationEvents>(archive.ReadObject());
}

std::string errorOfReading(const Bytes& bytes) {
  try {
    packetFrom(bytes);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no error";
}

CObservationEvents examplePacket() {
  CObservationEvents packet;
  packet.sensorLabel = "cam1";
  packet.timestamp = mrptTimeFrom(kTodayNs);
  packet.camera_index = 1;
  packet.camera = {346, 260, 226.5, 226.25, 173, 130, DistortionModel::kRadtan, {.1, .2, .3, .4}};
  Rigid3 T_rig_cam;
  T_rig_cam.translation = {0.1, 0, 0};
  packet.camera_pose = mrptPoseFrom(T_rig_cam);
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
  EXPECT_EQ(a.covered_until_ns, b.covered_until_ns);
  EXPECT_TRUE(a.events == b.events);
  const Rigid3 apart = rigidFrom(a.camera_pose).inverse() * rigidFrom(b.camera_pose);
  EXPECT_LT(apart.translation.norm(), 1e-15);
  EXPECT_LT(apart.rotation.vec().norm(), 1e-14);
}

TEST(CObservationEvents, IsTheSameAfterAnArchive) {
  const CObservationEvents packet = examplePacket();
  expectSame(*packetFrom(bytesOf(packet)), packet);
}

TEST(CObservationEvents, WithoutEventsCalibrationOrCoverageIsTheSameAfterAnArchive) {
  CObservationEvents packet;
  packet.timestamp = mrptTimeFrom(0);
  expectSame(*packetFrom(bytesOf(packet)), packet);
}

TEST(CObservationEvents, KeepsTheOrderOfItsEventsInAnArchive) {
  CObservationEvents packet = examplePacket();
  std::swap(packet.events[3], packet.events[70]);
  expectSame(*packetFrom(bytesOf(packet)), packet);
}

/// Times as recordings have them, and any others.
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

RC_GTEST_PROP(CObservationEvents, AnyEventsAreTheSameAfterAnArchive, ()) {
  CObservationEvents packet = examplePacket();
  packet.events = *someEvents();
  RC_ASSERT(packetFrom(bytesOf(packet))->events == packet.events);
}

RC_GTEST_PROP(EventEncoding, AnyEventsAreTheSameAfterEncoding, ()) {
  const std::vector<Event> events = *someEvents();
  RC_ASSERT(decodeEvents(encodeEvents(events), events.size()) == events);
}

RC_GTEST_PROP(EventEncoding, AnyBytesAreEventsOrAnError, ()) {
  auto bytes = *rc::gen::arbitrary<Bytes>();
  if (*rc::gen::arbitrary<bool>()) bytes.insert(bytes.begin(), {1, 1});  // a header that is right
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
  // encoding, tick, first time; steps; columns; polarities
  EXPECT_EQ(encodeEvents(events).size(), 10 + 79 + 4 * 80 + 10);
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
      const auto read = packetFrom(damaged);
      ASSERT_TRUE(read) << "byte " << i;
      expectSame(*read, packet);
    } catch (const std::exception&) {
      ++errors;
    }
  }
  // MRPT also finds a class whose namespace it does not know.
  EXPECT_EQ(errors, static_cast<int>(bytes.size() - std::string("efm").size()));
}

TEST(CObservationEvents, TruncatedAnywhereIsAnError) {
  const Bytes bytes = bytesOf(examplePacket());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_NE(errorOfReading(Bytes(bytes.begin(), bytes.begin() + static_cast<long>(size))),
              "no error")
        << "cut to " << size << " bytes";
  }
}

/// Where the content's size stands: behind the length of the class's name, the name, the version.
constexpr std::size_t kSizeAt = 1 + sizeof("efm::CObservationEvents") - 1 + 1;

TEST(CObservationEvents, DamageIsAnErrorThatNamesThePacket) {
  Bytes bytes = bytesOf(examplePacket());
  bytes[bytes.size() / 2] ^= 1;
  EXPECT_THAT(errorOfReading(bytes), HasSubstr("a packet of events is damaged: its checksum"));
}

TEST(CObservationEvents, AWrongSizeReservesNoMemory) {
  Bytes bytes = bytesOf(examplePacket());
  bytes[kSizeAt + 3] = 0x3f;  // about 1 GB
  EXPECT_THAT(errorOfReading(bytes), HasSubstr("a packet of events is damaged"));
  bytes[kSizeAt + 3] = 0xff;
  EXPECT_THAT(errorOfReading(bytes), HasSubstr("a size that cannot be"));
}

TEST(CObservationEvents, AnUnknownVersionIsAnErrorThatNamesIt) {
  Bytes bytes = bytesOf(examplePacket());
  bytes[kSizeAt - 1] = 7;
  EXPECT_THAT(errorOfReading(bytes), HasSubstr("version 7"));
}

// --- Description -------------------------------------------------------------------------------

TEST(CObservationEvents, IsDescribedByEventsTimesAndCamera) {
  std::ostringstream text;
  examplePacket().getDescriptionAsText(text);
  EXPECT_THAT(text.str(), HasSubstr("cam1"));
  EXPECT_THAT(text.str(), HasSubstr("Events of camera 1: 100"));
  EXPECT_THAT(text.str(), HasSubstr("1700000000.123456789 s to 1700000000.133257789 s"));
  EXPECT_THAT(text.str(), HasSubstr("346x260 pixels"));
  EXPECT_THAT(text.str(), HasSubstr("radtan 0.1 0.2 0.3 0.4"));
  EXPECT_THAT(text.str(), HasSubstr("Everything before 1700000000.133456789 s is here by now"));
}

TEST(CObservationEvents, IsDescribedWithoutEvents) {
  CObservationEvents packet;
  packet.covered_until_ns = kEndOfTimeNs;
  std::ostringstream text;
  packet.getDescriptionAsText(text);
  EXPECT_THAT(text.str(), HasSubstr("Events of camera 0: 0\nThe last packet of its camera\n"));
}

TEST(CObservationEvents, IsExportedAsALineWithItsEvents) {
  CObservationEvents packet;
  EXPECT_TRUE(packet.exportTxtSupported());
  EXPECT_EQ(packet.exportTxtDataRow(), "0");
  packet.events = {{kTodayNs, 5, 6, true}, {kTodayNs + 1000, 7, 8, false}};
  EXPECT_EQ(packet.exportTxtDataRow(), "2 1700000000.123456789 5 6 1 1700000000.123457789 7 8 0");
  EXPECT_THAT(packet.exportTxtHeader(), HasSubstr("TIME_S X Y POLARITY"));
}

TEST(CObservationEvents, HasTheCamerasPoseAsItsSensorPose) {
  CObservationEvents packet;
  packet.setSensorPose(mrpt::poses::CPose3D(1, 2, 3, 0, 0, 0));
  mrpt::poses::CPose3D pose;
  packet.getSensorPose(pose);
  EXPECT_EQ(pose, packet.camera_pose);
  EXPECT_EQ(pose.y(), 2);
}

}  // namespace
}  // namespace efm
