// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CActionRobotMovement3D.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CObservationGPS.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CRawlog.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/serialization/CArchive.h>

#include <cstring>

#include "plugin/mrpt/CEventFusionMapBuilder.h"
#include "plugin/mrpt/pose_observation.h"
#include "plugin/mrpt/registration.h"
#include "plugin/recordings/open/rawlog.h"
#include "test/plugin/mrpt/observations.h"
#include "test/plugin/program_test.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using mrpt::obs::CObservation;
using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;
using Observations = std::vector<CObservation::Ptr>;

/// The observations of a recording and its error, if there is one.
struct Delivery {
  Observations observations;
  std::string error;
  std::string again;  // the next error
};

Delivery read(const std::filesystem::path& file) {
  Delivery delivery;
  RawlogRecording recording(file);
  double progress = 0;
  try {
    while (auto observation = recording.next()) {
      delivery.observations.push_back(observation);
      EXPECT_GE(recording.progress(), progress);
      progress = recording.progress();
    }
    EXPECT_EQ(progress, 1);
  } catch (const std::exception& error) {
    delivery.error = error.what();
    delivery.again = messageOf([&] { recording.next(); });
  }
  return delivery;
}

void expectSame(const CObservation& a, const CObservation& b) {
  EXPECT_EQ(a.GetRuntimeClass(), b.GetRuntimeClass());
  EXPECT_EQ(a.sensorLabel, b.sensorLabel);
  EXPECT_EQ(a.timestamp, b.timestamp);
  if (const auto* events = dynamic_cast<const CObservationEvents*>(&a)) {
    EXPECT_TRUE(events->events == dynamic_cast<const CObservationEvents&>(b).events);
  }
}

void expectBeginningOf(const Observations& all, const Observations& some) {
  ASSERT_LE(some.size(), all.size());
  for (std::size_t i = 0; i < some.size(); ++i) expectSame(*all[i], *some[i]);
}

/// One line without MRPT's decoration.
testing::Matcher<std::string> isPlain() {
  return AllOf(Not(HasSubstr("xception")), Not(HasSubstr("Location")), Not(HasSubstr("Message")),
               Not(HasSubstr("\n")), Not(EndsWith("unreadable")));
}

class Rawlog : public TemporaryFolder {
 protected:
  Rawlog() { registerClasses(); }

  std::filesystem::path file() const { return folder() / "r.rawlog"; }

  void write(const Observations& observations) const {
    RawlogWriter writer(file());
    for (const auto& observation : observations) writer.write(*observation);
    writer.close();
  }

  void writeBytes(const std::string& bytes) const { writeFile(file(), bytes); }

  /// The uncompressed content.
  std::string plainContent() const {
    GzInputStream stream(file());
    std::string plain;
    char byte = 0;
    while (stream.Read(&byte, 1) == 1) plain += byte;
    return plain;
  }

  /// Any objects, as other programs may store them.
  template <typename... Objects>
  void writeObjects(const Objects&... objects) const {
    GzOutputStream stream(file());
    auto archive = mrpt::serialization::archiveFrom<mrpt::io::CStream>(stream);
    (archive << ... << objects);
    stream.close();
  }

  const Observations recorded = observationsOf(SyntheticRecording(0.2));
};

TEST_F(Rawlog, IsReadByMrptAndBackAlsoWithoutCompression) {
  write(recorded);
  mrpt::obs::CRawlog rawlog;
  ASSERT_TRUE(rawlog.loadFromRawLogFile(file().string()));
  ASSERT_EQ(rawlog.size(), recorded.size());
  expectSame(*rawlog.getAsObservation(0), *recorded[0]);
  const std::string plain = plainContent();
  ASSERT_LT(readText(file()).size(), plain.size());
  for (const bool compressed : {true, false}) {
    if (!compressed) writeBytes(plain);
    const Delivery delivery = read(file());
    EXPECT_EQ(delivery.error, "");
    EXPECT_EQ(delivery.observations.size(), recorded.size());
    expectBeginningOf(recorded, delivery.observations);
  }
  writeBytes(plain.substr(0, plain.size() - 1));
  const Delivery cut = read(file());
  EXPECT_THAT(cut.error,
              AllOf(StartsWith("stopped at entry " + std::to_string(recorded.size() - 1)),
                    EndsWith("r.rawlog: the file ends in the middle of its data")));
  EXPECT_EQ(cut.observations.size(), recorded.size() - 1);
}

TEST_F(Rawlog, ObservationsOfFramesComeOneByOneWithoutActionsAndComments) {
  mrpt::obs::CSensoryFrame frame;
  frame.insert(recorded[0]);
  frame.insert(recorded[1]);
  writeObjects(mrpt::obs::CObservationGPS(), mrpt::obs::CActionCollection(), frame,
               mrpt::obs::CObservationComment(), mrpt::obs::CActionCollection(), frame);
  const Delivery delivery = read(file());
  EXPECT_EQ(delivery.error, "");
  ASSERT_EQ(delivery.observations.size(), 5);
  for (const std::size_t i : {1, 2, 3, 4}) {
    expectSame(*delivery.observations[i], *recorded[(i - 1) % 2]);
  }
}

TEST_F(Rawlog, OfMovementsWithoutATimeTheLastPoseIsThatOfTheFrame) {
  mrpt::obs::CActionRobotMovement2D movement;
  movement.timestamp = INVALID_TIMESTAMP;
  movement.computeFromOdometry(mrpt::poses::CPose2D(1, 0, 0), {});
  const mrpt::obs::CActionCollection action(movement);
  mrpt::obs::CSensoryFrame frame;
  frame.insert(recorded[0]);
  mrpt::obs::CSensoryFrame later;
  later.insert(recorded[30]);
  writeObjects(action, action, action, frame, action, later);

  const Delivery delivery = read(file());
  EXPECT_EQ(delivery.error, "");
  ASSERT_EQ(delivery.observations.size(), 4);
  const auto first = poseIn(*delivery.observations[0]);
  ASSERT_TRUE(first);
  EXPECT_EQ(delivery.observations[0]->timestamp, recorded[0]->timestamp);
  EXPECT_NEAR(first->T_world_body.translation.x(), 3, 1e-12);
  const auto second = poseIn(*delivery.observations[2]);
  ASSERT_TRUE(second);
  EXPECT_EQ(delivery.observations[2]->timestamp, recorded[30]->timestamp);
  EXPECT_NEAR(second->T_world_body.translation.x(), 4, 1e-12);
}

TEST_F(Rawlog, TruncatedAnywhereIsAnErrorThatNamesTheEntryAfterAllEntriesBeforeIt) {
  write(recorded);
  const std::string bytes = readText(file());
  std::size_t most = 0;
  // Its last 8 bytes are gzip's checksum and size.
  for (std::size_t size = 0; size < bytes.size();
       size +=
       size + 8 < bytes.size() ? std::min(1 + bytes.size() / 50, bytes.size() - 8 - size) : 1) {
    writeBytes(bytes.substr(0, size));
    const Delivery delivery = read(file());
    EXPECT_THAT(
        delivery.error,
        AllOf(
            StartsWith("stopped at entry " + std::to_string(delivery.observations.size()) + " of "),
            HasSubstr("r.rawlog: "), isPlain(),
            EndsWith(size == 0 ? "the file is empty" : "the file ends in the middle of its data")))
        << "cut to " << size << " of " << bytes.size() << " bytes";
    EXPECT_THAT(delivery.again, StartsWith("stopped at entry "));
    expectBeginningOf(recorded, delivery.observations);
    most = std::max(most, delivery.observations.size());
  }
  EXPECT_EQ(most, recorded.size());
}

TEST_F(Rawlog, IsKnownByTheNameOfItsFirstObject) {
  const auto sized = [](char length, std::size_t count) {
    return length + std::string(count, 'a');
  };
  const std::string wide("\3\0\0\0abc", 7);  // as of old versions
  const std::pair<std::string, const char*> rows[] = {
      {sized('\x83', 3), nullptr},
      {sized('\xf8', 120), nullptr},
      {sized('\x83', 1), nullptr},  // truncated
      {"\x8b"
       "az09AZ_:<>,",
       nullptr},
      {wide, nullptr},
      {wide.substr(0, 2), nullptr},
      {sized('\x82', 2), "it begins with '\\x82aa'"},
      {sized('\xf9', 121), "it begins with '\\xf9aaaaaaaaaaaaaaaaaaaaaaa'"},
      {std::string("\2\0\0\0ab", 6), "it begins with"},
      {std::string("\3\0\0\1abc", 7), "it begins with"},
      {"\x83"
       "a-c",
       "it begins with '\\x83a-c'"},
      {"", "it is empty"},
  };
  for (const auto& [bytes, why] : rows) {
    writeBytes(bytes);
    EXPECT_EQ(whyNoRawlog(file()).has_value(), why != nullptr) << bytes;
    EXPECT_THAT(whyNoRawlog(file()).value_or(""), StartsWith(why != nullptr ? why : ""));
  }
  for (const char other : std::string("`{@[/;=?- ")) {
    writeBytes(
        "\x83"
        "a" +
        std::string(1, other) + "a");
    EXPECT_TRUE(whyNoRawlog(file())) << other;
  }
}

TEST_F(Rawlog, AChangedByteIsAnErrorAfterCorrectEntries) {
  write(recorded);
  const std::string bytes = readText(file());
  for (std::size_t at = 20; at < bytes.size(); at += 1 + bytes.size() / 40) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x08);
    writeBytes(damaged);
    const Delivery delivery = read(file());
    EXPECT_THAT(delivery.error, AllOf(StartsWith("stopped at entry "), isPlain())) << "byte " << at;
    expectBeginningOf(recorded, delivery.observations);
  }
  std::string wrong_checksum = bytes;
  wrong_checksum[bytes.size() - 6] ^= 1;
  writeBytes(wrong_checksum);
  EXPECT_THAT(read(file()).error, EndsWith("r.rawlog: incorrect data check"));
}

TEST_F(Rawlog, APacketWithAChangedByteIsAnErrorThatSaysSo) {
  CObservationEvents packet;
  packet.camera = SyntheticRecording().cameras[0].model;
  packet.events = SyntheticRecording().events[0];
  writeObjects(packet);
  std::string plain = plainContent();
  plain[plain.size() / 2] = static_cast<char>(plain[plain.size() / 2] ^ 0x08);
  writeBytes(plain);
  EXPECT_THAT(read(file()).error,
              EndsWith("r.rawlog: a packet of events is damaged: its checksum is wrong"));
}

TEST_F(Rawlog, AnotherFileIsAnErrorThatSaysSo) {
  const auto error_of = [](const std::filesystem::path& path) {
    return messageOf([&] { RawlogRecording recording(path); });
  };
  EXPECT_THAT(error_of(folder()), EndsWith(": a folder: expected a file"));
  EXPECT_THAT(error_of("/dev/null"), EndsWith(": not a regular file"));
  EXPECT_THAT(error_of(folder() / "nowhere"), EndsWith(": no such file"));
  // An entry begins with the length of its class's name, with the top bit set.
  for (const auto& [name, shown] :
       {std::pair<std::string, std::string>{"CNewObservation", "CNewObse"},
        {"C\x1b[2J", "C\\x1b[2J"}}) {
    writeBytes(std::string(1, static_cast<char>(0x80 | name.size())) + name + '\0');
    EXPECT_THAT(read(file()).error, AllOf(StartsWith("stopped at entry 0 of"), HasSubstr(shown),
                                          isPlain(), Not(HasSubstr("\x1b"))));
  }
  writeBytes("0.1 2 3 1\n0.2 2 3 1\n");
  EXPECT_THAT(read(file()).error, AllOf(StartsWith("stopped at entry 0 of"), isPlain()));
  writeObjects(*recorded[0], mrpt::poses::CPose3D(), *recorded[1]);
  EXPECT_THAT(
      read(file()).error,
      AllOf(StartsWith("stopped at entry 1 of"),
            EndsWith(
                "an object of class 'mrpt::poses::CPose3D': expected observations, sensory frames "
                "and actions")));
}

}  // namespace

// Rawlogs of both kinds that MRPT wrote, through the program and through the builder.

namespace {

using mrpt::obs::CActionCollection;
using mrpt::obs::CObservationRobotPose;
using mrpt::obs::CRawlog;
using mrpt::obs::CSensoryFrame;

/// How a rawlog says where the rig is.
enum class Says { kPoses, kOdometry, kMovements2d, kMovements3d };

class RawlogKinds : public ProgramTest {
 protected:
  RawlogKinds() {
    registerClasses();
    write(recording);
  }

  void save(const CRawlog& rawlog, const std::string& name) const {
    ASSERT_TRUE(rawlog.saveToRawLogFile((folder() / name).string()));
  }

  /// The position in the recording's plane: it moves along x alone.
  static mrpt::poses::CPose2D planar(const StampedPose& pose) {
    return {pose.T_world_rig.translation.x(), pose.T_world_rig.translation.y(), 0};
  }

  static CObservation::Ptr odometryOf(const StampedPose& pose) {
    auto odometry = mrpt::obs::CObservationOdometry::Create();
    odometry->sensorLabel = "wheels";
    odometry->timestamp = mrptTimeFrom(pose.t_ns);
    odometry->odometry = planar(pose);
    return odometry;
  }

  /// Observations alone.
  CRawlog observationsOnly(Says says) const {
    CRawlog rawlog;
    std::size_t k = 0;
    for (const CObservation::Ptr& observation : observationsOf(recording)) {
      const bool is_pose = IS_CLASS(*observation, CObservationRobotPose);
      rawlog.insert(is_pose && says == Says::kOdometry ? odometryOf(recording.poses[k])
                                                       : observation);
      if (is_pose) ++k;
    }
    return rawlog;
  }

  /// Pairs of an action and a frame: the packets until a pose, and that pose.
  CRawlog pairs(Says says) const {
    CRawlog rawlog;
    auto frame = CSensoryFrame::Create();
    std::size_t k = 0;
    for (const CObservation::Ptr& observation : observationsOf(recording)) {
      if (!IS_CLASS(*observation, CObservationRobotPose)) {
        frame->insert(observation);
        continue;
      }
      const StampedPose& pose = recording.poses[k];
      auto actions = CActionCollection::Create();
      const mrpt::poses::CPose2D change =
          planar(pose) - (k > 0 ? planar(recording.poses[k - 1]) : mrpt::poses::CPose2D());
      if (says == Says::kPoses) {
        frame->insert(observation);
      } else if (says == Says::kMovements2d) {
        mrpt::obs::CActionRobotMovement2D movement;
        movement.timestamp = mrptTimeFrom(pose.t_ns);
        movement.computeFromOdometry(change, {});
        actions->insert(movement);
      } else {
        mrpt::obs::CActionRobotMovement3D movement;
        movement.timestamp = mrptTimeFrom(pose.t_ns);
        movement.poseChange.mean = mrpt::poses::CPose3D(change);
        actions->insert(movement);
      }
      rawlog.insert(actions);
      rawlog.insert(frame);
      frame = CSensoryFrame::Create();
      ++k;
    }
    return rawlog;
  }

  /// The points of a binary PCD file with the fields x y z intensity.
  std::vector<Eigen::Vector4f> pointsOfMap() const {
    const std::string pcd = contentOf("out/map.pcd");
    const std::string last_of_header = "DATA binary\n";
    const std::size_t begin = pcd.find(last_of_header) + last_of_header.size();
    std::vector<Eigen::Vector4f> points((pcd.size() - begin) / sizeof(Eigen::Vector4f));
    std::memcpy(static_cast<void*>(points.data()), pcd.data() + begin,
                points.size() * sizeof(Eigen::Vector4f));
    return points;
  }

  std::vector<Eigen::Vector4f> mapOf(const std::string& rawlog,
                                     const std::string& options = "") const {
    const Result result = run("map rig.ini " + rawlog + " --out out " + options);
    EXPECT_EQ(result.status, 0) << result.err;
    return pointsOfMap();
  }

  const SyntheticRecording recording;
};

void expectNear(const std::vector<Eigen::Vector4f>& a, const std::vector<Eigen::Vector4f>& b) {
  ASSERT_EQ(a.size(), b.size());
  ASSERT_GT(a.size(), 30U);
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_LT((a[i] - b[i]).norm(), 1e-4);
}

TEST_F(RawlogKinds, OdometryAndMovementsGiveTheMapThatPosesGive) {
  save(observationsOnly(Says::kPoses), "poses.rawlog");
  save(observationsOnly(Says::kOdometry), "odometry.rawlog");
  save(pairs(Says::kMovements2d), "planar.rawlog");
  save(pairs(Says::kMovements3d), "spatial.rawlog");
  save(pairs(Says::kPoses), "pairs.rawlog");
  ASSERT_EQ(run("import planar.rawlog --out imported.rawlog").status, 0);
  const auto map = mapOf("poses.rawlog");
  mapOf("pairs.rawlog");
  EXPECT_TRUE(pointsOfMap() == map) << "to the bit";
  for (const char* name : {"odometry", "planar", "spatial", "imported"}) {
    SCOPED_TRACE(name);
    expectNear(mapOf(name + std::string(".rawlog")), map);
  }
  EXPECT_THAT(run("info imported.rawlog").out, HasSubstr("actions:\n  51 poses from 10.0"));
  EXPECT_THAT(run("info odometry.rawlog --t1 10.2").out,
              HasSubstr("odometry 'wheels':\n  21 poses from 10.0"));
}

TEST_F(RawlogKinds, TheBuilderMapsBothAsMrptReadsThem) {
  save(observationsOnly(Says::kPoses), "observations.rawlog");
  save(pairs(Says::kMovements3d), "pairs.rawlog");
  std::vector<std::vector<Eigen::Vector4f>> maps;
  for (const char* name : {"observations.rawlog", "pairs.rawlog"}) {
    mrpt::io::CFileGZInputStream file((folder() / name).string());
    auto archive = mrpt::serialization::archiveFrom<mrpt::io::CStream>(file);
    CEventFusionMapBuilder builder(syntheticOptions());
    CActionCollection::Ptr action;
    CSensoryFrame::Ptr frame;
    CObservation::Ptr observation;
    std::size_t entry = 0;
    while (CRawlog::getActionObservationPairOrObservation(archive, action, frame, observation,
                                                          entry)) {
      if (observation) {
        builder.processObservation(observation);
      } else {
        builder.processActionObservation(*action, *frame);
      }
    }
    builder.finish();
    std::vector<Eigen::Vector4f>& map = maps.emplace_back();
    const MapCloud::ConstPtr points = builder.points();
    for (const MapPoint& point : *points) {
      map.emplace_back(point.x, point.y, point.z, point.intensity);
    }
    mrpt::poses::CPose3D pose;
    builder.getCurrentPoseEstimation()->getMean(pose);
    EXPECT_NEAR(pose.x(), recording.poses.back().T_world_rig.translation.x(), 1e-9);
  }
  expectNear(maps[0], maps[1]);
}

TEST_F(RawlogKinds, AHandEyeTransformAppliesToOdometryToo) {
  std::ofstream(folder() / "up.yaml")
      << "T_body_rig: [[1, 0, 0, 0], [0, 1, 0, 7], [0, 0, 1, 0], [0, 0, 0, 1]]\n";
  save(observationsOnly(Says::kOdometry), "odometry.rawlog");
  mapOf("odometry.rawlog", "--hand-eye up.yaml");
  EXPECT_NEAR(readTumTrajectory(folder() / "out/trajectory.txt")[0].T_world_rig.translation.y(), 7,
              1e-9);
  const Result result = run("import odometry.rawlog --out r.rawlog --hand-eye up.yaml");
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.err, HasSubstr("cannot hold the hand-eye transform: give it to map as well"));
}

}  // namespace

}  // namespace efm
