// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/map_refinement.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <new>
#include <random>
#include <thread>
#include <vector>

#include "test/memory/failing_allocation.h"
#include "test/plugin/session/session_driver.h"
#include "test/plugin/session/synthetic_recording.h"

namespace efm {
namespace {

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
  std::map<std::size_t, Rigid3> moved;
  for (const KeyframeDepthMap& keyframe : keyframes) {
    const Rigid3 T_world_ref = refinement.add(keyframe, std::nullopt);
    if (GetParam()) continue;  // in the background they move at any time
    for (const auto& [number, T_new] : refinement.takeMoved()) moved[number] = T_new;
    if (moved.empty()) continue;
    EXPECT_TRUE(isSame(T_world_ref, moved.rbegin()->second));
  }
  refinement.finish();
  for (const auto& [number, T_new] : refinement.takeMoved()) moved[number] = T_new;
  EXPECT_TRUE(refinement.takeMoved().empty()) << "they were said";

  expectSamePoses(moved, refinedAlone(keyframes));
  const RefinementState state = refinement.state();
  EXPECT_EQ(state.waiting, 0U);
  EXPECT_GT(state.counts.registered, keyframes.size() / 2);
  EXPECT_GT(state.seconds, 0);
  EXPECT_GT(state.cpu_seconds, 0);
  EXPECT_GT(state.most_seconds, state.seconds / static_cast<double>(keyframes.size() + 2));
  EXPECT_LT(state.most_seconds, state.seconds);
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(state.covariance).eigenvalues()(0), 0);
  const Rigid3& T_odom_ref = keyframes[3].T_world_ref;
  EXPECT_TRUE(isSame(refinement.predict(T_odom_ref), state.T_world_odom * T_odom_ref));
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

TEST(MapRefinement, DoesNotWaitForTheBackgroundAndMayEndBeforeIt) {
  const auto keyframes = shakenKeyframes(0.7);
  MapRefinement refinement(refinementOptions(true));
  std::size_t most_waiting = 0;
  for (int round = 0; round < 5; ++round) {
    for (const KeyframeDepthMap& keyframe : keyframes) {
      refinement.add(keyframe, std::nullopt);
      most_waiting = std::max(most_waiting, refinement.state().waiting);
    }
  }
  EXPECT_GT(most_waiting, 0U);
}

/// A refinement in the background whose memory fails once, while it refines a keyframe.
struct FailingBackground {
  RefinementState state;
  std::map<std::size_t, Rigid3> T_world_ref;
  std::vector<std::size_t> allocations;  ///< For that keyframe.

  FailingBackground(const std::vector<KeyframeDepthMap>& keyframes, std::size_t skipped) {
    MapRefinementOptions options;
    options.background = true;
    MapRefinement refinement(options);
    for (std::size_t i = 0; i < keyframes.size(); ++i) {
      if (i == 3) failAllocation(Allocating::kOtherThreads, skipped);
      refinement.add(keyframes[i], std::nullopt);
      // A keyframe that the refiner could not take waits for the next one.
      while (refinement.state().waiting > refinement.state().failures) std::this_thread::yield();
      if (i == 3) allocations = stopFailing();
    }
    refinement.finish();
    EXPECT_NO_THROW(refinement.throwFailure()) << "it is counted";
    state = refinement.state();
    T_world_ref = refinement.takeMoved();
  }
};

TEST(MapRefinement, AFailureInTheBackgroundIsCountedAndTheNextKeyframeIsRefined) {
  const auto keyframes = shakenKeyframes(0.6);
  const FailingBackground undisturbed(keyframes, std::size_t(-1));
  EXPECT_EQ(undisturbed.state.failures, 0U);
  EXPECT_EQ(undisturbed.state.last_error, "");
  std::size_t failures = 0;
  for (const std::size_t skipped : rareOnes(undisturbed.allocations)) {
    SCOPED_TRACE("allocation " + std::to_string(skipped));
    const FailingBackground disturbed(keyframes, skipped);
    ASSERT_EQ(disturbed.T_world_ref.size(), keyframes.size());
    for (const auto& [number, T_world_ref] : disturbed.T_world_ref) {
      const Rigid3& T_odom_ref = keyframes[number].T_world_ref;
      EXPECT_LT((T_world_ref.translation - T_odom_ref.translation).norm(), 0.05) << number;
    }
    EXPECT_LT(
        (disturbed.T_world_ref.at(0).translation - keyframes[0].T_world_ref.translation).norm(),
        1e-9)
        << "the first keeps its pose by the tracker";
    EXPECT_EQ(disturbed.state.waiting, 0U);
    EXPECT_GE(disturbed.state.counts.registered + 1, undisturbed.state.counts.registered);
    if (disturbed.state.failures == 0) continue;  // the standard library sorts with less memory
    EXPECT_EQ(disturbed.state.failures, 1U);
    EXPECT_EQ(disturbed.state.last_error, std::bad_alloc().what());
    ++failures;
    if (HasFailure()) return;
  }
  EXPECT_GT(failures, 10U);
}

}  // namespace
}  // namespace efm
