// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>

#include <cmath>
#include <functional>
#include <memory>
#include <new>
#include <random>
#include <thread>
#include <vector>

#include "plugin/session/map_refinement.h"
#include "test/memory/failing_allocation.h"
#include "test/plugin/session/session_driver.h"
#include "test/plugin/session/synthetic_recording.h"

namespace efm {
namespace {

/// Returns keyframes of a shaken recording at the tracker's poses.
std::vector<KeyframeDepthMap> shakenKeyframes(double duration_s = 1.2) {
  EventFusionOptions options = refinedOptions();
  options.refinement.enabled = false;
  SessionOfRig session(options);
  return mapAll(session, shaken(SyntheticRecording(duration_s)));
}

MapRefinementOptions refinementOptions(bool background) {
  MapRefinementOptions options;
  options.enabled = true;
  options.background = background;
  return options;
}

/// Returns the keyframes that a refiner moves, without MapRefinement.
std::map<std::size_t, Rigid3> refinedAlone(const std::vector<KeyframeDepthMap>& keyframes) {
  const RefinementOptions options;
  KeyframeRefiner refiner(options);
  for (const KeyframeDepthMap& keyframe : keyframes) {
    refiner.add(RegistrationCloud(keyframe, options.points), keyframe.T_world_ref);
  }
  refiner.finish();
  return refiner.takeMoved();
}

/// A keyframe at `t_ns` of a tracker with a motion error c(t), whose window says what it is.
KeyframeDepthMap keyframeWith(const std::function<Rigid3(double)>& T_rig_true, std::int64_t t_ns,
                              const Rigid3& T_rig_ref) {
  KeyframeDepthMap keyframe;
  keyframe.window.t_ref_ns = t_ns;
  keyframe.T_rig_ref = T_rig_ref;
  keyframe.T_world_ref =
      Rigid3{Eigen::Quaterniond::Identity(), {1e-9 * double(t_ns), 0, 0}} * T_rig_ref;
  MotionCorrection& correction = keyframe.motion_correction.emplace();
  correction.spacing_s = 0.1;
  correction.reference = 3;
  for (std::size_t i = 0; i < 7; ++i) {
    // Relative to the error at the reference time, which the keyframe keeps.
    const double since_s = correction.sinceReference(i);
    const Rigid3 c = T_rig_true(1e-9 * double(t_ns) + since_s);
    correction.knots.emplace_back();
    correction.knots.back() << c.translation - T_rig_true(1e-9 * double(t_ns)).translation,
        Eigen::Vector3d::Zero();
  }
  return keyframe;
}

TEST(MotionBetween, IsThatOfTheEventsOfBothWindows) {
  const auto error = [](double t_s) {
    return Rigid3{Eigen::Quaterniond::Identity(), {0, 0.3 * t_s * t_s, 0}};
  };
  const Rigid3 T_rig_ref{rotationBy({0, 0, kPi / 2}), {0.2, 0, 0}};
  const KeyframeDepthMap a = keyframeWith(error, 0, T_rig_ref);
  const KeyframeDepthMap b = keyframeWith(error, 200'000'000, T_rig_ref);
  const KeyframeDepthMap far = keyframeWith(error, 400'000'000, T_rig_ref);
  KeyframeDepthMap without = b;
  without.motion_correction.reset();
  // In 0.2 s the tracker moves by 0.2 m along x, and its error by 0.012 m along y of the rig. The
  // view is turned: the rig's x is its -y, the rig's y is its x.
  const Eigen::Vector3d expected(0.012, -0.2, 0);
  for (const KeyframeDepthMap* to : {&b, static_cast<const KeyframeDepthMap*>(&without)}) {
    const auto motion = motionBetween(WindowMotion(a), WindowMotion(*to));
    ASSERT_TRUE(motion);
    EXPECT_LT((motion->translation - expected).norm(), 1e-9);
  }
  const auto by_to = motionBetween(WindowMotion(without), WindowMotion(far));
  ASSERT_TRUE(by_to);
  EXPECT_NEAR(by_to->translation.x(), 0.3 * (0.16 - 0.04), 1e-9);
  EXPECT_FALSE(motionBetween(WindowMotion(a), WindowMotion(far))) << "0.4 s apart, 0.3 s known";
  EXPECT_FALSE(motionBetween(WindowMotion(without), WindowMotion(without)));
  // The correction at 0.2 s is 0.012 m, its root mean square 0.3 times the walk of 0.04 m.
  const auto expecting = [&a](double walk_m) {
    KeyframeDepthMap keyframe = a;
    keyframe.motion_correction->walk_m = walk_m;
    return WindowMotion(keyframe);
  };
  EXPECT_TRUE(motionBetween(expecting(0.04), WindowMotion(without)));
  EXPECT_FALSE(motionBetween(expecting(0.006), WindowMotion(without))) << "4.5 sigma at 0.2 s";
  KeyframeDepthMap turned = a;
  turned.motion_correction->knots.back()[4] = 0.2;
  turned.motion_correction->walk_rad = 0.05;
  EXPECT_FALSE(motionBetween(WindowMotion(turned), WindowMotion(without))) << "in the window";
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
    if (GetParam()) continue;  // in the background, keyframes move at any time
    for (const auto& [number, T_new] : refinement.takeMoved()) moved[number] = T_new;
    if (moved.empty()) continue;
    EXPECT_TRUE(isSame(T_world_ref, moved.rbegin()->second));
  }
  refinement.finish();
  for (const auto& [number, T_new] : refinement.takeMoved()) moved[number] = T_new;
  EXPECT_TRUE(refinement.takeMoved().empty()) << "they were said";

  const std::map<std::size_t, Rigid3> expected = refinedAlone(keyframes);
  ASSERT_EQ(moved.size(), expected.size());
  for (const auto& [number, T_world_ref] : expected) {
    EXPECT_TRUE(isSame(moved.at(number), T_world_ref)) << "keyframe " << number;
  }
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

/// Corrections that wrong depths have bent: the poses are those without any correction.
TEST(MapRefinement, CorrectionsFarBeyondATrackersErrorsChangeNothing) {
  const std::vector<KeyframeDepthMap> keyframes = shakenKeyframes();
  const std::map<std::size_t, Rigid3> without = refinedAlone(keyframes);
  for (unsigned seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0, 0.05);  // metres and radians
    MapRefinement refinement(refinementOptions(false));
    for (KeyframeDepthMap keyframe : keyframes) {
      MotionCorrection& correction = keyframe.motion_correction.emplace();
      correction.spacing_s = 1;
      correction.reference = 1;
      correction.walk_m = 0.002;
      correction.walk_rad = 0.002;
      correction.knots.assign(3, Vector6d::Zero());
      for (const std::size_t end : {0, 2}) {
        for (double& value : correction.knots[end]) value = normal(random);
      }
      refinement.add(keyframe, std::nullopt);
    }
    refinement.finish();
    const std::map<std::size_t, Rigid3> moved = refinement.takeMoved();
    ASSERT_EQ(moved.size(), without.size());
    for (const auto& [number, pose] : without) EXPECT_TRUE(isSame(moved.at(number), pose));
  }
}

TEST(CovarianceAt, ARotationMovesTheRigAcrossItsLever) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto draw = [&] { return Eigen::Vector3d(number(random), number(random), number(random)); };
  for (int i = 0; i < 20; ++i) {
    // One motion only: a shift and a small rotation.
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

/// A refinement in the background. Memory fails once, while a keyframe is refined.
struct FailingBackground {
  RefinementState state;
  std::map<std::size_t, Rigid3> T_world_ref;
  std::vector<std::size_t> allocations;  ///< Sizes during this keyframe's refinement.

  FailingBackground(const std::vector<KeyframeDepthMap>& keyframes, std::size_t skipped) {
    MapRefinementOptions options;
    options.background = true;
    MapRefinement refinement(options);
    for (std::size_t i = 0; i < keyframes.size(); ++i) {
      if (i == 3) failAllocation(Allocating::kOtherThreads, skipped);
      refinement.add(keyframes[i], std::nullopt);
      // A keyframe that the refiner could not add waits for the next keyframe.
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
    if (disturbed.state.failures == 0) continue;  // sorting also works with less memory
    EXPECT_EQ(disturbed.state.failures, 1U);
    EXPECT_EQ(disturbed.state.last_error, std::bad_alloc().what());
    ++failures;
    if (HasFailure()) return;
  }
  EXPECT_GT(failures, 10U);
}

}  // namespace

// Tests a mapping session that refines the keyframes' poses.

namespace {

EventFusionOptions optionsOf(bool background) {
  EventFusionOptions options = refinedOptions();
  options.refinement.background = background;
  return options;
}

EventFusionOptions unrefinedOptions() {
  EventFusionOptions options = refinedOptions();
  options.refinement.enabled = false;
  return options;
}

/// Returns the root mean square distance of keyframes from the truth, after a common shift.
double distanceOf(const std::vector<StampedPose>& poses, const std::vector<StampedPose>& truth) {
  Eigen::Matrix3Xd apart(3, truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    apart.col(static_cast<Eigen::Index>(i)) =
        poses[i].T_world_rig.translation - truth[i].T_world_rig.translation;
  }
  apart.colwise() -= apart.rowwise().mean().eval();
  return apart.norm() / std::sqrt(static_cast<double>(truth.size()));
}

class RefinedSession : public testing::TestWithParam<bool> {};

INSTANTIATE_TEST_SUITE_P(Background, RefinedSession, testing::Bool());

TEST_P(RefinedSession, BringsKeyframesNearerToTheTruth) {
  const SyntheticRecording recording(2.0);
  SessionOfRig truth(unrefinedOptions());
  mapAll(truth, recording);
  SessionOfRig session(optionsOf(GetParam()));
  mapAll(session, shaken(recording));

  const double tracker_m = distanceOf(trackerPosesOf(session), posesOf(truth));
  EXPECT_GT(tracker_m, 0.01);
  EXPECT_LT(distanceOf(posesOf(session), posesOf(truth)), 0.75 * tracker_m);
  EXPECT_TRUE(isSame(posesOf(session)[0].T_world_rig, trackerPosesOf(session)[0].T_world_rig));
  const SessionStatus status = session.status();
  const std::size_t keyframes = posesOf(session).size();
  EXPECT_GT(status.refinement->counts.registered, keyframes / 2);
  EXPECT_LT(status.refinement->counts.registered, keyframes);
  EXPECT_EQ(status.refinement->waiting, 0U);
  EXPECT_GT(status.times.real.refine, 0);
  EXPECT_EQ(status.times.real.refine, status.refinement->seconds);
  EXPECT_EQ(status.times.cpu.refine, status.refinement->cpu_seconds);
}

TEST(Session, MakesTheSameMapFromPacketsOfAnyLength) {
  const SyntheticRecording recording = shaken(SyntheticRecording(1.2));
  for (const bool refined : {false, true}) {
    SessionOfRig at_once(refined ? optionsOf(false) : unrefinedOptions());
    mapAll(at_once, recording);
    for (const int packet_ms : {10, 70, 400}) {
      SessionOfRig piecewise(refined ? optionsOf(packet_ms == 70) : unrefinedOptions());
      mapPiecewise(piecewise, recording, packet_ms);
      expectSameMap(piecewise, at_once);
    }
  }
}

// --- Stated noise of the tracker ---------------------------------------------------------------

EventFusionOptions noiseOptions() {
  EventFusionOptions options = optionsOf(false);
  options.refinement.refiner.adapt_tracker = false;
  options.refinement.refiner.tracker.drift_m = 0;
  options.refinement.refiner.tracker.drift_rad = 0;
  return options;
}

using Noise = std::optional<PoseNoise>;

/// Maps the shaken recording. `add` adds the poses that a test makes of each pose.
std::unique_ptr<MappingSession> mapWith(
    const EventFusionOptions& options,
    const std::function<void(MappingSession&, const StampedPose&, std::size_t)>& add) {
  const SyntheticRecording recording = shaken(SyntheticRecording(1.2));
  auto session = std::make_unique<SessionOfRig>(options);
  for (std::size_t i = 0; i < recording.poses.size(); ++i) add(*session, recording.poses[i], i);
  addEvents(*session, recording);
  mapRest(*session);
  return session;
}

TEST(StatedNoise, CountsOnlyOfTheFirstPoseOfATimeAndItsSource) {
  const PoseNoise wrong{0.5, 0.5};
  const auto map = [&](const Noise& first, const Noise& others) {
    return mapWith(noiseOptions(), [&](auto& session, const auto& pose, std::size_t i) {
      session.add(sampleOf(pose, {}, i == 0 ? first : others));
    });
  };
  const PoseNoise certain{1e-4, 1e-5};
  const auto expected = map(certain, certain);
  const auto twice = mapWith(noiseOptions(), [&](auto& session, StampedPose pose, std::size_t) {
    session.add(sampleOf(pose, {}, certain));
    pose.T_world_rig.translation.z() += 1;
    session.add(sampleOf(pose, {}, wrong));
  });
  expectSameMap(*twice, *expected);
  EventFusionOptions options = noiseOptions();
  options.rig.pose_source = "tracker";
  const PoseSourceId tracker{PoseKind::kPose, "tracker"};
  const auto beside = mapWith(options, [&](auto& session, const auto& pose, std::size_t i) {
    session.add(
        sampleOf(pose, {i % 2 == 0 ? PoseKind::kPose : PoseKind::kOdometry, "other"}, wrong));
    session.add(sampleOf(pose, tracker, certain));
  });
  expectSameMap(*beside, *expected);
  expectSameMap(*map(wrong, std::nullopt), *map(std::nullopt, std::nullopt));
}

TEST_P(RefinedSession, AKeyframeThatTheMapOrTheRefinementRejectsDoesNotShiftTheOthers) {
  SyntheticRecording recording = shaken(SyntheticRecording(1.2));
  EventFusionOptions options = optionsOf(GetParam());
  options.mapper.trajectory.max_pose_gap_s = 0.02;
  SessionOfRig session(options);
  for (StampedPose pose : recording.poses) {
    const std::int64_t window = (pose.t_ns - SyntheticRecording::kStartNs) / kShakenWindowNs;
    if (window == 5) pose.T_world_rig.translation.z() += 1e18;  // here, voxels have no numbers
    const PoseNoise noise{window == 8 ? std::nan("") : 0.01, 0.005};
    session.add(sampleOf(pose, {}, noise));
  }
  addEvents(session, recording);
  session.finish();
  std::vector<KeyframeDepthMap> keyframes;
  int rejected = 0;
  for (bool more = true; more;) {
    try {
      auto keyframe = session.next();
      more = keyframe.has_value();
      if (keyframe) keyframes.push_back(std::move(*keyframe));
    } catch (const std::invalid_argument&) {
      ++rejected;
    }
  }
  EXPECT_EQ(rejected, 2);
  EXPECT_EQ(session.status().counts.dropped_windows[DropReason::kError], 2U);
  EXPECT_EQ(session.status().counts.keyframes, keyframes.size());
  const auto map = session.snapshot(false);
  ASSERT_EQ(map->trajectory.size(), keyframes.size());
  ASSERT_EQ(map->tracker_trajectory.size(), keyframes.size());
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    // The tracker's noise is 1 cm on each axis; the next keyframe is 8 cm away.
    const Eigen::Vector3d odom = map->tracker_trajectory[i].T_world_rig.translation;
    EXPECT_LT((map->trajectory[i].T_world_rig.translation - odom).norm(), 0.05) << "keyframe " << i;
  }
}

}  // namespace

}  // namespace efm
