// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <algorithm>
#include <functional>

#include "mapping/survey/depth_agreement.h"
#include "mapping/survey/pose_check.h"
#include "mapping/survey/scene_depths.h"
#include "test/mapping/survey/edge_world.h"

namespace efm {
namespace {

TEST(SpreadSamples, KeepsAtMostEightEvenlySpreadOfAnyNumber) {
  for (const std::size_t count : {0, 1, 7, 8, 9, 16, 17, 1000}) {
    SpreadSamples spread;
    const Trajectory trajectory;
    for (std::size_t i = 0; i < count; ++i) {
      const auto t0_ns = static_cast<std::int64_t>(i) * 100;
      spread.add({{t0_ns, t0_ns + 100, t0_ns + 50}, {}, &trajectory});
    }
    const std::vector<WindowSample>& samples = spread.samples();
    EXPECT_LE(samples.size(), SpreadSamples::kMaxSamples) << count;
    EXPECT_GE(samples.size(), std::min(count, SpreadSamples::kMaxSamples / 2)) << count;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const std::int64_t step_ns = samples.size() > 1 ? samples[1].window.t0_ns : 0;
      EXPECT_EQ(samples[i].window.t0_ns, static_cast<std::int64_t>(i) * step_ns) << count;
    }
    if (samples.size() < 2) continue;
    // The rest after the last sample is shorter than two steps.
    EXPECT_GT(samples.back().window.t0_ns + 2 * samples[1].window.t0_ns,
              static_cast<std::int64_t>(count - 1) * 100)
        << count;
  }
}

TEST(WindowSample, HasItsEventsWithinAWindowAndAroundItsMiddle) {
  WindowSample sample;
  sample.window = {0, 1000, 500};
  sample.events.emplace_back();
  for (std::int64_t t_ns = 0; t_ns < 1000; t_ns += 100)
    sample.events[0].push_back({t_ns, 0, 0, true});
  EXPECT_EQ(eventsWithin(sample, {200, 400, 300})[0].size(), 2U);  // 400 is outside
  const WindowData middle = middleOf(sample, 400e-9);
  EXPECT_EQ(middle.window.t0_ns, 300);
  EXPECT_EQ(middle.window.t1_ns, 700);
  EXPECT_EQ(middle.events[0].size(), 4U);
  EXPECT_EQ(middle.window.t_ref_ns, 500);
  EXPECT_EQ(middleOf(sample, 1).events[0].size(), 10U);
}

using test::EdgeWorld;

TEST(DenseRange, HasAPartOfThePointsThatIsMoreThanHalfOfItsPartOfTheRange) {
  // 100 points and 20 more (a sixth of all) at a distance of `away` of the range.
  for (const auto& [away, joined] : {std::pair{0.31, true}, {0.36, false}}) {
    for (const bool nearer : {true, false}) {
      SceneDepths depths;
      depths.nearest = 4;
      const double at = nearer ? 1 : 2;
      for (int i = 0; i < 100; ++i) depths.inverse.push_back(at + 0.001 * i);
      const double others = nearer ? at + 0.1 + 4 * away : at - 4 * away;
      for (int i = 0; i < 20; ++i) depths.inverse.push_back(others + 0.0001 * i);
      std::sort(depths.inverse.begin(), depths.inverse.end());
      const InverseRange range = denseRange(depths);
      EXPECT_EQ(range.far, joined && !nearer ? others : at) << away;
      EXPECT_DOUBLE_EQ(range.near, joined && nearer ? others + 0.0019 : at + 0.099) << away;
      EXPECT_EQ(depths.median(), depths.inverse[60]);
    }
  }
}

TEST(LimitsAround, AreTenTimesApartUnlessTheSceneIsWide) {
  // The factors are sqrt(10 / 2) and its power of 0.75.
  EXPECT_NEAR(limitsAround({0.5, 1}).near, 2.23607, 1e-5);
  EXPECT_NEAR(limitsAround({0.5, 1}).far, 0.5 / 1.82859, 1e-5);
  EXPECT_DOUBLE_EQ(limitsAround({0.1, 2}).near, 2.5);
  EXPECT_DOUBLE_EQ(limitsAround({0.1, 2}).far, 0.08);
}

TEST(MotionIn, IsTheLargestFromTheMiddleOfTheWindow) {
  for (const int axis : {0, 1}) {
    Rig rig = EdgeWorld::rig(3);
    const Eigen::Vector3d side = Eigen::Vector3d::Unit(axis);
    for (std::size_t c = 0; c < 3; ++c) {
      rig.cameras[c].T_rig_cam = {Eigen::Quaterniond::Identity(), 0.15 * double(c) * side};
    }
    WindowSample sample;
    for (int i = 0; i <= 40; ++i) {  // 1 m/s, with a step of 0.1 m
      const double t_s = 0.01 * i;
      sample.trajectory.add({durationFromSeconds(t_s),
                             {rotationBy({0, 0, 0.5 * t_s}), (t_s + (i > 25 ? 0.1 : 0)) * side}});
    }
    FusionMapperOptions options;
    options.cameras = {0, 2};
    const Window window{0, 400'000'000, 200'000'000};
    const auto motion = motionIn({window, {}, &sample.trajectory}, rig, options);
    ASSERT_TRUE(motion);
    EXPECT_NEAR(motion->shift_m, 0.3, 1e-9);
    EXPECT_NEAR(motion->rotation_rad, 0.1, 1e-9);
    EXPECT_NEAR(motion->rig_baseline_m, 0.3, 1e-9);
    // Focal length 120 px, 0.6 m. The second camera rotates with the rig.
    EXPECT_NEAR(motion->parallax_px_m, 120 * 0.6 * std::cos(0.1), 1e-9);
    EXPECT_FALSE(motionIn({{0, 1, 900'000'000}, {}, &sample.trajectory}, rig, options));
  }
}

TEST(DepthAgreement, HasTheScaleOfPositionsInAWrongUnit) {
  const Rig rig = EdgeWorld::rig(2);
  for (const double scale : {1.0, 1.5}) {
    WindowSample sample = EdgeWorld().sample(rig);
    sample.trajectory = sample.trajectory.moved(
        sample.window.t0_ns, sample.window.t1_ns, [&](const StampedPose& pose) {
          return Rigid3{pose.T_world_rig.rotation, scale * pose.T_world_rig.translation};
        });
    const auto agreement = depthAgreement(rig, {sample}, {});
    ASSERT_TRUE(agreement);
    EXPECT_NEAR(agreement->scale, scale, 0.1 * scale);
    EXPECT_GT(agreement->agreeing, 0.6);
    EXPECT_FALSE(depthAgreement(EdgeWorld::rig(1), {sample}, {}));
  }
}

TEST(PoseHypotheses, AreThePosesInvertedTheOtherQuaternionAndAllAxes) {
  const std::vector<PoseHypothesis> all = poseHypotheses();
  ASSERT_EQ(all.size(), 25U);
  const Rigid3 pose{Eigen::Quaterniond(0.1, 0.2, 0.3, 0.9).normalized(), {1, 2, 3}};
  EXPECT_TRUE(isSame(all[0].T_world_rig(pose), pose.inverse()));
  // The order of the components is wrong: x is read as w, y as x, and so on.
  const Eigen::Vector4d q = pose.rotation.coeffs();
  EXPECT_EQ(all[1].T_world_rig(pose).rotation.coeffs(), Eigen::Vector4d(q[1], q[2], q[3], q[0]));
  for (std::size_t i = 2; i < all.size(); ++i) {
    const Eigen::Matrix3d& axes = all[i].R_body_rig;
    EXPECT_EQ(axes.cwiseAbs().sum(), 3);
    EXPECT_NEAR(axes.determinant(), 1, 1e-12);
    EXPECT_TRUE(all[i].T_world_rig(pose).rotation.toRotationMatrix().isApprox(
        pose.rotation.toRotationMatrix() * axes, 1e-12));
    for (std::size_t j = 2; j < i; ++j) EXPECT_NE(axes, all[j].R_body_rig);
  }
}

/// Returns poses every 5 ms at 1 m/s with alternating signs of the quaternion, and an event per ms.
WindowSample steadySample(std::int64_t t0_ms, std::int64_t length_ms) {
  WindowSample sample;
  sample.window = {t0_ms * 1'000'000, (t0_ms + length_ms) * 1'000'000, 0};
  for (std::int64_t ms = t0_ms; ms <= t0_ms + length_ms; ms += 5) {
    StampedPose pose{ms * 1'000'000, {rotationBy({0, 0.2, 0}), {1e-3 * double(ms), 0, 0}}};
    if (ms % 10 == 0) pose.T_world_rig.rotation.coeffs() *= -1;
    sample.trajectory.add(pose);
  }
  sample.events.resize(2);
  for (std::int64_t ms = t0_ms + 1; ms < t0_ms + length_ms; ++ms) {
    sample.events[0].push_back({ms * 1'000'000, 1, 1, true});
  }
  return sample;
}

TEST(SamplePieces, AreFourSpreadEvenlyThoseInTheMiddleFirstWithoutJitter) {
  const auto startsOf = [](const std::vector<WindowSample>& samples, double length_s) {
    std::vector<double> starts_ms;
    for (const SamplePiece& piece : piecesOf(samples, {})) {
      EXPECT_NEAR(secondsBetween(piece.window.t0_ns, piece.window.t1_ns), length_s, 1e-6);
      EXPECT_EQ(piece.window.t_ref_ns, (piece.window.t0_ns + piece.window.t1_ns) / 2);
      for (const Event& event : piece.events.at(0)) EXPECT_TRUE(piece.window.contains(event.t_ns));
      EXPECT_NEAR(double(piece.events[0].size()), 1e3 * length_s, 1.5);
      // Each pose is the mean of the poses of 20 ms.
      const std::vector<StampedPose>& poses = piece.trajectory.poses();
      EXPECT_EQ(poses[1].t_ns - poses[0].t_ns, 20'000'000);
      EXPECT_NEAR(poses[1].T_world_rig.translation.x(), 1e-9 * double(poses[1].t_ns), 1e-9);
      EXPECT_NEAR(std::abs(poses[1].T_world_rig.rotation.y()), std::sin(0.1), 1e-9);
      starts_ms.push_back(1e-6 * double(piece.window.t0_ns));
    }
    return starts_ms;
  };
  using ::testing::DoubleNear;
  using ::testing::ElementsAre;
  // Mean poses begin at 7.5 ms: in 1.6 s, pieces of half of it, at most 1 s.
  EXPECT_THAT(startsOf({steadySample(0, 1600)}, 0.79575),
              ElementsAre(DoubleNear(306.1, 3), DoubleNear(505.2, 3), DoubleNear(107.0, 3),
                          DoubleNear(704.2, 3)));
  // Pieces last at least 0.25 s (of 0.3 s), or as long as a shorter sample.
  EXPECT_THAT(startsOf({steadySample(0, 300)}, 0.25),
              ElementsAre(DoubleNear(23.4, 3), DoubleNear(34.1, 3), DoubleNear(12.8, 3),
                          DoubleNear(44.7, 3)));
  std::vector<WindowSample> many;
  for (int i = 0; i < 6; ++i) many.push_back(steadySample(1000 * i, 800));
  EXPECT_THAT(startsOf(many, 0.39575), ::testing::SizeIs(4));
}

struct Recorded {
  Rig rig;
  WindowSample sample;

  /// Changes each pose.
  void change(const std::function<StampedPose(const StampedPose&)>& changed) {
    Trajectory trajectory;
    for (const StampedPose& pose : sample.trajectory.poses()) trajectory.add(changed(pose));
    sample.trajectory = trajectory;
  }
  PoseJudgement check() const { return checkPoses(rig, {sample}, {}); }
};

Recorded recorded(std::size_t cameras, const EdgeWorld& world = {}) {
  const Rig rig = EdgeWorld::rig(cameras);
  return {rig, world.sample(rig)};
}

/// Returns R for a body with x forward, y left, z up: the camera's z, -x, -y.
Eigen::Matrix3d forwardLeftUp() {
  Eigen::Matrix3d R_body_rig;
  R_body_rig << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return R_body_rig;
}

template <int kMs>
void later(Recorded& recorded) {
  recorded.change([](StampedPose pose) {
    pose.t_ns += std::int64_t{kMs} * 1'000'000;
    return pose;
  });
}

template <typename Change>
void forEachEvent(Recorded& recorded, Change change) {
  for (std::size_t c = 0; c < recorded.sample.events.size(); ++c) {
    for (Event& event : recorded.sample.events[c]) change(event, recorded.rig.cameras[c].model);
  }
}

/// Removes the events of the first columns: a dark side.
void keepRight(Recorded& recorded, int columns) {
  for (std::vector<Event>& events : recorded.sample.events) {
    events.erase(std::remove_if(events.begin(), events.end(),
                                [&](const Event& event) { return event.x < columns; }),
                 events.end());
  }
}

struct Row {
  const char* name;
  PoseMistake found;
  bool one_camera;  // true if one camera is enough
  void (*make)(Recorded&);
  double shift_s = 0;
};

const Row kRows[] = {
    {"T_rig_world instead of T_world_rig", PoseMistake::kInverted, true,
     [](Recorded& recorded) {
       recorded.change([](StampedPose pose) {
         return StampedPose{pose.t_ns, pose.T_world_rig.inverse()};
       });
     }},
    {"w x y z read as x y z w", PoseMistake::kQuaternionOrder, true,
     [](Recorded& recorded) {
       recorded.change([](StampedPose pose) {
         const Eigen::Quaterniond q = pose.T_world_rig.rotation;
         pose.T_world_rig.rotation = Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y());
         return pose;
       });
     }},
    {"poses of a body with other axes", PoseMistake::kAxes, true,
     [](Recorded& recorded) {
       recorded.change([](StampedPose pose) {
         const Rigid3 T_rig_body{Eigen::Quaterniond(forwardLeftUp().transpose()),
                                 Eigen::Vector3d::Zero()};
         pose.T_world_rig = pose.T_world_rig * T_rig_body;
         return pose;
       });
     }},
    {"poses 0.2 s late", PoseMistake::kTimeShift, true, later<200>, 0.2},
    {"poses 0.2 s early", PoseMistake::kTimeShift, true, later<-200>, -0.2},
    {"a latency of 20 ms, of a rig", PoseMistake::kTimeShift, false, later<20>, 0.02},
    {"cameras exchanged", PoseMistake::kCamerasSwapped, false,
     [](Recorded& recorded) { std::swap(recorded.sample.events[0], recorded.sample.events[1]); }},
    {"the transform between the cameras inverted", PoseMistake::kStereoInverted, false,
     [](Recorded& recorded) {
       Rigid3& T_rig_cam = recorded.rig.cameras[1].T_rig_cam;
       T_rig_cam = T_rig_cam.inverse();
     }},
    {"camera 1 30 ms late", PoseMistake::kCameraClock, false,
     [](Recorded& recorded) {
       for (Event& event : recorded.sample.events[1]) event.t_ns += 30'000'000;
     },
     -0.03},
    {"columns mirrored", PoseMistake::kMirrored, true,
     [](Recorded& recorded) {
       forEachEvent(recorded, [](Event& event, const CameraModel& model) {
         event.x = static_cast<std::uint16_t>(model.width - 1 - event.x);
       });
     }},
    {"60 columns cropped", PoseMistake::kPixels, true,
     [](Recorded& recorded) {
       keepRight(recorded, 60);
       forEachEvent(recorded, [](Event& event, const CameraModel&) {
         event.x = static_cast<std::uint16_t>(event.x - 60);
       });
     }},
    {"poses without order", PoseMistake::kUnknown, false,
     [](Recorded& recorded) {
       std::mt19937 random(1);
       std::normal_distribution<double> noise(0, 0.2);
       recorded.change([&](const StampedPose& pose) {
         const Eigen::Vector3d rotation{noise(random), noise(random), noise(random)};
         const Eigen::Vector3d translation{noise(random), noise(random), noise(random)};
         return StampedPose{pose.t_ns, {rotationBy(rotation), translation}};
       });
     }},
};

TEST(PoseCheck, FindsEachMistake) {
  EdgeWorld longer;
  longer.duration_s = 2;
  for (const std::size_t cameras : {1, 2}) {
    const Recorded right = recorded(cameras, longer);
    for (const Row& row : kRows) {
      if (cameras == 1 && !row.one_camera) continue;
      Recorded wrong = right;
      row.make(wrong);
      const std::optional<PoseFinding> finding = wrong.check().finding;
      ASSERT_TRUE(finding) << row.name << ", cameras: " << cameras;
      EXPECT_EQ(finding->mistake, row.found) << row.name << ", cameras: " << cameras;
      if (row.found == PoseMistake::kAxes) {
        EXPECT_EQ(finding->R_body_rig, forwardLeftUp());
      }
      if (row.found == PoseMistake::kPixels) {
        EXPECT_NEAR(finding->pixels.offset_px.at(0).x(), 60, 2);
      }
      if (row.shift_s != 0) {
        // Adjacent times of the search are 3 ms apart, and the events have noise.
        EXPECT_NEAR(finding->shift_s, row.shift_s, row.shift_s > 0.1 ? 0.02 : 0.007);
      }
    }
  }
}

TEST(PoseCheck, AccusesNoRightPoses) {
  const auto jittering = [](Recorded right) {
    std::mt19937 random(3);
    std::normal_distribution<double> noise;
    right.change([&](StampedPose pose) {
      const Rigid3 jitter{
          rotationBy(Eigen::Vector3d{noise(random), noise(random), noise(random)} * 0.01),
          Eigen::Vector3d{noise(random), noise(random), noise(random)} * 0.01};
      return StampedPose{pose.t_ns, pose.T_world_rig * jitter};
    });
    return right;
  };
  EdgeWorld forward;
  forward.T_world_rig = [](double t_s) {
    return Rigid3{rotationBy({0.02 * std::sin(9 * t_s), 0, 0}), {0, 0, 0.4 * t_s}};
  };
  EdgeWorld brief;
  brief.duration_s = 0.3;
  for (const std::size_t cameras : {1, 2}) {
    EXPECT_FALSE(recorded(cameras).check().finding) << cameras;
    EXPECT_FALSE(jittering(recorded(cameras)).check().finding) << cameras;
    EXPECT_FALSE(recorded(cameras, forward).check().finding) << cameras;
    EXPECT_FALSE(recorded(cameras, brief).check().finding) << cameras;
    Recorded dark = recorded(cameras);
    keepRight(dark, 100);
    EXPECT_FALSE(dark.check().finding) << cameras;
  }
}

TEST(PoseCheck, SaysNothingWithoutParallax) {
  static double speed_m_s;
  for (const double speed : {0.0, 0.01, 0.02}) {  // 0.02: 5 mm on each side of a piece's middle
    speed_m_s = speed;
    EdgeWorld turning;
    turning.T_world_rig = [](double t_s) {
      return Rigid3{EdgeWorld::handHeld(t_s).rotation, {speed_m_s * t_s, 0, 0}};
    };
    Recorded inverted = recorded(2, turning);
    inverted.change([](StampedPose pose) {
      return StampedPose{pose.t_ns, pose.T_world_rig.inverse()};
    });
    EXPECT_EQ(inverted.check().finding.has_value(), speed > 0.015) << speed;
  }
  EXPECT_FALSE(checkPoses(EdgeWorld::rig(2), {}, {}).finding);
}

TEST(PoseCheck, CamerasOfOtherSizesAreNotExchanged) {
  Recorded uneven = recorded(2);
  CameraModel& model = uneven.rig.cameras[1].model;
  model.height -= 30;  // events of the first camera would be outside
  auto& events = uneven.sample.events[1];
  events.erase(std::remove_if(events.begin(), events.end(),
                              [&](const Event& event) { return event.y >= model.height; }),
               events.end());
  EXPECT_FALSE(uneven.check().finding);
}

TEST(PoseCheck, LooksThroughTheCamerasOfTheMapAlone) {
  Recorded half_mirrored = recorded(2);
  const int width = half_mirrored.rig.cameras[0].model.width;
  for (Event& event : half_mirrored.sample.events[0]) {
    event.x = static_cast<std::uint16_t>(width - 1 - event.x);
  }
  EXPECT_TRUE(half_mirrored.check().finding);
  FusionMapperOptions options;
  options.cameras = {1};
  options.keyframe.reference_camera = 1;
  EXPECT_FALSE(checkPoses(half_mirrored.rig, {half_mirrored.sample}, options).finding);
}

}  // namespace

}  // namespace efm
