// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/perturbed_recording.h"

#include <gmock/gmock.h>
#include <mrpt/obs/CObservationOdometry.h>

#include <algorithm>
#include <utility>

#include "plugin/mrpt/pose_observation.h"
#include "plugin/recordings/open/time_cut.h"
#include "test/plugin/mrpt/observations.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using mrpt::obs::CObservation;
using mrpt::obs::CObservationRobotPose;
using Observations = std::vector<CObservation::Ptr>;

constexpr std::int64_t kMillisecond = 1'000'000;
constexpr std::int64_t kStartNs = SyntheticRecording::kStartNs;

CObservationRobotPose::Ptr observedPose(std::int64_t t_ns, const std::string& label = "pose") {
  auto pose = CObservationRobotPose::Create();
  pose->timestamp = mrptTimeFrom(t_ns);
  pose->sensorLabel = label;
  pose->pose.mean = mrpt::poses::CPose3D(secondsBetween(kStartNs, t_ns), 2, 3, 0.4, 0.5, 0.6);
  pose->pose.cov.setDiagonal(6, 0.25);
  pose->sensorPose = mrpt::poses::CPose3D(0.1, 0.2, 0.3, 0.4, 0.5, 0.6);
  return pose;
}

CObservationEvents::Ptr packetAt(std::int64_t t_ns) {
  auto packet = CObservationEvents::Create();
  packet->timestamp = mrptTimeFrom(t_ns);
  packet->events = {{t_ns, 1, 2, true}};
  return packet;
}

/// Poses of two trackers every 20 ms, each before the packet that begins then; packets every 2 ms,
/// and odometry.
Observations twoTrackers() {
  Observations all;
  for (std::int64_t t_ns = kStartNs; t_ns <= kStartNs + 400 * kMillisecond;
       t_ns += 2 * kMillisecond) {
    if (t_ns % (20 * kMillisecond) == 0) {
      all.push_back(observedPose(t_ns, "one"));
      all.push_back(observedPose(t_ns, "two"));
      auto odometry = mrpt::obs::CObservationOdometry::Create();
      odometry->timestamp = mrptTimeFrom(t_ns);
      all.push_back(odometry);
    }
    all.push_back(packetAt(t_ns));
  }
  return all;
}

TrackerFaults keyframeNoise() {
  TrackerFaults faults;
  faults.perturbation.keyframe.noise_m = 0.01;
  faults.perturbation.keyframe.noise_rad = 0.01;
  faults.perturbation.keyframe.length_ns = 50 * kMillisecond;
  return faults;
}

Observations perturbed(const TrackerFaults& faults, Observations observations = twoTrackers()) {
  PerturbedRecording recording(std::make_unique<ListedRecording>(std::move(observations)), faults);
  Observations all;
  while (auto observation = recording.next()) all.push_back(observation);
  EXPECT_FALSE(recording.next());
  return all;
}

std::int64_t timeOf(const CObservation& observation) {
  return nanosecondsFrom(observation.timestamp);
}

Observations posesOf(const Observations& observations, const std::string& label) {
  Observations poses;
  for (const auto& observation : observations) {
    if (observation->sensorLabel == label) poses.push_back(observation);
  }
  return poses;
}

const CObservationRobotPose& robotPose(const CObservation::Ptr& observation) {
  return dynamic_cast<const CObservationRobotPose&>(*observation);
}

TEST(PerturbedRecording, InsertsPosesInTheOrderOfTime) {
  const Observations all = perturbed(keyframeNoise());
  // Seven stretches begin after the first, of which those at 100, 200, 300, 400 ms have a pose.
  EXPECT_EQ(posesOf(all, "one").size(), 21U + 4 * 2 + 4);
  EXPECT_EQ(posesOf(all, "two").size(), 21U + 4 * 2 + 4);
  for (std::size_t i = 1; i < all.size(); ++i) {
    EXPECT_LE(timeOf(*all[i - 1]), timeOf(*all[i]));
    const bool pose_after_packet = poseSourceOf(*all[i]) && !poseSourceOf(*all[i - 1]) &&
                                   timeOf(*all[i - 1]) == timeOf(*all[i]);
    EXPECT_FALSE(pose_after_packet) << i;
  }
}

TEST(PerturbedRecording, MovesPosesAndKeepsAllElse) {
  TrackerFaults faults = keyframeNoise();
  faults.perturbation.noise_m = 0.01;
  const Observations original = twoTrackers();
  const Observations all = perturbed(faults);
  for (const char* label : {"one", "two"}) {
    for (const auto& pose : posesOf(all, label)) {
      const auto& robot = robotPose(pose);
      const auto unperturbed = observedPose(timeOf(robot));
      const auto& before = robotPose(unperturbed);
      EXPECT_EQ(robot.sensorPose, before.sensorPose);
      EXPECT_TRUE(robot.pose.cov == before.pose.cov);
      EXPECT_GT(robot.pose.mean.distanceTo(before.pose.mean), 1e-5);
      EXPECT_LT(robot.pose.mean.distanceTo(before.pose.mean), 0.2);
    }
  }
  std::size_t others = 0;
  for (const auto& observation : all) {
    const auto origin = poseSourceOf(*observation);
    others += !origin || origin->kind != PoseKind::kPose ? 1 : 0;
  }
  EXPECT_EQ(others, original.size() - 2 * 21) << "packets and odometry";
}

TEST(PerturbedRecording, DelaysPosesAndChangesNone) {
  TrackerFaults faults;
  faults.latency_ns = 100 * kMillisecond;
  const Observations all = perturbed(faults);
  EXPECT_EQ(all.size(), twoTrackers().size());
  std::int64_t newest_ns = 0;
  std::size_t late = 0;
  for (const auto& observation : all) {
    const std::int64_t t_ns = timeOf(*observation);
    newest_ns = std::max(newest_ns, t_ns);
    if (observation->sensorLabel != "one") continue;
    EXPECT_EQ(robotPose(observation).pose.mean.asTPose(), observedPose(t_ns)->pose.mean.asTPose())
        << "to the bit";
    if (t_ns > kStartNs + 300 * kMillisecond) continue;
    EXPECT_GE(newest_ns - t_ns,
              98 * kMillisecond);  // with the pose of its time, before that packet
    EXPECT_LE(newest_ns - t_ns, 100 * kMillisecond);
    ++late;
  }
  EXPECT_EQ(late, 16U);
  faults.dropouts.drop_probability = 0.3;
  const Observations fewer = posesOf(perturbed(faults), "one");
  EXPECT_LT(fewer.size(), 21U);
  for (const auto& pose : fewer) {
    EXPECT_EQ(robotPose(pose).pose.mean, observedPose(timeOf(*pose))->pose.mean);
  }
  auto listed = std::make_unique<ListedRecording>(twoTrackers());
  const ListedRecording& source = *listed;
  PerturbedRecording recording(std::move(listed), {});
  EXPECT_EQ(timeOf(*recording.next()), kStartNs);
  EXPECT_EQ(source.read(), 1U) << "nothing is read ahead without noise per keyframe";
}

TEST(PerturbedRecording, LatePosesBeforeACutAreNotLost) {
  TrackerFaults faults;
  faults.latency_ns = 100 * kMillisecond;
  TimeCut cut(std::make_unique<PerturbedRecording>(std::make_unique<ListedRecording>(twoTrackers()),
                                                   faults),
              kStartNs + 210 * kMillisecond, kStartNs + 300 * kMillisecond);
  bool nearest_before = false;
  while (const auto observation = cut.next()) {
    if (timeOf(*observation) == kStartNs + 200 * kMillisecond &&
        observation->sensorLabel == "two") {
      nearest_before = true;
    }
  }
  EXPECT_TRUE(nearest_before);
}

TEST(PerturbedRecording, ReturnsTheObservationsBeforeAnError) {
  TrackerFaults faults = keyframeNoise();
  for (const std::int64_t latency_ns : {0 * kMillisecond, 100 * kMillisecond}) {
    faults.latency_ns = latency_ns;
    PerturbedRecording recording(std::make_unique<ListedRecording>(twoTrackers(), true), faults);
    std::size_t count = 0;
    EXPECT_EQ(messageOf([&] {
                while (recording.next()) ++count;
              }),
              "the tape is torn");
    EXPECT_EQ(count, perturbed(faults).size());
  }
}

TEST(PerturbedRecording, AnErrorNamesTheEntryOfAPoseOutOfOrder) {
  PerturbedRecording recording(std::make_unique<ListedRecording>(Observations{
                                   observedPose(kStartNs), observedPose(kStartNs - kMillisecond)}),
                               keyframeNoise());
  EXPECT_TRUE(recording.next());
  EXPECT_THAT(messageOf([&] { recording.next(); }),
              testing::HasSubstr("entry 2: the pose at 9.999000000 s comes after"));
}

}  // namespace
}  // namespace efm
