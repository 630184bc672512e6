// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/rays/rays.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

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
  // A vote without motion is at its ray: the corner's is the last one that the lens sees.
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

/// Votes in front of the camera and near the view, the first of them at (x, y).
GridVotes votesWithOneAt(double x, double y) {
  GridVotes votes;
  votes.in_front.fill(true);
  votes.near_view.fill(true);
  votes.x[0] = x;
  votes.y[0] = y;
  return votes;
}

/// An interval of 100 us in which one vote moves 10 px along x, a little faster towards the end.
std::optional<VoteDisplacement> accelerated(const std::array<GridVotes, 3>& votes) {
  return VoteDisplacement::measure(kGridStart_ns, kGridStart_ns + 100'000,
                                   {&votes[0], &votes[1], &votes[2]});
}

TEST(VoteDisplacement, IsExactAlongAParabola) {
  // 9.5 t + 0.5 t^2 and back again with t from 0 to 1, along either axis.
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

}  // namespace
}  // namespace efm
