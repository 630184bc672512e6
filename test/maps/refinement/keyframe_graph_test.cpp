// SPDX-License-Identifier: BSD-3-Clause
// Graphs of many keyframes.
#include "maps/refinement/keyframe_graph.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "edges.h"
#include "mapping/geometry/rigid3.h"
#include "random_poses.h"

namespace efm {
namespace {

using test::covarianceOf;
using test::drawMotion;
using test::metresApart;

/// Keyframes without points on a circle of 10 m, with a tracker that drifts as it is expected to,
/// and exact loops to the lap before.
struct Laps {
  static constexpr std::size_t kLap = 150;

  std::mt19937 random{3};
  std::vector<Rigid3> truth;
  KeyframeGraph graph{{}, {}, TrackerModel({}, false)};

  explicit Laps(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      const double yaw = 2 * M_PI * static_cast<double>(i) / kLap;
      truth.push_back(test::viewTurned(yaw, {10 * std::sin(yaw), 0, 10 * std::cos(yaw)}));
      addKeyframe(i);
      if (i >= kLap && i % 10 == 0) addLoop(i - kLap, i);
    }
  }

  void addKeyframe(std::size_t i) {
    RefinedKeyframe keyframe{RegistrationCloud(test::emptyKeyframe(test::smallView()), {}),
                             truth[i], truth[i], truth[i]};
    if (i > 0) {
      const RefinedKeyframe& last = graph.keyframes[i - 1];
      const Rigid3 motion = truth[i - 1].inverse() * truth[i];
      const double root_m = std::sqrt(motion.translation.norm());
      const TrackerErrors errors;
      keyframe.T_odom_ref = last.T_odom_ref * motion *
                            drawMotion(errors.drift_m * root_m, errors.drift_rad * root_m, random);
      keyframe.path_length_m = last.path_length_m + motion.translation.norm();
    }
    keyframe.T_world_ref = keyframe.T_world_ref_denoised = keyframe.T_odom_ref;
    keyframe.first_factor = graph.factors.size();
    graph.keyframes.push_back(std::move(keyframe));
  }

  void addLoop(std::size_t older, std::size_t newer) {
    RelativePoseFactor loop{older, newer, truth[older].inverse() * truth[newer],
                            sqrtInformation(covarianceOf(0.005, 0.1 * kRadiansPerDegree))};
    loop.robust = true;
    graph.factors.push_back(loop);
  }

  double rmsM() const {
    double squared = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      squared += std::pow(metresApart(graph.keyframes[i].T_world_ref, truth[i]), 2);
    }
    return std::sqrt(squared / static_cast<double>(truth.size()));
  }
};

TEST(SolveCondensed, IsNearlyAsGoodAsTheWholeGraph) {
  Laps whole(2 * kMaxSolvedTogether);
  Laps condensed(2 * kMaxSolvedTogether);
  const double before_m = whole.rmsM();
  PoseGraphOptions trusting;
  trusting.robust_sigmas = 1000;
  whole.graph.solveFrom(1, trusting);
  solveCondensed(condensed.graph, 1, trusting);
  EXPECT_EQ(condensed.graph.failed_solves, 0U);
  EXPECT_LT(whole.rmsM(), 0.5 * before_m);
  EXPECT_LT(condensed.rmsM(), 1.2 * whole.rmsM());
}

TEST(SolveCondensed, LeavesFixedKeyframesAndStepsBetweenOthers) {
  Laps laps(1500);
  const Laps before(1500);
  constexpr std::size_t kFirstFree = 400;
  solveCondensed(laps.graph, kFirstFree, {});
  for (std::size_t i = 0; i < 1500; ++i) {
    const RefinedKeyframe& keyframe = laps.graph.keyframes[i];
    const RefinedKeyframe& was = before.graph.keyframes[i];
    EXPECT_EQ(isSame(keyframe.T_world_ref, was.T_world_ref), i < kFirstFree) << i;
    if (i == 0) continue;
    const Rigid3 step = laps.graph.keyframes[i - 1].T_world_ref.inverse() * keyframe.T_world_ref;
    const Rigid3 step_was = before.graph.keyframes[i - 1].T_world_ref.inverse() * was.T_world_ref;
    // A correction of metres is spread over hundreds of steps of 0.4 m.
    EXPECT_LT(metresApart(step, step_was), 0.02) << i;
  }
}

TEST(SolveCondensed, WithoutAMinimumIsCountedAndMovesNothing) {
  Laps laps(600);
  laps.graph.factors.back().offset[0] = std::numeric_limits<double>::quiet_NaN();
  const Laps before(600);
  solveCondensed(laps.graph, 1, {});
  EXPECT_EQ(laps.graph.failed_solves, 1U);
  for (std::size_t i = 0; i < 600; ++i) {
    EXPECT_TRUE(isSame(laps.graph.keyframes[i].T_world_ref, before.graph.keyframes[i].T_world_ref));
  }
}

TEST(KeyframeGraph, OfTooManyPlacesTheMostRedundantOneLosesItsPoints) {
  std::mt19937 random(1);
  KeyframeDepthMap seen = test::seenFrom(test::edgesAround(20, random), {}, 0.0025, random);
  test::keepFirst(20, seen);
  KeyframeGraph graph{{}, {}, TrackerModel({}, false)};
  constexpr std::size_t kPlaces = 1000;
  constexpr std::size_t kTwice = 700;
  for (std::size_t i = 0; i <= kPlaces; ++i) {
    Rigid3 T_world_ref;
    T_world_ref.translation.x() = static_cast<double>(i == kTwice ? 2 : 10 * i);
    graph.keyframes.push_back({RegistrationCloud(seen, {}), T_world_ref, T_world_ref, T_world_ref});
    graph.addPlace(i);
    EXPECT_EQ(graph.places.size(), std::min(i + 1, kPlaces));
  }
  for (std::size_t i = 0; i <= kPlaces; ++i) {
    EXPECT_EQ(graph.keyframes[i].cloud.points().empty(), i == kTwice) << i;
  }
  EXPECT_EQ(graph.nearestViews().front(), kPlaces);
  EXPECT_EQ(graph.nearestViews().size(), 50U);
}

TEST(KeyframeGraph, RanksKeyframesByOverlapAndByTheDistanceOfWhatTheySee) {
  KeyframeDepthMap wall = test::emptyKeyframe(test::smallView());
  wall.map.depth = 2;
  wall.map.variance = 1e-4;
  KeyframeGraph graph{{}, {}, TrackerModel({}, false)};
  const Rigid3 poses[] = {test::viewTurned(0, {0, 0, 0}),      test::viewTurned(0, {0, 0, -4}),
                          test::viewTurned(M_PI, {1.8, 0, 0}), test::viewTurned(M_PI, {0.3, 0, 0}),
                          test::viewTurned(M_PI, {0.9, 0, 0}), test::viewTurned(M_PI, {0, 0, 0})};
  for (const Rigid3& T_world_ref : poses) {
    graph.keyframes.push_back({RegistrationCloud(wall, {}), T_world_ref, T_world_ref, T_world_ref});
  }
  using Numbers = std::vector<std::size_t>;
  // It sees (0, 0, -2), as keyframe 1 does from the other side.
  // Of the newest one's 160 columns, 2 m away at 130 pixels, 1.8 m are 117 and 0.9 m are 59.
  EXPECT_EQ(graph.bestOverlaps({0, 1, 2, 3, 4}, 0.1, 9), (Numbers{1, 3, 4, 2}));
  EXPECT_EQ(graph.bestOverlaps({0, 1, 2, 3, 4}, 0.1, 2), (Numbers{1, 3}));
  EXPECT_EQ(graph.bestOverlaps({2, 4}, 0.4, 9), (Numbers{4}));
  graph.places = {0, 1, 2, 3, 4};
  EXPECT_EQ(graph.nearestViews(), (Numbers{1, 3, 4, 2, 0}));
}

TEST(WindowGraph, TheErrorOfADenoisedPoseIsTheFirstPosesNoiseAndTheDriftSince) {
  std::vector<RefinedKeyframe> keyframes;
  for (const double path_length_m : {0.0, 0.7}) {
    keyframes.push_back({RegistrationCloud(test::emptyKeyframe(test::smallView()), {}), Rigid3{},
                         Rigid3{}, Rigid3{}, path_length_m});
  }
  WindowGraph window(keyframes, 1);
  TrackerErrors errors;
  errors.noise_m = 0.02;
  window.addTracker(errors);
  ASSERT_TRUE(window.solve({}));
  const auto covariance = window.denoisedCovariance({}, 1);
  ASSERT_TRUE(covariance);
  const Matrix6d expected = errors.noiseCovariance() + errors.driftCovariance(0.7);
  EXPECT_TRUE(covariance->isApprox(expected, 1e-6)) << *covariance << "\n" << expected;
}

}  // namespace
}  // namespace efm
