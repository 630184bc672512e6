// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/faults/perturbed_poses.h"

#include <gtest/gtest.h>

#include <functional>

#include <algorithm>
#include <limits>
#include <map>
#include <stdexcept>

#include "test/tracking_stub/faults/pose_lists.h"

namespace efm {
namespace {

constexpr std::int64_t kSecondNs = 1'000'000'000;

std::vector<StampedPose> perturbed(const std::vector<StampedPose>& poses,
                                   const PosePerturbationOptions& options) {
  PerturbedPoses source(replay(poses), options);
  return allOf(source);
}

/// Intervals of 0.105 s: some begin at poses, some between poses.
PosePerturbationOptions keyframeNoise() {
  PosePerturbationOptions options;
  options.keyframe.noise_m = 0.01;
  options.keyframe.noise_rad = 0.01;
  options.keyframe.length_ns = 105'000'000;
  options.seed = 3;
  return options;
}

double angleOf(const Eigen::Quaterniond& rotation) { return 2 * rotation.vec().norm(); }

/// The mean squares of the errors per axis: positions in the world frame, rotations in the rig
/// frame.
std::pair<double, double> meanSquares(const std::vector<StampedPose>& poses,
                                      const std::vector<StampedPose>& truth) {
  double position = 0;
  double rotation = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Rigid3& T_world_rig = truth[i].T_world_rig;
    position += (poses[i].T_world_rig.translation - T_world_rig.translation).squaredNorm() / 3;
    const double angle = angleOf(T_world_rig.rotation.conjugate() * poses[i].T_world_rig.rotation);
    rotation += angle * angle / 3;
  }
  const auto count = static_cast<double>(poses.size());
  return {position / count, rotation / count};
}

TEST(PerturbedPoses, NoisePerPoseHasTheRequestedStddev) {
  const auto poses = windingWay(20'000);
  PosePerturbationOptions options;
  options.noise_m = 0.02;
  options.noise_rad = 0.005;
  const auto [position, rotation] = meanSquares(perturbed(poses, options), poses);
  // The relative stddev of the mean square of 60000 draws is sqrt(2 / 60000) = 0.6 %; that of its
  // root is half of it. The tolerance is five of these.
  EXPECT_NEAR(std::sqrt(position), 0.02, 0.02 * 0.015);
  EXPECT_NEAR(std::sqrt(rotation), 0.005, 0.005 * 0.015);
}

TEST(PerturbedPoses, KeepTheirNoiseWhenOthersAreLost) {
  auto poses = windingWay(100);
  PosePerturbationOptions options;
  options.noise_m = 0.01;
  const auto all = perturbed(poses, options);
  poses.erase(poses.begin() + 20, poses.begin() + 30);
  const auto fewer = perturbed(poses, options);
  EXPECT_TRUE(sameBits(fewer[20].T_world_rig, all[30].T_world_rig));
}

TEST(PerturbedPoses, NoisePerKeyframeHasTheRequestedStddev) {
  const auto poses = windingWay(100'000);
  PosePerturbationOptions options = keyframeNoise();
  options.keyframe.length_ns = 100'000'000;  // begins at every tenth pose
  std::map<std::int64_t, Rigid3> noisy;
  for (const StampedPose& pose : perturbed(poses, options)) noisy[pose.t_ns] = pose.T_world_rig;
  std::vector<StampedPose> first_poses;
  std::vector<StampedPose> truth;
  for (std::size_t i = 0; i < poses.size(); i += 10) {
    truth.push_back(poses[i]);
    first_poses.push_back({poses[i].t_ns, noisy.at(poses[i].t_ns)});
  }
  const auto [position, rotation] = meanSquares(first_poses, truth);
  // 30000 draws: the stddev of the root is 0.4 %. The tolerance is five of it. The rotation is in
  // the world frame; its angle in the rig frame is the same.
  EXPECT_NEAR(std::sqrt(position), 0.01, 0.01 * 0.02);
  EXPECT_NEAR(std::sqrt(rotation), 0.01, 0.01 * 0.02);
}

TEST(PerturbedPoses, AnIntervalMovesRigidlyAndJumpsAtTheNextInterval) {
  const auto poses = windingWay(300);
  const PosePerturbationOptions options = keyframeNoise();
  Trajectory truth;
  for (const StampedPose& pose : poses) truth.add(pose);
  Trajectory wrong;
  for (const StampedPose& pose : perturbed(poses, options)) EXPECT_TRUE(wrong.add(pose));

  const std::int64_t length_ns = *options.keyframe.length_ns;
  std::vector<Rigid3> errors;  // T_wrong_world of each interval
  for (std::int64_t k = 0; kSecondNs + (k + 1) * length_ns <= poses.back().t_ns; ++k) {
    const std::int64_t begin_ns = kSecondNs + k * length_ns;
    const Rigid3 error = *wrong.poseAt(begin_ns) * truth.poseAt(begin_ns)->inverse();
    errors.push_back(error);
    for (const std::int64_t t_ns : {begin_ns + 1, begin_ns + 3'333'333, begin_ns + 50'000'000,
                                    begin_ns + length_ns - 4'000'000, begin_ns + length_ns - 1}) {
      const Rigid3 expected = error * *truth.poseAt(t_ns);
      const Rigid3 T_expected_rig = expected.inverse() * *wrong.poseAt(t_ns);
      EXPECT_LT(T_expected_rig.translation.norm(), 1e-12) << k << " " << t_ns - begin_ns;
      EXPECT_LT(angleOf(T_expected_rig.rotation), 1e-12) << k << " " << t_ns - begin_ns;
    }
    // The error at the rig does not grow with its distance from the origin.
    EXPECT_LT((*wrong.poseAt(begin_ns)).translation.norm(),
              truth.poseAt(begin_ns)->translation.norm() + 0.06);
  }
  ASSERT_GT(errors.size(), 25U);
  for (std::size_t k = 1; k < errors.size(); ++k) {
    EXPECT_GT(angleOf((errors[k - 1].inverse() * errors[k]).rotation), 1e-4) << k;
  }
}

TEST(PerturbedPoses, OfAnIntervalDependOnItsNumberOnly) {
  const auto poses = windingWay(300);
  const auto errorAt = [&](std::size_t from, std::size_t index) {
    PosePerturbationOptions options = keyframeNoise();
    options.keyframe.noise_rad = 0;
    options.keyframe.start_ns = kSecondNs - 7;
    for (const StampedPose& pose :
         perturbed({poses.begin() + static_cast<std::ptrdiff_t>(from), poses.end()}, options)) {
      if (pose.t_ns == poses[index].t_ns) {
        return Eigen::Vector3d(pose.T_world_rig.translation - poses[index].T_world_rig.translation);
      }
    }
    return Eigen::Vector3d(Eigen::Vector3d::Zero());
  };
  EXPECT_GT(errorAt(0, 200).norm(), 1e-4);
  EXPECT_LT((errorAt(0, 200) - errorAt(150, 200)).norm(), 1e-15);
}

TEST(PerturbedPoses, IntervalsBeginOnTicks) {
  PosePerturbationOptions options = keyframeNoise();
  options.keyframe.length_ns = 33'333'333;
  options.tick_ns = 100;
  const auto noisy = perturbed(windingWay(200), options);
  std::int64_t before_ns = 0;
  for (const StampedPose& pose : noisy) {
    EXPECT_EQ(pose.t_ns % 100, 0);
    EXPECT_GT(pose.t_ns, before_ns);
    before_ns = pose.t_ns;
  }
  EXPECT_EQ(noisy.size(), 200U + 59 * 2);
}

TEST(PerturbedPoses, AreNotInsertedAcrossGaps) {
  auto poses = windingWay(200);
  poses.erase(poses.begin() + 50, poses.begin() + 100);
  PosePerturbationOptions options = keyframeNoise();
  options.keyframe.length_ns =
      100'000'000;  // intervals begin at poses: one pose is inserted at each
  for (const StampedPose& pose : perturbed(poses, options)) {
    EXPECT_TRUE(pose.t_ns <= poses[49].t_ns || pose.t_ns >= poses[50].t_ns);
  }
  EXPECT_EQ(perturbed(poses, options).size(), poses.size() + 4 + 9);
}

TEST(PerturbedPoses, DriftInProportionToThePathLength) {
  std::vector<StampedPose> straight;
  for (int i = 0; i <= 1000; ++i)
    straight.push_back({i * 1'000'000, {{1, 0, 0, 0}, {0.01 * i, 0, 0}}});
  PosePerturbationOptions options;
  options.drift.fraction = 0.02;
  for (options.seed = 0; options.seed < 5; ++options.seed) {
    const auto drifted = perturbed(straight, options);
    EXPECT_TRUE(sameBits(drifted[0].T_world_rig, straight[0].T_world_rig));
    for (const std::size_t i : {100U, 1000U}) {
      const Rigid3& T_world_rig = straight[i].T_world_rig;
      EXPECT_NEAR((drifted[i].T_world_rig.translation - T_world_rig.translation).norm(),
                  0.02 * 0.01 * static_cast<double>(i), 1e-12);
    }
  }
  options.drift = {0, 0.01};
  for (options.seed = 0; options.seed < 5; ++options.seed) {
    const auto drifted = perturbed(straight, options);
    EXPECT_NEAR(angleOf(drifted.back().T_world_rig.rotation), 0.1, 0.1 * 0.1 / 24 * 0.1 + 1e-4);
    // The heading bends the path.
    for (std::size_t i = 1; i < drifted.size(); ++i) {
      const Rigid3& T = drifted[i].T_world_rig;
      const Eigen::Vector3d step = T.translation - drifted[i - 1].T_world_rig.translation;
      EXPECT_LT((step - T.rotation * Eigen::Vector3d(0.01, 0, 0)).norm(), 1e-12);
    }
  }
}

TEST(PerturbedPoses, RotationNoiseIsAboutTheRigsAxes) {
  auto poses = windingWay(50);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(1.2, Eigen::Vector3d(1, 2, 3).normalized()));
  PosePerturbationOptions options;
  options.noise_rad = 0.1;
  const auto noisy = perturbed(poses, options);
  for (StampedPose& pose : poses) pose.T_world_rig.rotation = turn * pose.T_world_rig.rotation;
  const auto noisy_turned = perturbed(poses, options);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_LT(
        noisy_turned[i].T_world_rig.rotation.angularDistance(turn * noisy[i].T_world_rig.rotation),
        1e-7);
  }
}

TEST(PerturbedPoses, OneOptionDoesNotChangeTheRandomNumbersOfAnother) {
  const auto poses = windingWay(300);
  PosePerturbationOptions noise;
  noise.noise_m = 0.01;
  noise.seed = 3;
  PosePerturbationOptions keyframe = keyframeNoise();
  keyframe.keyframe.noise_rad = 0;  // errors add up exactly
  PosePerturbationOptions drift;
  drift.drift.fraction = 0.01;
  drift.seed = 3;
  PosePerturbationOptions all = keyframe;
  all.noise_m = noise.noise_m;
  all.drift = drift.drift;
  const auto at = [&](const PosePerturbationOptions& options) {
    std::map<std::int64_t, Eigen::Vector3d> positions;
    for (const StampedPose& pose : perturbed(poses, options)) {
      positions[pose.t_ns] = pose.T_world_rig.translation;
    }
    return positions;
  };
  const auto of_noise = at(noise);
  const auto of_keyframe = at(keyframe);
  const auto of_drift = at(drift);
  const auto of_all = at(all);
  for (const StampedPose& pose : poses) {
    const Eigen::Vector3d sum = of_noise.at(pose.t_ns) + of_keyframe.at(pose.t_ns) +
                                of_drift.at(pose.t_ns) - 2 * pose.T_world_rig.translation;
    EXPECT_LT((of_all.at(pose.t_ns) - sum).norm(), 1e-12);
  }
}

TEST(PerturbedPoses, ThatAreNotFiniteDoNotChangeOthers) {
  auto poses = windingWay(100);
  poses[40].T_world_rig.translation.x() = std::numeric_limits<double>::quiet_NaN();
  PosePerturbationOptions options = keyframeNoise();
  options.drift = {0.01, 0.01};
  const auto noisy = perturbed(poses, options);
  EXPECT_EQ(std::count_if(
                noisy.begin(), noisy.end(),
                [](const StampedPose& pose) { return !pose.T_world_rig.translation.allFinite(); }),
            1);
}

TEST(PerturbedPoses, RefuseInvalidOptions) {
  EXPECT_THROW(PerturbedPoses(nullptr, {}), std::invalid_argument);
  const std::function<void(PosePerturbationOptions&)> mistakes[] = {
      [](auto& o) { o.noise_m = -1; },
      [](auto& o) { o.noise_rad = std::numeric_limits<double>::quiet_NaN(); },
      [](auto& o) { o.keyframe.noise_m = 0.01; },  // without a length
      [](auto& o) { o.keyframe.length_ns = 1; },
      [](auto& o) { o.drift.fraction = 2; },
      [](auto& o) { o.tick_ns = 0; }};
  for (const auto& makeMistake : mistakes) {
    PosePerturbationOptions options;
    makeMistake(options);
    EXPECT_THROW(PerturbedPoses(replay({}), options), std::invalid_argument);
  }
}

}  // namespace
}  // namespace efm
