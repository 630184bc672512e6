// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/map_refinement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include "test/plugin/recordings/shaken_recording.h"
#include "test/plugin/session/session_driver.h"

namespace efm {
namespace {

using testing::HasSubstr;

/// Keyframes of a shaken recording, as the tracker has them.
std::vector<KeyframeDepthMap> shakenKeyframes(double duration_s = 1.2) {
  EventFusionOptions options = refinedOptions();
  options.refinement.enabled = false;
  MappingSession session(options);
  return mapAll(session, shaken(SyntheticRecording(duration_s)));
}

MapRefinementOptions refinementOptions(bool background) {
  MapRefinementOptions options;
  options.enabled = true;
  options.background = background;
  return options;
}

void addAll(MapRefinement& refinement, const std::vector<KeyframeDepthMap>& keyframes) {
  for (const KeyframeDepthMap& keyframe : keyframes) refinement.add(keyframe, std::nullopt);
}

void expectSamePoses(const std::map<std::size_t, Rigid3>& poses,
                     const std::map<std::size_t, Rigid3>& expected) {
  ASSERT_EQ(poses.size(), expected.size());
  for (const auto& [number, T_world_ref] : expected) {
    ASSERT_EQ(poses.count(number), 1U) << number;
    EXPECT_TRUE(isSame(poses.at(number), T_world_ref)) << "keyframe " << number;
  }
}

/// Those that were moved, by the refiner alone.
std::map<std::size_t, Rigid3> refinedAlone(const std::vector<KeyframeDepthMap>& keyframes) {
  const RefinementOptions options;
  KeyframeRefiner refiner(options);
  for (const KeyframeDepthMap& keyframe : keyframes) {
    refiner.add(RegistrationCloud(keyframe, options.points), keyframe.T_world_ref);
  }
  refiner.finish();
  return refiner.takeMoved();
}

class MapRefinementInEitherMode : public testing::TestWithParam<bool> {};

INSTANTIATE_TEST_SUITE_P(Background, MapRefinementInEitherMode, testing::Bool());

TEST_P(MapRefinementInEitherMode, EndsAtTheRefinersPoses) {
  const auto keyframes = shakenKeyframes();
  ASSERT_GE(keyframes.size(), 10U);
  MapRefinement refinement(refinementOptions(GetParam()));
  addAll(refinement, keyframes);
  refinement.finish();

  expectSamePoses(refinement.takeMoved(), refinedAlone(keyframes));
  const RefinementState state = refinement.state();
  EXPECT_EQ(state.waiting, 0U);
  EXPECT_GT(state.counts.registered, keyframes.size() / 2);
  EXPECT_GT(state.seconds, 0);
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(state.covariance).eigenvalues()(0), 0);
}

TEST_P(MapRefinementInEitherMode, MovesNothingWhenFinishedAgain) {
  MapRefinement refinement(refinementOptions(GetParam()));
  addAll(refinement, shakenKeyframes(0.7));
  refinement.finish();
  const auto moved = refinement.takeMoved();
  EXPECT_FALSE(moved.empty());
  EXPECT_TRUE(refinement.takeMoved().empty()) << "they were said";
  refinement.finish();
  for (const auto& [number, T_world_ref] : refinement.takeMoved()) {
    EXPECT_LT((T_world_ref.translation - moved.at(number).translation).norm(), 1e-5) << number;
  }
}

TEST_P(MapRefinementInEitherMode, FinishesWithoutKeyframes) {
  MapRefinement refinement(refinementOptions(GetParam()));
  refinement.finish();
  EXPECT_TRUE(refinement.takeMoved().empty());
  EXPECT_TRUE(isSame(refinement.state().T_world_odom, Rigid3{}));
}

TEST_P(MapRefinementInEitherMode, KeyframesWithoutPointsStayWithTheTracker) {
  auto keyframes = shakenKeyframes(0.7);
  for (KeyframeDepthMap& keyframe : keyframes) keyframe.map.depth.setTo(0);
  MapRefinement refinement(refinementOptions(GetParam()));
  addAll(refinement, keyframes);
  refinement.finish();
  EXPECT_EQ(refinement.state().counts.registered, 0U);
  for (const auto& [number, T_world_ref] : refinement.takeMoved()) {
    EXPECT_LT((T_world_ref.translation - keyframes[number].T_world_ref.translation).norm(), 1e-6);
  }
}

TEST(CovarianceAt, ARotationMovesTheRigAcrossItsLever) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto draw = [&] { return Eigen::Vector3d(number(random), number(random), number(random)); };
  for (int i = 0; i < 20; ++i) {
    // One motion alone: a shift and a small rotation.
    const Eigen::Vector3d shift = draw();
    const Eigen::Vector3d rotation = draw();
    const Eigen::Vector3d lever = 3 * draw();
    RefinementState state;
    state.T_world_ref_denoised.translation = draw();
    Vector6d motion;
    motion << shift, rotation;
    state.covariance = motion * motion.transpose();

    const Rigid3 T_world_rig{{}, state.T_world_ref_denoised.translation + lever};
    Vector6d moved;
    moved << shift + rotation.cross(lever), rotation;
    const Matrix6d expected =
        moved * moved.transpose() + state.tracker.driftCovariance(lever.norm());
    EXPECT_LT((covarianceAt(state, T_world_rig) - expected).cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(MapRefinement, KnowsThePoseOfAKeyframeThatItHasRefined) {
  MapRefinement refinement(refinementOptions(false));
  for (const KeyframeDepthMap& keyframe : shakenKeyframes()) {
    const Rigid3 T_world_ref = refinement.add(keyframe, std::nullopt);
    const auto moved = refinement.takeMoved();
    if (!moved.empty()) {
      EXPECT_TRUE(isSame(T_world_ref, moved.rbegin()->second));
    }
  }
}

TEST(MapRefinement, DoesNotWaitForTheBackground) {
  const auto keyframes = shakenKeyframes();
  MapRefinement refinement(refinementOptions(true));
  std::size_t most_waiting = 0;
  for (int round = 0; round < 2; ++round) {
    for (const KeyframeDepthMap& keyframe : keyframes) {
      refinement.add(keyframe, std::nullopt);
      most_waiting = std::max(most_waiting, refinement.state().waiting);
    }
  }
  EXPECT_GT(most_waiting, 0U);
  refinement.finish();
  EXPECT_EQ(refinement.state().waiting, 0U);
}

TEST(MapRefinement, MayEndWhileKeyframesWait) {
  const auto keyframes = shakenKeyframes(0.7);
  for (int round = 0; round < 5; ++round) {
    MapRefinement refinement(refinementOptions(true));
    for (int i = 0; i <= round; ++i) addAll(refinement, keyframes);
  }
}

TEST_P(MapRefinementInEitherMode, APoseThatIsNotFiniteIsRefusedAndChangesNothing) {
  auto keyframes = shakenKeyframes(0.7);
  MapRefinement refinement(refinementOptions(GetParam()));
  MapRefinement expected(refinementOptions(GetParam()));
  addAll(refinement, keyframes);
  addAll(expected, keyframes);

  KeyframeDepthMap wrong = keyframes.front();
  wrong.T_world_ref.translation.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(messageOf([&] { refinement.add(wrong, std::nullopt); }),
              HasSubstr("its pose is not finite"));
  refinement.finish();
  expected.finish();
  EXPECT_EQ(refinement.state().failures, 0U);
  expectSamePoses(refinement.takeMoved(), expected.takeMoved());
}

TEST(MapRefinement, OptionsThatAreNotValidAreErrors) {
  MapRefinementOptions options;
  options.refiner.window = 0;
  EXPECT_THROW(MapRefinement{options}, std::invalid_argument);
}

}  // namespace
}  // namespace efm
