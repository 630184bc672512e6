// SPDX-License-Identifier: BSD-3-Clause
// A mapping session whose keyframes' poses are refined.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>

#include "test/plugin/session/session_driver.h"
#include "test/plugin/session/synthetic_recording.h"

namespace efm {
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

/// Root mean square distance of keyframes from where they are, after a shift of all.
double distanceOf(const std::vector<Rigid3>& T_world_ref, const std::vector<Rigid3>& truth) {
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < truth.size(); ++i) {
    shift += T_world_ref[i].translation - truth[i].translation;
  }
  shift /= static_cast<double>(truth.size());
  double squares = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    squares += (T_world_ref[i].translation - truth[i].translation - shift).squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(truth.size()));
}

/// How far a keyframe moved from where the tracker put it.
double motionOf(const MappingSession& session, std::size_t keyframe) {
  return (session.T_world_ref()[keyframe].translation - session.T_odom_ref()[keyframe].translation)
      .norm();
}

class RefinedSession : public testing::TestWithParam<bool> {};

INSTANTIATE_TEST_SUITE_P(Background, RefinedSession, testing::Bool());

TEST_P(RefinedSession, BringsKeyframesNearerToTheTruth) {
  const SyntheticRecording recording(2.0);
  MappingSession truth(unrefinedOptions());
  mapAll(truth, recording);
  MappingSession session(optionsOf(GetParam()));
  mapAll(session, shaken(recording));

  const double tracker_m = distanceOf(session.T_odom_ref(), truth.T_world_ref());
  EXPECT_GT(tracker_m, 0.01);
  EXPECT_LT(distanceOf(session.T_world_ref(), truth.T_world_ref()), 0.75 * tracker_m);
  EXPECT_TRUE(isSame(session.T_world_ref()[0], session.T_odom_ref()[0]));
  const SessionStatus status = session.status();
  const std::size_t keyframes = session.T_world_ref().size();
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
    MappingSession at_once(refined ? optionsOf(false) : unrefinedOptions());
    mapAll(at_once, recording);
    for (const int packet_ms : {10, 70, 400}) {
      MappingSession piecewise(refined ? optionsOf(packet_ms == 70) : unrefinedOptions());
      mapPiecewise(piecewise, recording, packet_ms);
      expectSameMap(piecewise, at_once);
    }
  }
}

// --- What the tracker says of its noise --------------------------------------------------------

EventFusionOptions noiseOptions() {
  EventFusionOptions options = optionsOf(false);
  options.refinement.refiner.adapt_tracker = false;
  options.refinement.refiner.tracker.drift_m = 0;
  options.refinement.refiner.tracker.drift_rad = 0;
  return options;
}

using Noise = std::optional<PoseNoise>;

/// Maps the shaken recording with all poses that are made of each.
std::unique_ptr<MappingSession> mapWith(
    const EventFusionOptions& options,
    const std::function<void(MappingSession&, const StampedPose&, std::size_t)>& add) {
  const SyntheticRecording recording = shaken(SyntheticRecording(1.2));
  auto session = std::make_unique<MappingSession>(options);
  for (std::size_t i = 0; i < recording.poses.size(); ++i) add(*session, recording.poses[i], i);
  addEvents(*session, recording);
  mapRest(*session);
  return session;
}

TEST(StatedNoise, CountsOnlyOfTheFirstPoseOfATimeAndItsSource) {
  const PoseNoise wrong{0.5, 0.5};
  const auto map = [&](const Noise& first, const Noise& others) {
    return mapWith(noiseOptions(), [&](auto& session, const auto& pose, std::size_t i) {
      session.addPose(pose, {}, i == 0 ? first : others);
    });
  };
  const PoseNoise certain{1e-4, 1e-5};
  const auto expected = map(certain, certain);
  const auto twice = mapWith(noiseOptions(), [&](auto& session, StampedPose pose, std::size_t) {
    session.addPose(pose, {}, certain);
    pose.T_world_rig.translation.z() += 1;
    session.addPose(pose, {}, wrong);
  });
  expectSameMap(*twice, *expected);
  EventFusionOptions options = noiseOptions();
  options.rig.pose_source = "tracker";
  const PoseSourceId tracker{PoseKind::kPose, "tracker"};
  const auto beside = mapWith(options, [&](auto& session, const auto& pose, std::size_t i) {
    session.addPose(pose, {i % 2 == 0 ? PoseKind::kPose : PoseKind::kOdometry, "other"}, wrong);
    session.addPose(pose, tracker, certain);
  });
  expectSameMap(*beside, *expected);
  expectSameMap(*map(wrong, std::nullopt), *map(std::nullopt, std::nullopt));
}

TEST_P(RefinedSession, AKeyframeThatTheMapOrTheRefinementRefusesDoesNotShiftTheOthers) {
  SyntheticRecording recording = shaken(SyntheticRecording(1.2));
  EventFusionOptions options = optionsOf(GetParam());
  options.mapper.trajectory.max_pose_gap_s = 0.02;
  MappingSession session(options);
  for (StampedPose pose : recording.poses) {
    const std::int64_t window = (pose.t_ns - SyntheticRecording::kStartNs) / kShakenWindowNs;
    if (window == 5) pose.T_world_rig.translation.z() += 1e18;  // voxels have no numbers there
    const PoseNoise noise{window == 8 ? std::nan("") : 0.01, 0.005};
    session.addPose(pose, {}, noise);
  }
  addEvents(session, recording);
  session.finish();
  std::vector<KeyframeDepthMap> keyframes;
  int refused = 0;
  for (bool more = true; more;) {
    try {
      auto keyframe = session.next();
      more = keyframe.has_value();
      if (keyframe) keyframes.push_back(std::move(*keyframe));
    } catch (const std::invalid_argument&) {
      ++refused;
    }
  }
  EXPECT_EQ(refused, 2);
  EXPECT_EQ(session.status().counts.windows_given_up.error, 2U);
  EXPECT_EQ(session.status().counts.keyframes, keyframes.size());
  EXPECT_EQ(session.cloud().keyframes(), keyframes.size());
  ASSERT_EQ(session.T_world_ref().size(), keyframes.size());
  ASSERT_EQ(session.T_odom_ref().size(), keyframes.size());
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    // The tracker's noise is 1 cm on each axis; the next keyframe is 8 cm away.
    EXPECT_LT(motionOf(session, i), 0.05) << "keyframe " << i;
  }
}

}  // namespace
}  // namespace efm
