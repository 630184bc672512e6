// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "mapping/rays/rays.h"
#include "test/mapping/keyframes/random_scene.h"

namespace efm {
namespace {

using test::RandomScene;

constexpr std::int64_t kGridStart_ns = 1'700'000'000'000'000'000;
constexpr double kNearPlane_m = 0.5;
constexpr double kFarPlane_m = 5.0;

TEST(VoteGrid, VotesAreWhereTheRaysOfTheSensorMeetThePlanes) {
  const CameraModel model = test::smallCamera();
  const UndistortionTable undistortion(model);
  const ReferenceView view = ReferenceView::of(model);
  const VoteGrid grid(undistortion, view, kNearPlane_m, kFarPlane_m);
  RandomScene random(1);
  for (int trial = 0; trial < 50; ++trial) {
    const Rigid3 T_ref_cam = random.pose(2, M_PI);
    const GridVotes votes = grid.votesFrom(T_ref_cam);
    for (std::size_t i = 0; i < GridVotes::kVotes; ++i) {
      const double depth_m = i < GridVotes::kRays ? kNearPlane_m : kFarPlane_m;
      const auto position = static_cast<int>(i % GridVotes::kRays);
      const int x = (position % 3) * (model.width - 1) / 2;
      const int y = (position / 3) * (model.height - 1) / 2;
      const Eigen::Vector3d direction = T_ref_cam.rotation * undistortion.ray(x, y).homogeneous();
      const double along = (depth_m - T_ref_cam.translation.z()) / direction.z();
      EXPECT_EQ(votes.in_front[i], along > 0);
      const Eigen::Vector2d exact = view.project(T_ref_cam.translation + along * direction);
      EXPECT_NEAR(votes.x[i], exact.x(), 1e-9 * (10 + exact.squaredNorm()));
      EXPECT_NEAR(votes.y[i], exact.y(), 1e-9 * (10 + exact.squaredNorm()));
      const bool near = exact.x() >= -48 && exact.x() <= 96 && exact.y() >= -36 && exact.y() <= 72;
      EXPECT_EQ(votes.near_view[i], near) << "at most its own size away";
    }
  }
}

TEST(VoteGrid, ACornerOutsideTheLensStandsForTheNextPixelInside) {
  const CameraModel model = test::foldingCamera();
  const UndistortionTable undistortion(model);
  ASSERT_FALSE(undistortion.hasRay(0, 0));
  ReferenceView view = ReferenceView::of(model);
  const GridVotes votes =
      VoteGrid(undistortion, view, kNearPlane_m, kFarPlane_m).votesFrom(Rigid3());
  // A vote without motion is at its ray. The corner's vote is at the last ray of the lens.
  const double corner = std::hypot(votes.x[0] - model.cx, votes.y[0] - model.cy);
  double largest = 0;
  for (int x = 0; x < model.width; ++x) {
    for (int y = 0; y < model.height; ++y) {
      if (!undistortion.hasRay(x, y)) continue;
      largest = std::max(largest, undistortion.ray(x, y).norm() * model.fx);
    }
  }
  EXPECT_GT(corner, 0.7 * largest);
  for (std::size_t i = 0; i < GridVotes::kVotes; ++i) {
    EXPECT_LT(std::hypot(votes.x[i] - model.cx, votes.y[i] - model.cy), 1.1 * largest);
  }
}

/// Returns votes in front of the camera and near the view. The first vote is at (x, y).
GridVotes votesWithOneAt(double x, double y) {
  GridVotes votes;
  votes.in_front.fill(true);
  votes.near_view.fill(true);
  votes.x[0] = x;
  votes.y[0] = y;
  return votes;
}

/// Measures the displacement of votes in an interval of 100 us.
std::optional<VoteDisplacement> accelerated(const std::array<GridVotes, 3>& votes) {
  return VoteDisplacement::measure(kGridStart_ns, kGridStart_ns + 100'000,
                                   {&votes[0], &votes[1], &votes[2]});
}

TEST(VoteDisplacement, IsExactAlongAParabola) {
  // The vote moves by 9.5 t + 0.5 t^2 px (t from 0 to 1), forth or back, along x or y.
  for (const bool along_x : {true, false}) {
    for (const bool back : {false, true}) {
      const auto way = [&](double t) {
        const double from_start = back ? 1 - t : t;
        return 9.5 * from_start + 0.5 * from_start * from_start;
      };
      const auto at = [&](double t) {
        return along_x ? votesWithOneAt(way(t), 3) : votesWithOneAt(3, way(t));
      };
      const auto motion = accelerated({at(0), at(0.5), at(1)});
      ASSERT_TRUE(motion.has_value());
      EXPECT_TRUE(motion->isEven());
      EXPECT_NEAR(motion->fromMiddle(), 9.5 * 0.5 + 0.5 * 0.75, 1e-12);
      EXPECT_NEAR(motion->between(kGridStart_ns, kGridStart_ns + 100'000), 10, 1e-9);
      EXPECT_NEAR(motion->between(kGridStart_ns + 20'000, kGridStart_ns + 30'000),
                  std::abs(way(0.3) - way(0.2)), 1e-9);
    }
  }
}

TEST(VoteDisplacement, IsEvenWhereTheSpeedChangesByATenthOfTheLargerStepAtMost) {
  for (const double second_px : {10.0, 9.01, 8.99}) {
    for (const bool back : {false, true}) {
      const double middle_px = back ? second_px : 10;
      const auto motion = accelerated(
          {votesWithOneAt(0, 0), votesWithOneAt(middle_px, 0), votesWithOneAt(10 + second_px, 0)});
      EXPECT_EQ(motion->isEven(), second_px > 9) << second_px;
    }
  }
}

TEST(VoteDisplacement, OfAVoteThatComesOrGoesIsUnknownAndOfOneBehindTheCameraNothing) {
  const std::array<GridVotes, 3> votes{votesWithOneAt(0, 0), votesWithOneAt(5, 0),
                                       votesWithOneAt(10, 0)};
  std::array<GridVotes, 3> behind = votes;
  for (std::size_t i = 0; i < 3; ++i) {
    std::array<GridVotes, 3> comes_or_goes = votes;
    comes_or_goes[i].in_front[7] = false;
    EXPECT_FALSE(accelerated(comes_or_goes).has_value()) << i;
    behind[i].in_front[0] = false;
  }
  EXPECT_EQ(accelerated(behind)->fromMiddle(), 0);
}

TEST(VoteDisplacement, FarFromTheViewCountsOnlyWhereNothingIsNearer) {
  std::array<GridVotes, 3> votes{votesWithOneAt(0, 0), votesWithOneAt(5, 0), votesWithOneAt(10, 0)};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(accelerated(votes)->fromMiddle(), 5) << "near at one of the times";
    votes[i].near_view[0] = false;
  }
  EXPECT_EQ(accelerated(votes)->fromMiddle(), 0);
  for (GridVotes& at_one_time : votes) at_one_time.near_view.fill(false);
  EXPECT_EQ(accelerated(votes)->fromMiddle(), 5);
}

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

/// Returns the largest error (pixels) of an event's vote on any plane with its packet's pose.
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

/// Expects that votes are misplaced by at most `error_px`, and that packets have all events.
void expectWithin(const Recording& recording, double error_px) {
  // The motion field bends by a few percent between the measured rays.
  constexpr double kBend = 1.05;
  const PosePackets packets = split(recording, error_px);
  EXPECT_EQ(packets.without_pose, 0U);
  std::size_t next = 0;
  for (const PosePacket& packet : packets.packets) {
    EXPECT_EQ(packet.begin, next);
    ASSERT_LT(packet.begin, packet.end);
    next = packet.end;
    const Event& last = recording.events[packet.end - 1];
    if (error_px == 0) {
      EXPECT_EQ(recording.events[packet.begin].t_ns, last.t_ns);
    }
    for (std::size_t i = packet.begin; i < packet.end; ++i) {
      ASSERT_LE(misplacement(recording, packet, recording.events[i]), kBend * error_px + 1e-9);
    }
  }
  EXPECT_EQ(next, recording.events.size());
}

TEST(PosePackets, SharingAPoseMovesNoVoteBeyondTheBound) {
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    for (const double error_px : {0.0, 0.01, 0.1, 1.0}) {
      expectWithin(makeRecording(seed), error_px);
    }
  }
}

TEST(PosePackets, ACameraThatRotatesAroundANearPointIsBoundedFarAwayToo) {
  Recording recording = makeRecording(1, 500);
  recording.camera.T_rig_cam = {};
  recording.trajectory = Trajectory();
  for (int i = 0; i <= 20; ++i) {
    // The camera circles a point 0.5 m ahead of the first pose and always looks at the point.
    const Eigen::Quaterniond rotation = rotationBy({0, 0.01 * i, 0});
    const Eigen::Vector3d centre(0, 0, kNear_m);
    recording.trajectory.add({kStart_ns + i * 5'000'000, {rotation, centre - rotation * centre}});
  }
  recording.geometry.T_ref_world = recording.trajectory.poses().front().T_world_rig.inverse();
  expectWithin(recording, 0.05);
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
  for (const double error_px : {0.05, 1.0}) expectWithin(recording, error_px);
}

/// Returns the number of packets if each packet is measured alone, at its middle and both ends,
/// without the speed in a longer interval.
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

TEST(PosePackets, EventsWithoutAPoseAreCountedAndLeftOutThoseAtALonePoseAreNot) {
  Recording recording = makeRecording(6);
  recording.events[1500].t_ns = kStart_ns + 55'000'000;
  recording.events[2700].t_ns = kStart_ns + 90'000'000;
  std::sort(recording.events.begin(), recording.events.end(),
            [](const Event& a, const Event& b) { return a.t_ns < b.t_ns; });
  Trajectory with_gap({0.01});
  for (const StampedPose& pose : recording.trajectory.poses()) {
    const std::int64_t t_ns = pose.t_ns - kStart_ns;
    const bool in_gap = t_ns > 40'000'000 && t_ns < 70'000'000 && t_ns != 55'000'000;
    if (t_ns >= 10'000'000 && t_ns <= 90'000'000 && !in_gap) with_gap.add(pose);
  }
  recording.trajectory = with_gap;
  const PosePackets packets = split(recording, 0.02);
  std::size_t posed = 0;
  for (const PosePacket& packet : packets.packets) {
    posed += packet.end - packet.begin;
    for (std::size_t i = packet.begin; i < packet.end; ++i) {
      ASSERT_TRUE(recording.trajectory.poseAt(recording.events[i].t_ns));
      ASSERT_LE(misplacement(recording, packet, recording.events[i]), 0.025);
    }
  }
  std::size_t expected = 0;
  for (const Event& event : recording.events) {
    expected += recording.trajectory.poseAt(event.t_ns).has_value() ? 1 : 0;
  }
  EXPECT_EQ(posed, expected);
  EXPECT_EQ(packets.without_pose, recording.events.size() - expected);
  EXPECT_GT(packets.without_pose, recording.events.size() / 3);
}

// --- The rays of packets ------------------------------------------------------------------------

std::vector<Event> onePerPixel(const CameraModel& model) {
  std::vector<Event> events;
  for (int y = 0; y < model.height; ++y) {
    for (int x = 0; x < model.width; ++x) {
      events.push_back({0, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), true});
    }
  }
  return events;
}

TEST(BackProjection, TheTransferMeetsEveryPlaneWhereTheRayItselfDoes) {
  const CameraModel model = test::smallCamera();
  const UndistortionTable undistortion(model);
  const ReferenceView view = ReferenceView::of(model);
  const std::vector<Event> events = onePerPixel(model);
  RandomScene random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Rigid3 T_ref_cam = random.pose(0.4, 0.5);
    const RayBundle rays =
        backProject(events, {{{0, events.size(), T_ref_cam}}, 0}, undistortion, view);
    ASSERT_EQ(rays.packets.size(), 1U);
    for (const double depth_m : {0.5, 1.0, 5.0, 80.0}) {
      const PlaneTransfer transfer = transferToPlane(rays.packets[0], view, depth_m);
      EXPECT_TRUE(transfer.in_front);
      for (std::size_t i = 0; i < events.size(); ++i) {
        const Eigen::Vector3d direction =
            T_ref_cam.rotation * undistortion.ray(events[i].x, events[i].y).homogeneous();
        const double along = (depth_m - T_ref_cam.translation.z()) / direction.z();
        const Eigen::Vector2d exact = view.project(T_ref_cam.translation + along * direction);
        const Eigen::Vector2d transferred(transfer.scale * rays.x_inf[i] + transfer.offset_x,
                                          transfer.scale * rays.y_inf[i] + transfer.offset_y);
        // Coordinates on the plane at infinity are floats and computed in float.
        EXPECT_NEAR((transferred - exact).norm(), 0, 2e-6 * (10 + exact.norm()));
      }
    }
  }
}

/// A camera with 1280 x 720 pixels.
struct HdCamera {
  CameraModel model{1280,
                    720,
                    905.0,
                    904.0,
                    641.3,
                    357.8,
                    DistortionModel::kRadtan,
                    {-0.09, 0.06, 0.0004, -0.0003}};
  UndistortionTable undistortion{model};
  ReferenceView view = ReferenceView::of(model);
};

TEST(BackProjection, FloatsAreOffByLessThanAThousandthOfAPixelAtHd) {
  const HdCamera hd;
  const std::vector<Event> events = onePerPixel(hd.model);
  RandomScene random(2);
  for (int trial = 0; trial < 4; ++trial) {
    const Rigid3 T_ref_cam = random.pose(0.4, 0.3);
    const RayBundle rays =
        backProject(events, {{{0, events.size(), T_ref_cam}}, 0}, hd.undistortion, hd.view);
    ASSERT_EQ(rays.size(), events.size());
    double largest_px = 0;
    for (std::size_t i = 0; i < events.size(); ++i) {
      const Eigen::Vector3d ray_cam = hd.undistortion.ray(events[i].x, events[i].y).homogeneous();
      const Eigen::Vector2d exact = hd.view.project(T_ref_cam.rotation * ray_cam);
      const bool in_view = exact.x() >= 0 && exact.x() < hd.view.width && exact.y() >= 0 &&
                           exact.y() < hd.view.height;
      if (!in_view) continue;
      const Eigen::Vector2d computed(rays.x_inf[i], rays.y_inf[i]);
      largest_px = std::max(largest_px, (computed - exact).norm());
    }
    // Six roundings of 2^-24 of numbers up to 1280 add up to at most 5e-4 px. 1e-3 px is a
    // twentieth of the error that shared poses may cause.
    EXPECT_LT(largest_px, 1e-3);
    EXPECT_GT(largest_px, 1e-6) << "something was compared";
  }
}

TEST(BackProjection, RaysParallelToThePlanesAreNotFinite) {
  CameraModel model = test::smallCamera();
  model.distortion = DistortionModel::kNone;
  model.coefficients.clear();
  model.cx = 20;  // rays of this column have x = 0
  // A rotation by 180 deg around (x + z) maps the z axis to the x axis.
  const Rigid3 T_ref_cam{Eigen::Quaterniond(0, std::sqrt(0.5), 0, std::sqrt(0.5)),
                         Eigen::Vector3d::Zero()};
  const std::vector<Event> events = onePerPixel(model);
  PosePackets packets{{{0, events.size(), T_ref_cam}}, 0};
  packets.packets[0].T_ref_cam.rotation.normalize();
  const RayBundle rays =
      backProject(events, packets, UndistortionTable(model), ReferenceView::of(model));
  EXPECT_EQ(rays.size(), events.size());
  const auto far_away = [](float x) { return !(std::abs(x) < 1e6F); };
  EXPECT_EQ(std::count_if(rays.x_inf.begin(), rays.x_inf.end(), far_away), model.height);
}

TEST(BackProjection, OfPlanesThoseBeforeTheCameraAlongItsRaysAreInFront) {
  const ReferenceView view = ReferenceView::of(test::smallCamera());
  for (const bool forward : {true, false}) {
    const RayPacket packet{0, 1, {0.1, 0.2, 1.0}, forward};
    EXPECT_FALSE(transferToPlane(packet, view, 1.0).in_front) << "on the plane";
    EXPECT_EQ(transferToPlane(packet, view, 1.0 + 1e-9).in_front, forward);
    EXPECT_EQ(transferToPlane(packet, view, 1.0 - 1e-9).in_front, !forward);
  }
}

TEST(BackProjection, RaysAreThoseOfTheLensInOrderForwardBeforeBackwardOfEachPacket) {
  RandomScene random(3);
  int split = 0;
  for (const CameraModel& model : {test::smallCamera(), test::foldingCamera()}) {
    const UndistortionTable undistortion(model);
    const ReferenceView view = ReferenceView::of(model);
    const std::vector<Event> events = onePerPixel(model);
    for (int trial = 0; trial < 20; ++trial) {
      // Events between the packets have no pose.
      const double most_rad = trial < 5 ? 0.2 : M_PI;
      const PosePackets packets{
          {{0, 700, random.pose(0.4, most_rad)}, {900, 1700, random.pose(0.4, most_rad)}}, 228};
      const RayBundle rays = backProject(events, packets, undistortion, view);
      std::vector<Eigen::Vector2d> expected;
      std::vector<RayPacket> expected_packets;
      for (const PosePacket& packet : packets.packets) {
        for (const bool forward : {true, false}) {
          const std::size_t begin = expected.size();
          for (std::size_t i = packet.begin; i < packet.end; ++i) {
            if (!undistortion.hasRay(events[i].x, events[i].y)) continue;
            const Eigen::Vector3d direction =
                packet.T_ref_cam.rotation *
                undistortion.ray(events[i].x, events[i].y).homogeneous();
            if ((direction.z() < 0) != forward) expected.push_back(view.project(direction));
          }
          if (expected.size() == begin) continue;
          expected_packets.push_back(
              {begin, expected.size(), packet.T_ref_cam.translation, forward});
        }
      }
      split += expected_packets.size() > 2 ? 1 : 0;
      ASSERT_EQ(rays.packets.size(), expected_packets.size());
      for (std::size_t p = 0; p < expected_packets.size(); ++p) {
        EXPECT_EQ(rays.packets[p].begin, expected_packets[p].begin);
        EXPECT_EQ(rays.packets[p].end, expected_packets[p].end);
        EXPECT_EQ(rays.packets[p].forward, expected_packets[p].forward);
        EXPECT_EQ(rays.packets[p].center_ref, expected_packets[p].center_ref);
      }
      ASSERT_EQ(rays.size(), expected.size());
      for (std::size_t i = 0; i < expected.size(); ++i) {
        EXPECT_NEAR(rays.x_inf[i], expected[i].x(), 1e-6 * (10 + expected[i].squaredNorm()));
        EXPECT_NEAR(rays.y_inf[i], expected[i].y(), 1e-6 * (10 + expected[i].squaredNorm()));
      }
    }
  }
  EXPECT_GT(split, 5) << "some packets look both ways";
}

}  // namespace

}  // namespace efm
