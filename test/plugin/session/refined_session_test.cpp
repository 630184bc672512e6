// SPDX-License-Identifier: BSD-3-Clause
// A mapping session whose keyframes' poses are refined.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

#include "test/plugin/recordings/shaken_recording.h"
#include "test/plugin/session/session_driver.h"

namespace efm {
namespace {

using testing::HasSubstr;

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

TEST(RefinedSessionMap, EqualsTheKeyframesAtTheirPosesAtAnyTime) {
  const SyntheticRecording recording = shaken(SyntheticRecording(1.2));
  const EventFusionOptions options = optionsOf(false);
  MappingSession undisturbed(options);
  mapAll(undisturbed, recording);
  MappingSession session(options);
  addPoses(session, recording);
  addEvents(session, recording);
  session.finish();
  std::vector<std::vector<ViewPoint>> points;
  const auto expect_cloud_of_keyframes = [&] {
    GlobalCloud afresh(options.cloud);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Rigid3& T_world_ref = session.T_world_ref()[i];
      afresh.insert(i, pointsInWorld(points[i], T_world_ref), T_world_ref);
    }
    EXPECT_EQ(session.cloud().points()->size(), afresh.points()->size());
  };
  while (const auto keyframe = session.next()) {
    points.push_back(session.pointsOf(*keyframe));
    expect_cloud_of_keyframes();
    session.applyPending();
    expect_cloud_of_keyframes();
  }
  EXPECT_GE(points.size(), 10U);
  expectSameMap(session, undisturbed);
}

TEST(UnrefinedSession, KeepsTheTrackersPoses) {
  MappingSession session(unrefinedOptions());
  const auto keyframes = mapAll(session, shaken(SyntheticRecording(1.2)));
  GlobalCloud cloud(unrefinedOptions().cloud);
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    EXPECT_TRUE(isSame(session.T_world_ref()[i], keyframes[i].T_world_ref));
    EXPECT_TRUE(isSame(session.T_odom_ref()[i], keyframes[i].T_world_ref));
    const Rigid3& T_world_ref = keyframes[i].T_world_ref;
    cloud.insert(i, pointsInWorld(viewPoints(keyframes[i]), T_world_ref), T_world_ref);
  }
  EXPECT_TRUE(test::sameBits(*session.cloud().points(), *cloud.points()));
  EXPECT_FALSE(session.status().refinement);
  EXPECT_EQ(session.status().times.real.refine, 0);
}

TEST_P(RefinedSession, CountsItsWork) {
  MappingSession session(optionsOf(GetParam()));
  const auto keyframes = mapAll(session, shaken(SyntheticRecording(1.2)));
  const SessionStatus status = session.status();
  ASSERT_TRUE(status.refinement);
  EXPECT_GT(status.refinement->counts.registered, keyframes.size() / 2);
  EXPECT_LT(status.refinement->counts.registered, keyframes.size());
  EXPECT_EQ(status.refinement->waiting, 0U);
  EXPECT_GT(status.times.real.refine, 0);
  EXPECT_EQ(status.times.real.refine, status.refinement->seconds);
}

// --- What the tracker says of its noise --------------------------------------------------------

EventFusionOptions noiseOptions() {
  EventFusionOptions options = optionsOf(false);
  options.refinement.refiner.adapt_tracker = false;
  options.refinement.refiner.tracker.drift_m = 0;
  options.refinement.refiner.tracker.drift_rad = 0;
  return options;
}

/// Maps the shaken recording; the stated noise of a pose is a function of its number.
template <typename NoiseOf>
std::unique_ptr<MappingSession> mapWithNoise(const SyntheticRecording& recording,
                                             const NoiseOf& noise_of) {
  auto session = std::make_unique<MappingSession>(noiseOptions());
  for (std::size_t i = 0; i < recording.poses.size(); ++i) {
    session->addPose(recording.poses[i], {}, noise_of(i));
  }
  addEvents(*session, recording);
  mapRest(*session);
  return session;
}

constexpr std::size_t kPosesOfAWindow = 10;
using Noise = std::optional<PoseNoise>;

TEST(StatedNoise, NoisyKeyframesMoveAndOthersStay) {
  const SyntheticRecording recording = shaken(SyntheticRecording(1.2));
  const auto session = mapWithNoise(recording, [](std::size_t i) {
    return i / kPosesOfAWindow % 2 == 0 ? Noise({1e-4, 1e-5}) : Noise({0.05, 0.02});
  });
  double certain_m = 0;
  double noisy_m = 0;
  for (std::size_t k = 1; k < session->T_world_ref().size(); ++k) {
    (k % 2 == 0 ? certain_m : noisy_m) += motionOf(*session, k);
  }
  EXPECT_LT(certain_m, 0.2 * noisy_m);
}

TEST(StatedNoise, OfASecondPoseOfTheSameTimeIsIgnored) {
  const SyntheticRecording recording = shaken(SyntheticRecording(1.2));
  const auto expected = mapWithNoise(recording, [](std::size_t) { return Noise({1e-4, 1e-5}); });
  MappingSession session(noiseOptions());
  for (const StampedPose& pose : recording.poses) {
    session.addPose(pose, {}, PoseNoise{1e-4, 1e-5});
    session.addPose(pose, {}, PoseNoise{0.5, 0.5});
  }
  addEvents(session, recording);
  mapRest(session);
  expectSameMap(session, *expected);
}

TEST(StatedNoise, HoldsForItsPoseAlone) {
  const SyntheticRecording recording = shaken(SyntheticRecording(1.2));
  const auto none = [](std::size_t) { return Noise(); };
  const auto first = [](std::size_t i) { return i == 0 ? Noise({0.5, 0.5}) : Noise(); };
  expectSameMap(*mapWithNoise(recording, first), *mapWithNoise(recording, none));
}

TEST(StatedNoise, OfPosesOfOtherSourcesIsIgnored) {
  const SyntheticRecording recording = shaken(SyntheticRecording(1.2));
  EventFusionOptions options = optionsOf(false);
  MappingSession expected(options);
  mapAll(expected, recording);
  options.rig.pose_source = "tracker";
  for (const PoseSourceId& other :
       {PoseSourceId{PoseKind::kPose, "other"}, PoseSourceId{PoseKind::kOdometry, "wheels"}}) {
    MappingSession session(options);
    for (const StampedPose& pose : recording.poses) {
      session.addPose(pose, other, PoseNoise{0.5, 0.5});
      session.addPose(pose, {PoseKind::kPose, "tracker"});
    }
    addEvents(session, recording);
    mapRest(session);
    expectSameMap(session, expected);
  }
}

TEST(StatedNoise, OfAnySizeLeavesPosesFinite) {
  const SyntheticRecording recording = shaken(SyntheticRecording(1.2));
  for (const double size : {1e-150, 1e150}) {
    const auto session = mapWithNoise(recording, [&](std::size_t i) {
      return i / kPosesOfAWindow % 2 == 0 ? Noise() : Noise({size, size});
    });
    ASSERT_GE(session->T_world_ref().size(), 10U) << size;
    for (std::size_t k = 0; k < session->T_world_ref().size(); ++k) {
      EXPECT_TRUE(session->T_world_ref()[k].translation.allFinite()) << size << ", keyframe " << k;
      EXPECT_LT(motionOf(*session, k), 1) << size << ", keyframe " << k;
    }
  }
}

// --- Recordings of little use ------------------------------------------------------------------

void expectFinite(const MappingSession& session) {
  for (const Rigid3& T_world_ref : session.T_world_ref()) {
    EXPECT_TRUE(T_world_ref.translation.allFinite());
    EXPECT_NEAR(T_world_ref.rotation.norm(), 1, 1e-9);
  }
}

/// A change to a shaken recording that leaves poses as the tracker has them, to a distance.
struct PoorCase {
  const char* name;
  double duration_s;
  void (*change)(SyntheticRecording&);
  std::size_t min_keyframes;
  double max_motion_m;
};

TEST_P(RefinedSession, KeepsPosesNearTheTrackerInPoorRecordings) {
  const PoorCase cases[] = {
      {"no events", 0.15, [](SyntheticRecording& r) { r.events.assign(2, {}); }, 0, 0},
      {"one keyframe", 0.15, [](SyntheticRecording&) {}, 1, 0},
      {"a tracker that stands still", 1.0,
       [](SyntheticRecording& r) {
         for (StampedPose& pose : r.poses) pose.T_world_rig = r.poses[0].T_world_rig;
       },
       8, 1},
      {"a camera that sees nothing", 1.0, [](SyntheticRecording& r) { r.events[1].resize(1); }, 8,
       1e-6},
      {"a gap in the poses", 1.8,
       [](SyntheticRecording& r) { r.poses.erase(r.poses.begin() + 60, r.poses.begin() + 110); }, 9,
       0.2},
      {"a tracker that jumps", 2.0,
       [](SyntheticRecording& r) {
         for (StampedPose& pose : r.poses) {
           const std::int64_t jump_ns = SyntheticRecording::kStartNs + 10 * kShakenWindowNs;
           if (pose.t_ns >= jump_ns) pose.T_world_rig.translation.y() += 5;
         }
       },
       10, 0.2},
  };
  for (const PoorCase& row : cases) {
    SyntheticRecording recording = shaken(SyntheticRecording(row.duration_s));
    row.change(recording);
    MappingSession session(optionsOf(GetParam()));
    EXPECT_GE(mapAll(session, recording).size(), row.min_keyframes) << row.name;
    expectFinite(session);
    for (std::size_t k = 0; k < session.T_world_ref().size(); ++k) {
      EXPECT_LE(motionOf(session, k), row.max_motion_m) << row.name << ", keyframe " << k;
    }
  }
}

TEST_P(RefinedSession, WithOneCameraIsNotWorseThanTheTracker) {
  const SyntheticRecording recording(1.2, 1);
  MappingSession truth(unrefinedOptions());
  mapAll(truth, recording);
  MappingSession session(optionsOf(GetParam()));
  mapAll(session, shaken(recording));
  expectFinite(session);
  EXPECT_LE(distanceOf(session.T_world_ref(), truth.T_world_ref()),
            1.02 * distanceOf(session.T_odom_ref(), truth.T_world_ref()));
}

TEST_P(RefinedSession, RefusesAPoseThatIsNotFiniteAndMapsTheRest) {
  const SyntheticRecording recording = shaken(SyntheticRecording(1.0));
  MappingSession expected(optionsOf(false));
  mapAll(expected, recording);
  MappingSession session(optionsOf(GetParam()));
  addPoses(session, recording);
  StampedPose wrong = recording.poses[50];
  wrong.T_world_rig.translation.x() = std::numeric_limits<double>::quiet_NaN();
  wrong.t_ns += 1;
  EXPECT_THAT(messageOf([&] { session.addPose(wrong, {}, PoseNoise{1, 1}); }), HasSubstr("finite"));
  addEvents(session, recording);
  mapRest(session);
  expectSameMap(session, expected);
}

/// One keyframe stands where voxels have no numbers: it alone is left out.
TEST_P(RefinedSession, AKeyframeThatTheMapRefusesDoesNotShiftTheOthers) {
  SyntheticRecording recording = shaken(SyntheticRecording(1.2));
  for (StampedPose& pose : recording.poses) {
    const std::int64_t window = (pose.t_ns - SyntheticRecording::kStartNs) / kShakenWindowNs;
    if (window == 5) pose.T_world_rig.translation.z() += 1e18;
  }
  EventFusionOptions options = optionsOf(GetParam());
  options.mapper.trajectory.max_pose_gap_s = 0.02;
  MappingSession session(options);
  addPoses(session, recording);
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
  EXPECT_GT(refused, 0);
  EXPECT_EQ(session.T_world_ref().size(), keyframes.size());
  EXPECT_EQ(session.T_odom_ref().size(), keyframes.size());
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    EXPECT_LT(motionOf(session, i), 1) << "keyframe " << i;
  }
}

}  // namespace
}  // namespace efm
