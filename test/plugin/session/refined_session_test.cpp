// SPDX-License-Identifier: BSD-3-Clause
// A mapping session whose keyframes' poses are refined.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

#include "plugin/session/mapping_session.h"
#include "test/plugin/recordings/shaken_recording.h"

namespace efm {
namespace {

using testing::HasSubstr;

const PoseSourceId kTracker{PoseKind::kPose, "tracker"};

EventFusionOptions optionsOf(bool background) {
  EventFusionOptions options = refinedOptions();
  options.refinement.background = background;
  return options;
}

void addPoses(MappingSession& session, const std::vector<StampedPose>& poses) {
  for (const StampedPose& pose : poses) session.addPose(pose, kTracker);
}

void addEvents(MappingSession& session, const SyntheticRecording& recording) {
  for (std::size_t c = 0; c < recording.cameras.size(); ++c) {
    session.addEvents(
        {static_cast<int>(c), recording.cameras[c], recording.events[c], std::nullopt});
  }
}

std::vector<KeyframeDepthMap> mapDue(MappingSession& session) {
  std::vector<KeyframeDepthMap> keyframes;
  while (auto keyframe = session.next()) keyframes.push_back(std::move(*keyframe));
  return keyframes;
}

std::vector<KeyframeDepthMap> mapRest(MappingSession& session) {
  session.finish();
  return mapDue(session);
}

std::vector<KeyframeDepthMap> mapAll(MappingSession& session, const SyntheticRecording& recording) {
  addPoses(session, recording.poses);
  addEvents(session, recording);
  return mapRest(session);
}

/// In packets of so many milliseconds, mapping what is due after each.
void mapPiecewise(MappingSession& session, const SyntheticRecording& recording, int packet_ms) {
  std::vector<std::size_t> begin(recording.cameras.size(), 0);
  for (std::size_t p = 0; p < recording.poses.size(); ++p) {
    session.addPose(recording.poses[p], kTracker);
    const std::int64_t until_ns = recording.poses[p].t_ns;
    const bool last = p + 1 == recording.poses.size();
    const std::int64_t passed_ms = (until_ns - SyntheticRecording::kStartNs) / 1'000'000;
    if (passed_ms % packet_ms != 0 && !last) continue;
    for (std::size_t c = 0; c < recording.cameras.size(); ++c) {
      CameraPacket packet{static_cast<int>(c), recording.cameras[c], {}, std::nullopt};
      if (!last) packet.covered_until_ns = until_ns;
      const std::vector<Event>& events = recording.events[c];
      for (; begin[c] < events.size() && (last || events[begin[c]].t_ns < until_ns); ++begin[c]) {
        packet.events.push_back(events[begin[c]]);
      }
      session.addEvents(std::move(packet));
    }
    mapDue(session);
  }
  mapRest(session);
}

void expectSameMap(const MappingSession& session, const MappingSession& expected) {
  ASSERT_EQ(session.T_world_ref().size(), expected.T_world_ref().size());
  for (std::size_t i = 0; i < expected.T_world_ref().size(); ++i) {
    EXPECT_TRUE(isSame(session.T_world_ref()[i], expected.T_world_ref()[i])) << "keyframe " << i;
    EXPECT_TRUE(isSame(session.T_odom_ref()[i], expected.T_odom_ref()[i]));
  }
  const auto points = session.cloud().points();
  const auto expected_points = expected.cloud().points();
  ASSERT_EQ(points.size(), expected_points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(points[i].p_world, expected_points[i].p_world);
    EXPECT_EQ(points[i].confidence, expected_points[i].confidence);
    EXPECT_EQ(points[i].support, expected_points[i].support);
  }
}

/// Root mean square distance of keyframes from where they are, after a shift of all.
double errorOf(const std::vector<Rigid3>& T_world_ref, const std::vector<Rigid3>& truth) {
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
  EventFusionOptions exact = refinedOptions();
  exact.refinement.enabled = false;
  MappingSession truth(exact);
  mapAll(truth, recording);
  MappingSession session(optionsOf(GetParam()));
  mapAll(session, shaken(recording));

  const double tracker_m = errorOf(session.T_odom_ref(), truth.T_world_ref());
  EXPECT_GT(tracker_m, 0.01);
  EXPECT_LT(errorOf(session.T_world_ref(), truth.T_world_ref()), 0.75 * tracker_m);
  EXPECT_TRUE(isSame(session.T_world_ref()[0], session.T_odom_ref()[0]));
}

TEST_P(RefinedSession, EndsInTheSameMapHoweverTheRecordingWasCut) {
  const SyntheticRecording recording = shaken(SyntheticRecording(1.2));
  MappingSession at_once(optionsOf(false));
  mapAll(at_once, recording);
  for (const int packet_ms : {10, 70, 400}) {
    MappingSession piecewise(optionsOf(GetParam()));
    mapPiecewise(piecewise, recording, packet_ms);
    expectSameMap(piecewise, at_once);
  }
}

TEST(RefinedSessionMap, IsTheSameWhenItIsSettledAtAnyTime) {
  const SyntheticRecording recording = shaken(SyntheticRecording(1.2));
  MappingSession undisturbed(optionsOf(false));
  mapAll(undisturbed, recording);
  MappingSession settled(optionsOf(false));
  addPoses(settled, recording.poses);
  addEvents(settled, recording);
  settled.finish();
  while (settled.next()) settled.applyPending();
  expectSameMap(settled, undisturbed);
}

TEST(RefinedSessionMap, IsThatOfTheKeyframesWhereTheyStandAtAnyTime) {
  const SyntheticRecording recording = shaken(SyntheticRecording(1.2));
  const EventFusionOptions options = optionsOf(false);
  MappingSession session(options);
  addPoses(session, recording.poses);
  addEvents(session, recording);
  session.finish();
  std::vector<std::vector<ViewPoint>> points;
  while (const auto keyframe = session.next()) {
    points.push_back(session.pointsOf(*keyframe));
    GlobalCloud afresh(options.cloud);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Rigid3& T_world_ref = session.T_world_ref()[i];
      afresh.insert(i, pointsInWorld(points[i], T_world_ref), T_world_ref);
    }
    EXPECT_EQ(session.cloud().points().size(), afresh.points().size());
  }
  EXPECT_GE(points.size(), 10U);
}

TEST(UnrefinedSession, LeavesKeyframesWhereTheTrackerPutThem) {
  EventFusionOptions options = refinedOptions();
  options.refinement.enabled = false;
  MappingSession session(options);
  const auto keyframes = mapAll(session, shaken(SyntheticRecording(1.2)));
  GlobalCloud cloud(options.cloud);
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    EXPECT_TRUE(isSame(session.T_world_ref()[i], keyframes[i].T_world_ref));
    EXPECT_TRUE(isSame(session.T_odom_ref()[i], keyframes[i].T_world_ref));
    cloud.insert(i, keyframeCloud(keyframes[i]), keyframes[i].T_world_ref);
  }
  const auto points = session.cloud().points();
  const auto expected = cloud.points();
  ASSERT_EQ(points.size(), expected.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(points[i].p_world, expected[i].p_world);
  }
  EXPECT_FALSE(session.status().refinement);
  EXPECT_EQ(session.status().seconds.refine, 0);
}

TEST_P(RefinedSession, SaysWhatItDid) {
  MappingSession session(optionsOf(GetParam()));
  const auto keyframes = mapAll(session, shaken(SyntheticRecording(1.2)));
  const SessionStatus status = session.status();
  ASSERT_TRUE(status.refinement);
  EXPECT_GT(status.refinement->counts.registered, keyframes.size() / 2);
  EXPECT_LT(status.refinement->counts.registered, keyframes.size());
  EXPECT_EQ(status.refinement->waiting, 0U);
  EXPECT_GT(status.seconds.refine, 0);
  EXPECT_EQ(status.seconds.refine, status.refinement->seconds);
}

// --- What the tracker says of its noise --------------------------------------------------------

/// Maps the shaken recording, where what is said of a pose is a function of its number.
template <typename NoiseOf>
std::unique_ptr<MappingSession> mapWithNoise(const SyntheticRecording& recording,
                                             const NoiseOf& noise_of) {
  EventFusionOptions options = optionsOf(false);
  options.refinement.refiner.adapt_tracker = false;
  options.refinement.refiner.tracker.drift_m = 0;
  options.refinement.refiner.tracker.drift_rad = 0;
  auto session = std::make_unique<MappingSession>(options);
  for (std::size_t i = 0; i < recording.poses.size(); ++i) {
    session->addPose(recording.poses[i], kTracker, noise_of(i));
  }
  addEvents(*session, recording);
  mapRest(*session);
  return session;
}

constexpr std::size_t kPosesOfAWindow = 10;
using Noise = std::optional<PoseNoise>;

TEST(StatedNoise, KeyframesThatAreSaidToBeNoisyMoveAndThoseThatAreNotStay) {
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

TEST(StatedNoise, OfAPoseWithTheTimeOfAnEarlierOneDoesNotCount) {
  const SyntheticRecording recording = shaken(SyntheticRecording(1.2));
  const auto expected = mapWithNoise(recording, [](std::size_t) { return Noise({1e-4, 1e-5}); });
  EventFusionOptions options = optionsOf(false);
  options.refinement.refiner.adapt_tracker = false;
  options.refinement.refiner.tracker.drift_m = 0;
  options.refinement.refiner.tracker.drift_rad = 0;
  MappingSession session(options);
  for (const StampedPose& pose : recording.poses) {
    session.addPose(pose, kTracker, PoseNoise{1e-4, 1e-5});
    session.addPose(pose, kTracker, PoseNoise{0.5, 0.5});
  }
  addEvents(session, recording);
  mapRest(session);
  expectSameMap(session, *expected);
}

TEST(StatedNoise, HoldsForItsPoseAloneAndNotForLaterOnesThatSayNothing) {
  const SyntheticRecording recording = shaken(SyntheticRecording(1.2));
  const auto none = [](std::size_t) { return Noise(); };
  const auto first = [](std::size_t i) { return i == 0 ? Noise({0.5, 0.5}) : Noise(); };
  expectSameMap(*mapWithNoise(recording, first), *mapWithNoise(recording, none));
}

TEST(StatedNoise, OfPosesThatAreNotUsedDoesNotCount) {
  const SyntheticRecording recording = shaken(SyntheticRecording(1.2));
  EventFusionOptions options = optionsOf(false);
  options.rig.pose_source = kTracker.label;
  MappingSession expected(options);
  mapAll(expected, recording);
  for (const PoseSourceId& other :
       {PoseSourceId{PoseKind::kPose, "other"}, PoseSourceId{PoseKind::kOdometry, "wheels"}}) {
    MappingSession session(options);
    for (const StampedPose& pose : recording.poses) {
      session.addPose(pose, other, PoseNoise{0.5, 0.5});
    }
    mapAll(session, recording);
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

TEST_P(RefinedSession, OfOneKeyframeLeavesItWhereItIs) {
  const SyntheticRecording recording(0.15);
  MappingSession session(optionsOf(GetParam()));
  EXPECT_EQ(mapAll(session, recording).size(), 1U);
  EXPECT_TRUE(isSame(session.T_world_ref()[0], session.T_odom_ref()[0]));
}

TEST_P(RefinedSession, OfNothingIsEmpty) {
  MappingSession session(optionsOf(GetParam()));
  EXPECT_TRUE(mapRest(session).empty());
  EXPECT_TRUE(session.cloud().points().empty());
  EXPECT_TRUE(session.T_world_ref().empty());
}

TEST_P(RefinedSession, OfATrackerThatStandsStillIsFinite) {
  SyntheticRecording recording(1.0);
  for (StampedPose& pose : recording.poses) pose.T_world_rig = recording.poses[0].T_world_rig;
  MappingSession session(optionsOf(GetParam()));
  EXPECT_GE(mapAll(session, recording).size(), 8U);
  expectFinite(session);
}

TEST_P(RefinedSession, OfOneCameraIsFiniteAndNotWorseThanTheTracker) {
  const SyntheticRecording recording(1.2, 1);
  EventFusionOptions exact = refinedOptions();
  exact.refinement.enabled = false;
  MappingSession truth(exact);
  mapAll(truth, recording);
  MappingSession session(optionsOf(GetParam()));
  mapAll(session, shaken(recording));
  expectFinite(session);
  EXPECT_LE(errorOf(session.T_world_ref(), truth.T_world_ref()),
            1.02 * errorOf(session.T_odom_ref(), truth.T_world_ref()));
}

TEST_P(RefinedSession, OfACameraThatSeesNothingStaysWithTheTracker) {
  SyntheticRecording recording = shaken(SyntheticRecording(1.0));
  recording.events[1].resize(1);  // rules that ask all cameras find nothing
  MappingSession session(optionsOf(GetParam()));
  const auto keyframes = mapAll(session, recording);
  ASSERT_GE(keyframes.size(), 8U);
  EXPECT_EQ(session.status().refinement->counts.registered, 0U);
  for (std::size_t i = 0; i < keyframes.size(); ++i) EXPECT_LT(motionOf(session, i), 1e-6);
}

TEST_P(RefinedSession, GoesOnAfterGapsInThePoses) {
  SyntheticRecording recording = shaken(SyntheticRecording(1.8));
  recording.poses.erase(recording.poses.begin() + 60, recording.poses.begin() + 110);
  MappingSession session(optionsOf(GetParam()));
  const auto keyframes = mapAll(session, recording);
  EXPECT_GT(session.status().counts.keyframes_without_pose, 0U);
  EXPECT_GE(keyframes.size(), 9U);
  EXPECT_EQ(session.T_world_ref().size(), keyframes.size());
  expectFinite(session);
}

TEST_P(RefinedSession, RefusesAPoseThatIsNotFiniteAndMapsTheRest) {
  const SyntheticRecording recording = shaken(SyntheticRecording(1.0));
  MappingSession expected(optionsOf(false));
  mapAll(expected, recording);
  MappingSession session(optionsOf(GetParam()));
  addPoses(session, recording.poses);
  StampedPose wrong = recording.poses[50];
  wrong.T_world_rig.translation.x() = std::numeric_limits<double>::quiet_NaN();
  wrong.t_ns += 1;
  try {
    session.addPose(wrong, kTracker, PoseNoise{1, 1});
    ADD_FAILURE() << "no error";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("finite"));
  }
  addEvents(session, recording);
  mapRest(session);
  expectSameMap(session, expected);
}

TEST_P(RefinedSession, FollowsATrackerThatJumps) {
  SyntheticRecording recording = shaken(SyntheticRecording(2.0));
  for (StampedPose& pose : recording.poses) {
    if (pose.t_ns >= SyntheticRecording::kStartNs + 10 * kShakenWindowNs) {
      pose.T_world_rig.translation.y() += 5;
    }
  }
  MappingSession session(optionsOf(GetParam()));
  mapAll(session, recording);
  expectFinite(session);
  // Nothing else says where they are: the tracker's motion stands, but for its noise.
  for (std::size_t i = 0; i < session.T_world_ref().size(); ++i) {
    EXPECT_LT(motionOf(session, i), 0.2) << "keyframe " << i;
  }
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
  addPoses(session, recording.poses);
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
