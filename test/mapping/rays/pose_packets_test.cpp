// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/rays/pose_packets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "mapping/rays/vote_displacement.h"
#include "test/mapping/keyframes/random_scene.h"

namespace efm {
namespace {

using test::RandomScene;

constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;
constexpr double kNear_m = 0.5;
constexpr double kFar_m = 5.0;

struct Recording {
  RigCamera camera{test::smallCamera(), {}, 0};
  UndistortionTable undistortion{camera.model};
  Trajectory trajectory;
  std::vector<Event> events;
  PacketGeometry geometry;
};

Recording makeRecording(std::uint32_t seed, std::size_t count = 3000) {
  RandomScene random(seed);
  Recording recording;
  recording.camera.T_rig_cam = random.pose(0.1, 0.3);
  recording.trajectory = random.motion(kStart_ns, 0.1, 3.0, 6.0);
  recording.events = random.events(recording.camera.model, count, kStart_ns, 100'000'000);
  const Rigid3 T_world_ref =
      *recording.trajectory.poseAt(kStart_ns + 50'000'000) * recording.camera.T_rig_cam;
  recording.geometry = {T_world_ref.inverse(), ReferenceView::of(recording.camera.model), kNear_m,
                        kFar_m};
  return recording;
}

PosePackets split(const Recording& recording, double error_px) {
  return splitIntoPosePackets(recording.events, recording.camera, recording.undistortion,
                              recording.trajectory, recording.geometry, {error_px});
}

Eigen::Vector2d meet(const Recording& recording, const Rigid3& T_ref_cam, const Event& event,
                     double depth_m) {
  const Eigen::Vector3d direction =
      T_ref_cam.rotation * recording.undistortion.ray(event.x, event.y).homogeneous();
  const double along = (depth_m - T_ref_cam.translation.z()) / direction.z();
  return recording.geometry.view.project(T_ref_cam.translation + along * direction);
}

/// The largest error of an event's vote on any plane with its packet's pose.
double misplacement(const Recording& recording, const PosePacket& packet, const Event& event) {
  const Rigid3 T_ref_cam = recording.geometry.T_ref_world *
                           *recording.trajectory.poseAt(event.t_ns) * recording.camera.T_rig_cam;
  double max_px = 0;
  for (const double depth_m : {kNear_m, 1.0, 2.0, kFar_m}) {
    const Eigen::Vector2d exact = meet(recording, T_ref_cam, event, depth_m);
    const ReferenceView& view = recording.geometry.view;
    if (exact.x() < 0 || exact.y() < 0 || exact.x() > view.width || exact.y() > view.height) {
      continue;
    }
    const Eigen::Vector2d shared = meet(recording, packet.T_ref_cam, event, depth_m);
    max_px = std::max(max_px, (shared - exact).norm());
  }
  return max_px;
}

/// The largest misplacement of any event's vote, in units of the bound.
double errorOverBound(const Recording& recording, double error_px) {
  double max_px = 0;
  for (const PosePacket& packet : split(recording, error_px).packets) {
    for (std::size_t i = packet.begin; i < packet.end; ++i) {
      max_px = std::max(max_px, misplacement(recording, packet, recording.events[i]));
    }
  }
  return max_px / error_px;
}

/// Between the rays that are measured the motion field bends by a few percent.
constexpr double kBend = 1.05;

TEST(PosePackets, SharingAPoseMovesNoVoteBeyondTheBound) {
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    const Recording recording = makeRecording(seed);
    for (const double error_px : {0.01, 0.1, 1.0}) {
      EXPECT_LE(errorOverBound(recording, error_px), kBend) << "seed " << seed;
    }
  }
}

TEST(PosePackets, ACameraThatRotatesAroundANearPointIsBoundedFarAwayToo) {
  Recording recording = makeRecording(1, 500);
  recording.camera.T_rig_cam = {};
  recording.trajectory = Trajectory();
  for (int i = 0; i <= 20; ++i) {
    // On a circle around the point 0.5 m ahead of the first pose, always looking at it.
    const double angle = 0.01 * i;
    const Eigen::Quaterniond rotation(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()));
    const Eigen::Vector3d centre(0, 0, kNear_m);
    recording.trajectory.add({kStart_ns + i * 5'000'000, {rotation, centre - rotation * centre}});
  }
  recording.geometry.T_ref_world = recording.trajectory.poses().front().T_world_rig.inverse();
  EXPECT_LE(errorOverBound(recording, 0.05), kBend);
}

TEST(PosePackets, FewPosesAndLargeRotationsBetweenThemKeepTheBound) {
  RandomScene random(9);
  Recording recording = makeRecording(9, 2000);
  recording.trajectory = Trajectory();
  Rigid3 T_world_rig = random.pose(0.1, 0.1);
  for (int i = 0; i < 4; ++i) {
    recording.trajectory.add({kStart_ns + i * 40'000'000, T_world_rig});
    T_world_rig = T_world_rig * random.pose(0.3, 1.0);
  }
  recording.geometry.T_ref_world =
      (*recording.trajectory.poseAt(kStart_ns + 50'000'000) * recording.camera.T_rig_cam).inverse();
  for (const double error_px : {0.05, 1.0}) {
    EXPECT_LE(errorOverBound(recording, error_px), kBend);
  }
}

/// The number of packets if each is measured by itself, at its middle and both ends, never by the
/// speed in a longer interval.
std::size_t packetsMeasuredOneByOne(const Recording& recording, double error_px, std::size_t begin,
                                    std::size_t end) {
  const VoteGrid grid(recording.undistortion, recording.geometry.view, kNear_m, kFar_m);
  const auto votes_at = [&](std::int64_t t_ns) {
    return grid.votesFrom(recording.geometry.T_ref_world * *recording.trajectory.poseAt(t_ns) *
                          recording.camera.T_rig_cam);
  };
  const std::int64_t first_ns = recording.events[begin].t_ns;
  const std::int64_t last_ns = recording.events[end - 1].t_ns;
  if (first_ns == last_ns) return 1;
  const std::int64_t middle_ns = first_ns + (last_ns - first_ns) / 2;
  const GridVotes first = votes_at(first_ns);
  const GridVotes middle = votes_at(middle_ns);
  const GridVotes last = votes_at(last_ns);
  const auto motion = VoteDisplacement::measure(first_ns, last_ns, {&first, &middle, &last});
  if (motion && motion->fromMiddle() <= error_px) return 1;
  std::size_t half = begin;
  while (recording.events[half].t_ns <= middle_ns) ++half;
  return packetsMeasuredOneByOne(recording, error_px, begin, half) +
         packetsMeasuredOneByOne(recording, error_px, half, end);
}

TEST(PosePackets, AreThoseOfMeasuringEachByItself) {
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    const Recording recording = makeRecording(seed, 20'000);
    const std::vector<StampedPose>& poses = recording.trajectory.poses();
    std::size_t expected = 0;
    std::size_t begin = 0;
    for (std::size_t i = 1; i < poses.size() && begin < recording.events.size(); ++i) {
      std::size_t end = begin;
      while (end < recording.events.size() && recording.events[end].t_ns < poses[i].t_ns) ++end;
      if (end > begin) expected += packetsMeasuredOneByOne(recording, 0.05, begin, end);
      begin = end;
    }
    const std::size_t actual = split(recording, 0.05).packets.size();
    EXPECT_NEAR(static_cast<double>(actual), static_cast<double>(expected),
                0.01 * static_cast<double>(expected));
    EXPECT_GT(expected, 300U);
  }
}

TEST(PosePackets, ACameraThatStandsStillNeedsOnePacketPerPose) {
  Recording recording = makeRecording(8, 1000);
  recording.trajectory = Trajectory();
  for (int i = 0; i <= 2; ++i) recording.trajectory.add({kStart_ns + i * 50'000'000, {}});
  EXPECT_EQ(split(recording, 0.02).packets.size(), 2U);
}

TEST(PosePackets, EveryEventIsInOnePacket) {
  const Recording recording = makeRecording(3);
  for (const double error_px : {0.0, 0.02, 1.0}) {
    const PosePackets packets = split(recording, error_px);
    std::size_t next = 0;
    for (const PosePacket& packet : packets.packets) {
      EXPECT_EQ(packet.begin, next);
      EXPECT_LT(packet.begin, packet.end);
      next = packet.end;
    }
    EXPECT_EQ(next, recording.events.size());
    EXPECT_EQ(packets.without_pose, 0U);
  }
}

TEST(PosePackets, ABoundOfZeroGivesEveryTimeItsOwnPose) {
  const Recording recording = makeRecording(4, 500);
  for (const PosePacket& packet : split(recording, 0).packets) {
    const std::int64_t t_ns = recording.events[packet.begin].t_ns;
    EXPECT_EQ(recording.events[packet.end - 1].t_ns, t_ns);
    EXPECT_LT(misplacement(recording, packet, recording.events[packet.begin]), 1e-9);
  }
}

TEST(PosePackets, EventsWithoutAPoseAreCountedAndLeftOut) {
  Recording recording = makeRecording(6);
  Trajectory with_gap({0.02});
  for (const StampedPose& pose : recording.trajectory.poses()) {
    const std::int64_t t_ns = pose.t_ns - kStart_ns;
    if (t_ns >= 10'000'000 && t_ns <= 90'000'000 && (t_ns <= 40'000'000 || t_ns >= 70'000'000)) {
      with_gap.add(pose);
    }
  }
  recording.trajectory = with_gap;
  const PosePackets packets = split(recording, 0.02);
  std::size_t posed = 0;
  for (const PosePacket& packet : packets.packets) posed += packet.end - packet.begin;
  std::size_t expected = 0;
  for (const Event& event : recording.events) {
    expected += recording.trajectory.poseAt(event.t_ns).has_value() ? 1 : 0;
  }
  EXPECT_EQ(posed, expected);
  EXPECT_EQ(packets.without_pose, recording.events.size() - expected);
  EXPECT_GT(packets.without_pose, recording.events.size() / 3);
}

TEST(PosePackets, AnEventExactlyAtTheLastPoseHasIt) {
  Recording recording = makeRecording(7, 1);
  recording.events[0].t_ns = recording.trajectory.poses().back().t_ns;
  const PosePackets packets = split(recording, 0.02);
  ASSERT_EQ(packets.packets.size(), 1U);
  EXPECT_EQ(packets.without_pose, 0U);
}

TEST(PosePackets, OptionsOutOfRangeAreNamed) {
  EXPECT_THAT([] { PosePacketsOptions{-0.1}.validate(); },
              ::testing::ThrowsMessage<std::invalid_argument>(
                  ::testing::HasSubstr("packet_error_px = -0.1")));
}

}  // namespace
}  // namespace efm
