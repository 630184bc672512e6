// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/merged_recording.h"

#include <gmock/gmock.h>

#include "mapping/geometry/timestamp.h"
#include "plugin/mrpt/pose_observation.h"
#include "plugin/recordings/text/event_text.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::int64_t kMs = 1'000'000;

/// What an observation is, in short: its label, its time in ms and, of events, how many.
std::string shortly(const mrpt::obs::CObservation& observation) {
  std::string text =
      observation.sensorLabel + "@" + std::to_string(nanosecondsFrom(observation.timestamp) / kMs);
  if (const auto* packet = dynamic_cast<const CObservationEvents*>(&observation)) {
    text += ":" + std::to_string(packet->events.size());
  }
  return text;
}

std::vector<mrpt::obs::CObservation::Ptr> readAll(Recording& recording) {
  std::vector<mrpt::obs::CObservation::Ptr> observations;
  while (auto observation = recording.next()) observations.push_back(observation);
  return observations;
}

std::vector<std::string> shortly(const std::vector<mrpt::obs::CObservation::Ptr>& observations) {
  std::vector<std::string> texts;
  for (const auto& observation : observations) texts.push_back(shortly(*observation));
  return texts;
}

class MergedRecordingTest : public TemporaryFolder {
 protected:
  /// @param texts of each camera's events; camera n stands n metres to the right.
  RecordingWithPoses open(const std::vector<std::string>& texts,
                          std::vector<StampedPose> poses = {}) {
    Rig rig;
    std::vector<EventPackets> cameras;
    for (std::size_t n = 0; n < texts.size(); ++n) {
      RigCamera& camera = rig.cameras.emplace_back();
      camera.model.width = 240;
      camera.model.height = 180;
      camera.model.fx = camera.model.fy = 200 + static_cast<double>(n);
      camera.T_rig_cam.translation.x() = static_cast<double>(n);
      camera.time_offset_ns = static_cast<std::int64_t>(n) * 100;
      const std::filesystem::path file = folder() / ("cam" + std::to_string(n)) / "events.txt";
      writeFile(file, texts[n]);
      cameras.emplace_back(std::make_unique<EventTextStream>(file), CameraSize{240, 180});
    }
    auto merged = std::make_unique<MergedRecording>(std::move(rig), std::move(cameras));
    merged->requireEvents();
    return RecordingWithPoses(std::move(merged), std::move(poses));
  }
};

StampedPose poseAt(std::int64_t t_ns) {
  StampedPose pose;
  pose.t_ns = t_ns;
  pose.T_world_rig.translation = {static_cast<double>(t_ns), 2, 3};
  return pose;
}

TEST_F(MergedRecordingTest, IsInTheOrderOfTimeWithPosesBeforePacketsOfTheSameTime) {
  RecordingWithPoses recording = open(
      {"0.012 0 0 0\n0.018 0 0 0\n0.031 0 0 0\n", "0.015 0 0 0\n0.022 0 0 0\n"},
      {poseAt(31 * kMs), poseAt(5 * kMs), poseAt(12 * kMs), poseAt(16 * kMs), poseAt(90 * kMs)});
  EXPECT_THAT(shortly(readAll(recording)),
              ElementsAre("pose@5", "pose@12", "cam0@12:0", "cam1@12:0", "cam0@12:2", "cam1@15:1",
                          "pose@16", "cam1@22:1", "pose@31", "cam0@31:1", "pose@90"));
  EXPECT_EQ(recording.next(), nullptr);
}

TEST_F(MergedRecordingTest, APacketHasItsCameraAndItsEvents) {
  RecordingWithPoses recording =
      open({"0.1 1 2 0\n", "0.100000049 3 4 1\n0.099 5 6 0\n", "0.205 0 0 0\n0.204 0 0 0\n"});
  const std::vector<Event> expected[] = {
      {}, {{99'000'000, 5, 6, false}}, {{100'000'049, 3, 4, true}}};
  const auto observations = readAll(recording);
  ASSERT_EQ(observations.size(), 7U);
  for (const std::size_t i : {1, 3, 5}) {
    const auto& packet = dynamic_cast<const CObservationEvents&>(*observations[i]);
    EXPECT_EQ(packet.sensorLabel, "cam1");
    EXPECT_EQ(packet.camera_index, 1);
    EXPECT_EQ(packet.camera.fx, 201);
    EXPECT_EQ(packet.camera_pose.x(), 1);
    EXPECT_EQ(packet.time_offset_ns, 100);
    EXPECT_EQ(nanosecondsFrom(packet.timestamp), i == 5 ? 100'000'000 : 99'000'000);
    EXPECT_EQ(packet.events, expected[i / 2]);
  }
  EXPECT_EQ(recording.counts().sorted_events, 2U);
  EXPECT_THAT(errorOf([&] {
                open({"", "\n"}, {poseAt(0)});
              }),
              AllOf(HasSubstr("cam0/events.txt, "), HasSubstr("cam1/events.txt: no events")));
}

TEST_F(MergedRecordingTest, OtherPosesReplaceTheRecordingsAndTheirDamageComesLast) {
  RecordingWithPoses recording(
      std::make_unique<RecordingWithPoses>(
          open({"0.012 0 0 0\n0.023 0 0 0\n"}, {poseAt(5 * kMs), poseAt(40 * kMs)})),
      {poseAt(12 * kMs), poseAt(50 * kMs), poseAt(7 * kMs)}, "torn");
  std::vector<std::string> given;
  EXPECT_EQ(errorOf([&] {
              while (const auto observation = recording.next())
                given.push_back(shortly(*observation));
            }),
            "torn");
  EXPECT_EQ(recording.position(), "the poses");
  EXPECT_THAT(given,
              ElementsAre("pose@7", "pose@12", "cam0@12:0", "cam0@12:1", "cam0@23:1", "pose@50"));
}

TEST_F(MergedRecordingTest, APacketIsCoveredUntilItsCamerasNextEvent) {
  RecordingWithPoses recording = open({"0.012 0 0 0\n0.018 0 0 0\n5 0 0 0\n", "0.015 0 0 0\n"});
  std::vector<std::optional<std::int64_t>> covered;
  for (const auto& observation : readAll(recording)) {
    covered.push_back(dynamic_cast<const CObservationEvents&>(*observation).covered_until_ns);
  }
  EXPECT_THAT(covered, ElementsAre(12 * kMs, 15 * kMs,  // the empty ones
                                   5000 * kMs,          // cam0, 10 to 20 ms
                                   kEndOfTimeNs,        // cam1's last
                                   std::nullopt));      // the recording's last
}

TEST_F(MergedRecordingTest, ACameraWithoutEventsIsSilentFromTheBeginning) {
  RecordingWithPoses recording = open({"", "0.5 0 0 0\n0.6 0 0 0\n", "# nothing\n"});
  const auto observations = readAll(recording);
  EXPECT_THAT(shortly(observations),
              ElementsAre("cam0@500:0", "cam1@500:0", "cam2@500:0", "cam1@500:1", "cam1@600:1"));
  for (const std::size_t silent : {0, 2}) {
    EXPECT_EQ(dynamic_cast<const CObservationEvents&>(*observations[silent]).covered_until_ns,
              kEndOfTimeNs);
  }
}

TEST_F(MergedRecordingTest, EventsBeforeAWrongLineComeBeforeTheError) {
  RecordingWithPoses recording = open({"0.012 0 0 0\n0.018 0 0 0\n0.019 0 0\n0.025 0 0 0\n",
                                       "0.011 0 0 0\n0.015 0 0 0\n0.022 0 0 0\n"},
                                      {poseAt(5 * kMs), poseAt(17 * kMs), poseAt(90 * kMs)});
  std::vector<std::string> given;
  const std::string error = errorOf([&] {
    while (const auto observation = recording.next()) given.push_back(shortly(*observation));
  });
  EXPECT_THAT(error, HasSubstr("cam0/events.txt:3: '0.019 0 0'"));
  EXPECT_THAT(given, ElementsAre("pose@5", "cam0@11:0", "cam1@11:0", "cam1@11:2", "cam0@12:2",
                                 "pose@17", "pose@90"));
}

/// A camera whose file tells what is missing.
struct LossyStream : EventStream {
  explicit LossyStream(std::uint64_t packets) : lost(packets) {}
  bool read(std::vector<Event>&) override { return false; }
  std::string positionOf(std::size_t) const override { return ""; }
  std::string name() const override { return ""; }
  double progress() const override { return 1; }
  std::uint64_t lostPackets() const override { return lost; }
  std::uint64_t undatedEvents() const override { return 10 * lost; }
  std::vector<Warning> warnings() const override { return {{"", std::to_string(lost)}}; }
  std::uint64_t lost;
};

TEST_F(MergedRecordingTest, ItsLossesAreThoseOfAllCameras) {
  std::vector<EventPackets> cameras;
  for (const std::uint64_t lost : {2, 3}) {
    cameras.emplace_back(std::make_unique<LossyStream>(lost), CameraSize{240, 180});
  }
  const RecordingCounts counts =
      MergedRecording(Rig{std::vector<RigCamera>(2)}, std::move(cameras)).counts();
  EXPECT_EQ(counts.lost_packets, 5U);
  EXPECT_EQ(counts.undated_events, 50U);
  EXPECT_EQ(counts.warnings.at(1).text, "3");
}

TEST_F(MergedRecordingTest, ProgressGoesFromTheBeginningToOne) {
  std::string text;
  for (int i = 0; i < 400'000; ++i) text += std::to_string(i / 1000) + ".5 1 2 0\n";  // 5 MB
  RecordingWithPoses recording = open({text, "1 0 0 0\n"});
  recording.next();
  double before = recording.progress();
  EXPECT_LT(before, 0.5);
  while (recording.next()) {
    EXPECT_GE(recording.progress(), before);
    before = recording.progress();
  }
  EXPECT_EQ(recording.progress(), 1.0);
}

}  // namespace
}  // namespace efm
