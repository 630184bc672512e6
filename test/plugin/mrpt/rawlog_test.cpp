// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
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

#include <sstream>

#include "maps/io/point_cloud_file.h"
#include "plugin/mrpt/CEventFusionMapBuilder.h"
#include "plugin/mrpt/pose_observation.h"
#include "plugin/mrpt/rawlog.h"
#include "plugin/mrpt/registration.h"
#include "plugin/recordings/open/open_recording.h"
#include "plugin/recordings/open/recording_formats.h"
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

/// The contents of a rawlog, and the error that ended the reading, if any.
struct Contents {
  std::vector<std::vector<Event>> events{2};  // per camera
  std::vector<PoseSample> poses;
  std::vector<std::string> others;
  std::string error;

  std::size_t numEvents() const { return events[0].size() + events[1].size(); }
};

Contents read(const std::filesystem::path& file) {
  Contents contents;
  RecordingSource source;
  source.files = {file};
  source.format = "rawlog";
  source.complete = false;
  double progress = 0;
  try {
    const auto recording = openRecording(source);
    while (const auto sample = recording->next()) {
      EXPECT_GE(recording->progress(), progress);
      progress = recording->progress();
      if (const auto* packet = std::get_if<EventPacket>(&*sample)) {
        auto& events = contents.events.at(static_cast<std::size_t>(packet->camera));
        events.insert(events.end(), packet->events.begin(), packet->events.end());
      } else if (const auto* pose = std::get_if<PoseSample>(&*sample)) {
        contents.poses.push_back(*pose);
      } else {
        contents.others.push_back(std::get<OtherSample>(*sample).type);
      }
    }
  } catch (const std::exception& error) {
    contents.error = error.what();
  }
  return contents;
}

/// Returns the expected contents of the first entries.
Contents contentsOf(const Observations& observations, std::size_t entries) {
  Contents contents;
  for (std::size_t i = 0; i < entries; ++i) {
    if (const auto* packet = dynamic_cast<const CObservationEvents*>(observations[i].get())) {
      auto& events = contents.events.at(static_cast<std::size_t>(packet->camera_index));
      events.insert(events.end(), packet->events.begin(), packet->events.end());
    } else {
      contents.poses.push_back(*efm::poseIn(*observations[i]));
    }
  }
  return contents;
}

void expectSame(const Contents& a, const Contents& b) {
  EXPECT_EQ(a.events, b.events);
  ASSERT_EQ(a.poses.size(), b.poses.size());
  for (std::size_t i = 0; i < a.poses.size(); ++i) {
    EXPECT_EQ(a.poses[i].t_ns, b.poses[i].t_ns);
    EXPECT_TRUE(isSame(a.poses[i].T_world_body, b.poses[i].T_world_body));
  }
}

/// Returns the number in "stopped at entry N of".
std::size_t entryIn(const std::string& error) {
  const std::string begin = "stopped at entry ";
  EXPECT_THAT(error, StartsWith(begin));
  return error.size() > begin.size() ? std::stoul(error.substr(begin.size())) : 0;
}

/// Matches one line without MRPT's decoration.
testing::Matcher<std::string> isPlain() {
  return AllOf(Not(HasSubstr("xception")), Not(HasSubstr("Location")), Not(HasSubstr("Message")),
               Not(HasSubstr("\n")), Not(EndsWith("unreadable")));
}

class Rawlog : public TemporaryFolder {
 protected:
  Rawlog() { registerClasses(); }

  std::filesystem::path file() const { return folder() / "r.rawlog"; }

  void write(const Observations& observations) const {
    GzStream stream(file(), GzStream::Mode::kWrite);
    auto archive = mrpt::serialization::archiveFrom<mrpt::io::CStream>(stream);
    for (const auto& observation : observations) archive << *observation;
    stream.close();
  }

  void writeBytes(const std::string& bytes) const { writeFile(file(), bytes); }

  /// Returns the uncompressed content.
  std::string plainContent() const {
    GzStream stream(file());
    std::string plain;
    char byte = 0;
    while (stream.Read(&byte, 1) == 1) plain += byte;
    return plain;
  }

  /// Writes any objects, as other programs may store them.
  template <typename... Objects>
  void writeObjects(const Objects&... objects) const {
    GzStream stream(file(), GzStream::Mode::kWrite);
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
  const std::string plain = plainContent();
  ASSERT_LT(readText(file()).size(), plain.size());
  for (const bool compressed : {true, false}) {
    if (!compressed) writeBytes(plain);
    const Contents contents = read(file());
    EXPECT_EQ(contents.error, "");
    expectSame(contents, contentsOf(recorded, recorded.size()));
  }
  writeBytes(plain.substr(0, plain.size() - 1));
  const Contents cut = read(file());
  EXPECT_THAT(cut.error, EndsWith("r.rawlog: the file ends in the middle of its data"));
  EXPECT_EQ(entryIn(cut.error), recorded.size() - 1);
  expectSame(cut, contentsOf(recorded, recorded.size() - 1));
}

TEST_F(Rawlog, ObservationsOfFramesComeOneByOneWithoutActionsAndComments) {
  mrpt::obs::CSensoryFrame frame;
  frame.insert(recorded[0]);
  frame.insert(recorded[1]);
  mrpt::obs::CSensoryFrame later;
  later.insert(recorded[3]);
  writeObjects(mrpt::obs::CObservationGPS(), mrpt::obs::CActionCollection(), frame,
               mrpt::obs::CObservationComment(), mrpt::obs::CActionCollection(), later);
  const Contents contents = read(file());
  EXPECT_EQ(contents.error, "");
  expectSame(contents, contentsOf(Observations{recorded[0], recorded[1], recorded[3]}, 3));
  EXPECT_THAT(contents.others, testing::ElementsAre("mrpt::obs::CObservationGPS"));
}

// All streams are read at once. A stream far behind another one reads on its own: the events of one
// camera come after all those of the other, more than may wait.
TEST_F(Rawlog, MayHaveTheEventsOfOneCameraAfterThoseOfTheOther) {
  constexpr std::int64_t kEvents = 1'100'000;
  Observations observations;
  for (const int camera : {0, 1}) {
    for (const CObservation::Ptr& observation : recorded) {
      const auto first = std::dynamic_pointer_cast<CObservationEvents>(observation);
      if (!first || first->camera_index != camera) continue;
      for (std::int64_t i = 0; i < kEvents; i += kEvents / 10) {
        auto packet = std::make_shared<CObservationEvents>(*first);
        packet->events.clear();
        packet->covered_until_ns.reset();
        for (std::int64_t k = i; k < i + kEvents / 10; ++k) packet->events.push_back({k * 1'000});
        observations.push_back(packet);
      }
      break;
    }
  }
  write(observations);
  const Contents contents = read(file());
  EXPECT_EQ(contents.error, "");
  expectSame(contents, contentsOf(observations, observations.size()));
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

  const Contents contents = read(file());
  EXPECT_EQ(contents.error, "");
  ASSERT_EQ(contents.poses.size(), 2U);
  EXPECT_EQ(contents.poses[0].t_ns, nanosecondsFrom(recorded[0]->timestamp));
  EXPECT_NEAR(contents.poses[0].T_world_body.translation.x(), 3, 1e-12);
  EXPECT_EQ(contents.poses[1].t_ns, nanosecondsFrom(recorded[30]->timestamp));
  EXPECT_NEAR(contents.poses[1].T_world_body.translation.x(), 4, 1e-12);
}

TEST_F(Rawlog, TruncatedAnywhereIsAnErrorThatNamesTheEntryAfterAllEntriesBeforeIt) {
  write(recorded);
  const std::string bytes = readText(file());
  std::size_t most = 0;
  // The last 8 bytes are gzip's checksum and size.
  for (std::size_t size = 1; size < bytes.size();
       size +=
       size + 8 < bytes.size() ? std::min(1 + bytes.size() / 50, bytes.size() - 8 - size) : 1) {
    writeBytes(bytes.substr(0, size));
    const Contents contents = read(file());
    SCOPED_TRACE(fmt::format("cut to {} of {} bytes", size, bytes.size()));
    EXPECT_THAT(contents.error, AllOf(HasSubstr("r.rawlog: "), isPlain(),
                                      EndsWith("the file ends in the middle of its data")));
    const std::size_t entry = entryIn(contents.error);
    expectSame(contents, contentsOf(recorded, entry));
    most = std::max(most, entry);
  }
  EXPECT_EQ(most, recorded.size());
}

TEST_F(Rawlog, IsKnownByTheNameOfItsFirstObject) {
  const auto sized = [](char length, std::size_t count) {
    return length + std::string(count, 'a');
  };
  const std::string wide("\3\0\0\0abc", 7);  // as in old versions
  const std::pair<std::string, const char*> rows[] = {
      {sized('\x83', 3), nullptr},
      {sized('\xf8', 120), nullptr},
      {sized('\x83', 1), nullptr},  // a truncated name
      {std::string("\x8b") + "az09AZ_:<>,", nullptr},
      {wide, nullptr},
      {wide.substr(0, 2), nullptr},
      {sized('\x82', 2), "it begins with '\\x82aa'"},
      {sized('\xf9', 121), "it begins with '\\xf9aaaaaaaaaaaaaaaaaaaaaaa'"},
      {std::string("\2\0\0\0ab", 6), "it begins with"},
      {std::string("\3\0\0\1abc", 7), "it begins with"},
      {std::string("\x83") + "a-c", "it begins with '\\x83a-c'"},
      {"", "it is empty"},
  };
  for (const auto& [bytes, why] : rows) {
    writeBytes(bytes);
    EXPECT_EQ(whyNoRawlog(file()).has_value(), why != nullptr) << bytes;
    EXPECT_THAT(whyNoRawlog(file()).value_or(""), StartsWith(why != nullptr ? why : ""));
  }
  for (const char other : std::string("`{@[/;=?- ")) {
    writeBytes(std::string("\x83") + "a" + other + "a");
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
    SCOPED_TRACE(fmt::format("byte {}", at));
    const Contents contents = read(file());
    EXPECT_THAT(contents.error, isPlain());
    expectSame(contents, contentsOf(recorded, entryIn(contents.error)));
  }
  std::string wrong_checksum = bytes;
  wrong_checksum[bytes.size() - 6] ^= 1;
  writeBytes(wrong_checksum);
  EXPECT_THAT(read(file()).error, EndsWith("r.rawlog: incorrect data check"));
  writeBytes(bytes);
  std::string plain = plainContent();
  plain[plain.rfind("CObservationEvents") + 60] ^= 0x08;
  writeBytes(plain);
  EXPECT_THAT(read(file()).error,
              EndsWith("r.rawlog: a packet of events is damaged: its checksum is wrong"));
}

TEST_F(Rawlog, AnotherFileIsAnErrorThatSaysSo) {
  const auto error_of = [](const std::filesystem::path& path) {
    return messageOf([&] { GzStream stream(path); });
  };
  EXPECT_THAT(error_of(folder()), EndsWith(": a folder: expected a file"));
  EXPECT_THAT(error_of("/dev/null"), EndsWith(": not a regular file"));
  EXPECT_THAT(error_of(folder() / "nowhere"), EndsWith(": no such file"));
  // An entry begins with the length of its class's name. The top bit of the length is set.
  for (const auto& [name, shown] :
       {std::pair<std::string, std::string>{"CNewObservation", "CNewObse"},
        {"C\x1b[2J", "C\\x1b[2J"}}) {
    writeBytes(std::string(1, static_cast<char>(0x80 | name.size())) + name + '\0');
    EXPECT_THAT(messageOf([&] { openRawlog(file(), {}); }),
                AllOf(StartsWith("stopped at entry 0 of"), HasSubstr(shown), isPlain(),
                      Not(HasSubstr("\x1b"))));
  }
  writeBytes("0.1 2 3 1\n0.2 2 3 1\n");
  EXPECT_THAT(messageOf([&] { openRawlog(file(), {}); }),
              AllOf(StartsWith("stopped at entry 0 of"), isPlain()));
  writeObjects(*recorded[0], mrpt::poses::CPose3D(), *recorded[1]);
  EXPECT_THAT(
      read(file()).error,
      AllOf(StartsWith("stopped at entry 1 of"),
            EndsWith(
                "an object of class 'mrpt::poses::CPose3D': expected observations, sensory frames "
                "and actions")));
}

}  // namespace

// Tests both kinds of rawlogs, written by MRPT, with the program and with the builder.

namespace {

using mrpt::obs::CActionCollection;
using mrpt::obs::CObservationRobotPose;
using mrpt::obs::CRawlog;
using mrpt::obs::CSensoryFrame;

/// The kind of pose information in a rawlog.
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

  /// Returns the position in the plane of the recording, which moves along x only.
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

  /// Returns a rawlog of observations only.
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

  /// Returns a rawlog of pairs: an action, and a frame with the packets until a pose and this pose.
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

  const SyntheticRecording recording;
};

/// @param a, b contents of map.pcd files.
void expectNearPcd(const std::string& a, const std::string& b) {
  const std::vector<CloudPoint> points = parsePcd(a).points;
  const std::vector<CloudPoint> expected = parsePcd(b).points;
  ASSERT_EQ(points.size(), expected.size());
  ASSERT_GT(points.size(), 30U);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_LT((points[i].p_world - expected[i].p_world).norm(), 1e-4);
    EXPECT_NEAR(points[i].confidence, expected[i].confidence, 1e-4);
  }
}

TEST_F(RawlogKinds, OdometryAndMovementsGiveTheMapThatPosesGive) {
  save(observationsOnly(Says::kPoses), "poses.rawlog");
  save(observationsOnly(Says::kOdometry), "odometry.rawlog");
  save(pairs(Says::kMovements2d), "planar.rawlog");
  save(pairs(Says::kMovements3d), "spatial.rawlog");
  save(pairs(Says::kPoses), "pairs.rawlog");
  ASSERT_EQ(run("import planar.rawlog --out imported.rawlog").status, 0);
  const auto map = mapOf("poses.rawlog");
  EXPECT_TRUE(mapOf("pairs.rawlog") == map) << "to the bit";
  for (const char* name : {"odometry", "planar", "spatial", "imported"}) {
    SCOPED_TRACE(name);
    expectNearPcd(mapOf(name + std::string(".rawlog")), map);
  }
  EXPECT_THAT(run("info imported.rawlog").out, HasSubstr("actions:\n  51 poses from 10.0"));
  EXPECT_THAT(run("info odometry.rawlog --t1 10.2").out,
              HasSubstr("odometry 'wheels':\n  21 poses from 10.0"));
}

TEST_F(RawlogKinds, TheBuilderMapsBothAsMrptReadsThem) {
  save(observationsOnly(Says::kPoses), "observations.rawlog");
  save(pairs(Says::kMovements3d), "pairs.rawlog");
  std::vector<std::string> maps;
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
    std::ostringstream map;
    writePcdTo(map, *builder.points());
    maps.push_back(map.str());
    mrpt::poses::CPose3D pose;
    builder.getCurrentPoseEstimation()->getMean(pose);
    EXPECT_NEAR(pose.x(), recording.poses.back().T_world_rig.translation.x(), 1e-9);
  }
  expectNearPcd(maps[0], maps[1]);
}

TEST_F(RawlogKinds, ARawlogThatIsImportedKeepsLabelsDigitsCovariancesAndAllElse) {
  CRawlog rawlog;
  const auto gps = mrpt::obs::CObservationGPS::Create();
  gps->timestamp = mrptTimeFrom(recording.poses[3].t_ns);
  rawlog.insert(gps);
  for (const CObservation::Ptr& observation : observationsOf(recording)) {
    const auto turned = mrpt::poses::CPose3D(0.1, 0.2, 0.3, 0.4, 0.5, 0.6);
    if (auto* const pose = dynamic_cast<CObservationRobotPose*>(observation.get())) {
      pose->sensorLabel = "tracker";
      pose->pose.mean = turned;
      pose->pose.cov(1, 0) = pose->pose.cov(0, 1) = 0.25;
      pose->sensorPose = turned;
    } else {
      observation->sensorLabel = "left";
      observation->setSensorPose(turned);
    }
    rawlog.insert(observation);
  }
  save(rawlog, "given.rawlog");
  ASSERT_EQ(run("import given.rawlog --out r.rawlog --t0 10.1 --perturb latency_s=0.01").status, 0);
  CRawlog copy;
  ASSERT_TRUE(copy.loadFromRawLogFile((folder() / "r.rawlog").string()));
  std::map<std::string, int> labels;
  const auto given = std::dynamic_pointer_cast<CObservationRobotPose>(rawlog.getAsObservation(3));
  ASSERT_TRUE(given);
  for (std::size_t i = 0; i < copy.size(); ++i) {
    const CObservation::Ptr observation = copy.getAsObservation(i);
    ++labels[observation->sensorLabel];
    EXPECT_EQ(observation->sensorPose(), given->sensorPose.asTPose()) << "to the bit";
    const auto pose = std::dynamic_pointer_cast<CObservationRobotPose>(observation);
    if (!pose) continue;
    EXPECT_EQ(pose->pose.mean, given->pose.mean) << "to the bit";
    EXPECT_TRUE(pose->pose.cov == given->pose.cov);
  }
  EXPECT_EQ(labels.at("tracker"), 42);
  EXPECT_GT(labels.at("left"), 40);
  ASSERT_EQ(run("import given.rawlog --out whole.rawlog").status, 0);
  EXPECT_THAT(run("info whole.rawlog").out,
              HasSubstr("mrpt::obs::CObservationGPS: 1 observations"));
}

TEST_F(RawlogKinds, AHandEyeTransformAppliesToOdometryToo) {
  write("up.yaml", "T_body_rig: [[1, 0, 0, 0], [0, 1, 0, 7], [0, 0, 1, 0], [0, 0, 0, 1]]\n");
  save(observationsOnly(Says::kOdometry), "odometry.rawlog");
  mapOf("odometry.rawlog --hand-eye up.yaml");
  EXPECT_NEAR(readPoses(folder() / "out/trajectory.txt")[0].T_world_rig.translation.y(), 7, 1e-9);
  const Result result = run("import odometry.rawlog --out r.rawlog --hand-eye up.yaml");
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.err, HasSubstr("cannot hold the hand-eye transform: give it to map as well"));
}

}  // namespace

}  // namespace efm
