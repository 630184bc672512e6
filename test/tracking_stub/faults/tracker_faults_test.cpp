// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/faults/tracker_faults.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

constexpr std::int64_t kFirstNs = 1'000'000'000;
constexpr std::int64_t kPeriodNs = 10'000'000;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Returns the poses of a rig that moves to the right at 0.5 m/s, bobs and rotates.
std::vector<StampedPose> windingWay(int count) {
  std::vector<StampedPose> poses;
  for (std::int64_t i = 0; i < count; ++i) {
    const double t_s = 0.01 * static_cast<double>(i);
    Rigid3 T_world_rig;
    T_world_rig.translation = {0.5 * t_s, 0.1 * std::sin(3 * t_s), 0.05 * std::cos(5 * t_s)};
    T_world_rig.rotation = rotationBy({0.2 * std::sin(2 * t_s), 0.3 * t_s, 0.1 * std::cos(t_s)});
    poses.push_back({kFirstNs + i * kPeriodNs, T_world_rig});
  }
  return poses;
}

bool areSame(const std::vector<StampedPose>& a, const std::vector<StampedPose>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& one, const auto& other) {
    return one.t_ns == other.t_ns && isSame(one.T_world_rig, other.T_world_rig);
  });
}

std::map<std::int64_t, Rigid3> byTime(const std::vector<StampedPose>& poses,
                                      const TrackerFaults& faults) {
  std::map<std::int64_t, Rigid3> by_time;
  for (const StampedPose& pose : withFaults(poses, faults)) {
    EXPECT_TRUE(by_time.empty() || pose.t_ns > by_time.rbegin()->first);
    by_time[pose.t_ns] = pose.T_world_rig;
  }
  return by_time;
}

/// Returns faults in intervals of 0.105 s: some begin at poses, some between poses.
TrackerFaults keyframeNoise(double noise_m, double noise_rad) {
  TrackerFaults faults;
  faults.perturbation.keyframe = {noise_m, noise_rad, 105'000'000, {}};
  return faults;
}

double angleOf(const Eigen::Quaterniond& rotation) { return 2 * rotation.vec().norm(); }

/// @param errors the rotation from the true pose to the wrong pose, and the shift in the world.
void expectSpread(const std::vector<Rigid3>& errors, double noise_m, double noise_rad) {
  double square_m2 = 0;
  double square_rad2 = 0;
  for (const Rigid3& error : errors) {
    square_m2 += error.translation.squaredNorm();
    square_rad2 += std::pow(angleOf(error.rotation), 2);
  }
  const double count = 3 * static_cast<double>(errors.size());  // on each axis
  const double tolerance = 5 / std::sqrt(2 * count);  // five standard deviations of the result
  EXPECT_NEAR(std::sqrt(square_m2 / count), noise_m, noise_m * tolerance);
  EXPECT_NEAR(std::sqrt(square_rad2 / count), noise_rad, noise_rad * tolerance);
}

Rigid3 errorOf(const Rigid3& T_world_wrong, const Rigid3& T_world_true) {
  return {T_world_true.rotation.conjugate() * T_world_wrong.rotation,
          T_world_wrong.translation - T_world_true.translation};
}

TEST(TrackerFaults, ThatMoveNoPoseTakePosesInAnyOrder) {
  auto poses = windingWay(10);
  std::swap(poses[2], poses[3]);
  TrackerFaults faults;
  EXPECT_FALSE(faults.any());
  EXPECT_TRUE(areSame(withFaults(poses, faults), poses));
  faults.latency_ns = 10'000'000'000;
  EXPECT_TRUE(faults.any());
  EXPECT_TRUE(areSame(withFaults(poses, faults), poses));
  EXPECT_THAT([&] { withFaults(poses, keyframeNoise(0.01, 0)); },
              testing::ThrowsMessage<std::invalid_argument>(
                  "the pose at 1.020000000 s comes after one at 1.030000000 s: poses that are "
                  "perturbed must come in time order"));
}

TEST(TrackerFaults, OfASeedAreTheSameAndOfAnotherSeedDiffer) {
  const auto poses = windingWay(200);
  TrackerFaults rows[8] = {keyframeNoise(0.01, 0), keyframeNoise(0, 0.01)};
  rows[2].perturbation.noise_m = rows[3].perturbation.noise_rad = 0.01;
  rows[4].perturbation.drift.fraction = rows[5].perturbation.drift.rad_per_m = 0.01;
  rows[6].dropouts.drop_probability = 0.2;
  rows[7].dropouts.random_gaps_hz = 5;
  for (TrackerFaults& faults : rows) {
    SCOPED_TRACE(&faults - rows);
    EXPECT_TRUE(faults.any());
    const auto faulty = withFaults(poses, faults);
    EXPECT_TRUE(areSame(withFaults(poses, faults), faulty));
    faults.perturbation.seed = faults.dropouts.seed = 9;
    EXPECT_FALSE(areSame(withFaults(poses, faults), faulty));
  }
}

TEST(TrackerFaults, OfASeedDoNotDependOnTheVersion) {
  TrackerFaults faults = keyframeNoise(0.01, 0.01);
  faults.perturbation.noise_m = faults.perturbation.noise_rad = 0.01;
  faults.perturbation.drift = {0.01, 0.01};
  faults.dropouts = {0.1, 0.5, 0.3, 0};
  double sum = 0;
  for (const auto& [t_ns, T_world_rig] : byTime(windingWay(500), faults)) {
    sum += T_world_rig.translation.sum() + T_world_rig.rotation.coeffs().sum();
  }
  EXPECT_NEAR(sum, 1270.855516, 1e-6);
}

TEST(PoseNoise, HasItsSpreadInTheWorldForPositionsAndAboutTheRigsAxesForRotations) {
  const auto poses = windingWay(20'000);
  auto turned = poses;
  const Eigen::Quaterniond turn = rotationBy({0.3, 0.6, 0.9});
  for (StampedPose& pose : turned) pose.T_world_rig.rotation = turn * pose.T_world_rig.rotation;
  TrackerFaults faults;
  faults.perturbation.noise_m = 0.02;
  faults.perturbation.noise_rad = 0.005;
  const auto noisy = withFaults(poses, faults);
  turned = withFaults(turned, faults);
  ASSERT_EQ(noisy.size(), poses.size());
  std::vector<Rigid3> errors;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Rigid3& T_world_rig = noisy[i].T_world_rig;
    errors.push_back(errorOf(T_world_rig, poses[i].T_world_rig));
    ASSERT_EQ(turned[i].T_world_rig.translation, T_world_rig.translation);
    ASSERT_LT(turned[i].T_world_rig.rotation.angularDistance(turn * T_world_rig.rotation), 1e-7);
  }
  expectSpread(errors, 0.02, 0.005);
}

TEST(KeyframeNoise, MovesAnIntervalRigidlyAndJumpsToTheNextWithinATick) {
  const auto poses = windingWay(100'000);
  Trajectory truth;
  Trajectory wrong;
  for (const StampedPose& pose : poses) truth.add(pose);
  for (const StampedPose& pose : withFaults(poses, keyframeNoise(0.01, 0.02))) wrong.add(pose);
  std::vector<Rigid3> errors;
  std::int64_t begin_ns = kFirstNs;
  for (; begin_ns + 105'000'000 <= poses.back().t_ns; begin_ns += 105'000'000) {
    // The rotation is about the rig: the shift of its position does not grow with the path length.
    errors.push_back(errorOf(*wrong.poseAt(begin_ns), *truth.poseAt(begin_ns)));
    const Rigid3 T_wrong_world = *wrong.poseAt(begin_ns) * truth.poseAt(begin_ns)->inverse();
    for (const std::int64_t after_ns : {1, 3'333'333, 50'000'000, 101'000'000, 104'999'999}) {
      const Rigid3 T_wrong_rig = T_wrong_world * *truth.poseAt(begin_ns + after_ns);
      const Rigid3 difference = T_wrong_rig.inverse() * *wrong.poseAt(begin_ns + after_ns);
      ASSERT_LT(difference.translation.norm(), 1e-9) << begin_ns << " + " << after_ns;
      ASSERT_LT(angleOf(difference.rotation), 1e-9) << begin_ns << " + " << after_ns;
    }
  }
  expectSpread(errors, 0.01, 0.02);
}

TEST(KeyframeNoise, InsertsTwoPosesATickApartWhereAnIntervalBeginsButNotInGaps) {
  auto poses = windingWay(200);
  TrackerFaults faults = keyframeNoise(0.01, 0.01);
  faults.perturbation.tick_ns = 100;
  faults.perturbation.keyframe.length_ns = 33'333'333;
  const auto noisy = byTime(poses, faults);
  EXPECT_EQ(noisy.size(), poses.size() + 59 * 2);
  for (std::int64_t k = 1; k <= 59; ++k) {
    const std::int64_t begin_ns = (kFirstNs + k * 33'333'333) / 100 * 100;
    EXPECT_EQ(noisy.count(begin_ns - 100) + noisy.count(begin_ns), 2U) << k;
  }
  poses.erase(poses.begin() + 50, poses.begin() + 100);
  faults.perturbation.keyframe.length_ns = 100'000'000;
  // One pose is inserted per interval, because intervals begin at poses (at ticks) or a tick later.
  for (const auto& [start_ns, begins] : {std::pair{kFirstNs + 50, 13U}, {kFirstNs + 100, 15U}}) {
    faults.perturbation.keyframe.start_ns = start_ns;
    faults.perturbation.max_pose_gap_s = 0.5;
    EXPECT_EQ(byTime(poses, faults).size(), poses.size() + begins);
    faults.perturbation.max_pose_gap_s = 0.51;  // the gap is bridged
    EXPECT_GE(byTime(poses, faults).size(), poses.size() + begins + 10);
  }
}

TEST(KeyframeNoise, OfAnIntervalDependsOnItsNumberOnly) {
  const auto poses = windingWay(300);
  TrackerFaults faults = keyframeNoise(0.01, 0);
  faults.perturbation.keyframe.start_ns = kFirstNs - 7;
  const Rigid3 all = byTime(poses, faults).at(poses[200].t_ns);
  const Rigid3 later = byTime({poses.begin() + 150, poses.end()}, faults).at(poses[200].t_ns);
  EXPECT_GT((all.translation - poses[200].T_world_rig.translation).norm(), 1e-4);
  EXPECT_LT((all.translation - later.translation).norm(), 1e-14);
}

TEST(Drift, IsProportionalToThePathLength) {
  std::vector<StampedPose> straight;
  for (int i = 0; i <= 1000; ++i) straight.push_back({i, {{1, 0, 0, 0}, {0.01 * i, 0, 0}}});
  TrackerFaults faults;
  faults.perturbation.drift = {0.02, 0.01};
  const auto drifted = withFaults(straight, faults);
  EXPECT_TRUE(isSame(drifted[0].T_world_rig, straight[0].T_world_rig));
  Eigen::Vector3d first_shift = Eigen::Vector3d::Zero();
  for (std::size_t i = 1; i <= 1000; ++i) {
    const Rigid3& T_world_rig = drifted[i].T_world_rig;
    EXPECT_NEAR(2 * std::asin(T_world_rig.rotation.vec().norm()),
                0.01 * straight[i].T_world_rig.translation.x(), 1e-12);
    // The heading bends the path, and each step is shifted the same way.
    const Eigen::Vector3d step = T_world_rig.translation - drifted[i - 1].T_world_rig.translation;
    const Eigen::Vector3d shift = step - T_world_rig.rotation * Eigen::Vector3d(0.01, 0, 0);
    if (i == 1) first_shift = shift;
    EXPECT_NEAR(shift.norm(), 0.02 * 0.01, 1e-12);
    EXPECT_LT((shift - first_shift).norm(), 1e-12);
  }
}

TEST(PerturbedPoses, ThatAreNotUsableStayAndDoNotChangeOthers) {
  TrackerFaults faults = keyframeNoise(0.01, 0.01);
  faults.perturbation.noise_m = 0.01;
  faults.perturbation.drift = {0.01, 0.01};
  auto poses = windingWay(100);
  auto expected = withFaults(poses, faults);
  const StampedPose unusable[] = {{poses[59].t_ns, {{1, 0, 0, 0}, {kInfinity, 0, 0}}},
                                  {poses[59].t_ns, {{kInfinity, 0, 0, 0}, {0, 0, 0}}},
                                  {kEndOfTimeNs, {}},
                                  {-kEndOfTimeNs, {}}};
  const auto later = [&](const StampedPose& pose) { return pose.t_ns > unusable[0].t_ns; };
  for (auto* list : {&poses, &expected}) {
    list->insert(std::find_if(list->begin(), list->end(), later), std::begin(unusable),
                 std::end(unusable));
  }
  EXPECT_TRUE(areSame(withFaults(poses, faults), expected));
}

/// Returns the times of the poses at 100 Hz that are not lost.
std::set<std::int64_t> keptTimes(const PoseDropoutOptions& dropouts, std::int64_t count = 10'000) {
  std::vector<StampedPose> poses;
  for (std::int64_t i = 0; i < count; ++i) poses.push_back({i * kPeriodNs, {}});
  TrackerFaults faults;
  faults.dropouts = dropouts;
  std::set<std::int64_t> times;
  for (const StampedPose& pose : withFaults(poses, faults)) times.insert(pose.t_ns);
  return times;
}

TEST(PoseDropouts, RandomGapsHaveTheirLengthAndRate) {
  const auto times = keptTimes({0, 0.5, 0.3, 0}, 200'000);
  int gaps = 0;
  for (auto later = std::next(times.begin()); later != times.end(); ++later) {
    const std::int64_t apart_ns = *later - *std::prev(later);
    if (apart_ns == kPeriodNs) continue;
    EXPECT_GE(apart_ns, 31 * kPeriodNs);  // two gaps may be adjacent
    ++gaps;
  }
  // A gap of 30 poses begins 2 s (stddev 2 s) after the end of the last gap: 870 gaps (stddev 26)
  // in 2000 s. One gap of 200 is adjacent to the last gap.
  EXPECT_NEAR(gaps, 870 * 0.995, 5 * 26);
  EXPECT_NEAR(200'000 - static_cast<double>(times.size()), 870 * 30, 5 * 26 * 30);
}

TEST(PoseDropouts, OfEachKindAreAsRequestedAndDoNotChangeOthers) {
  const auto single = keptTimes({0.2, 0, 0.5, 4});
  const auto random = keptTimes({0, 0.5, 0.5, 4});
  const auto all = keptTimes({0.2, 0.5, 0.5, 4});
  EXPECT_NEAR(static_cast<double>(single.size()), 8'000, 5 * 40);  // binomial: the stddev is 40
  for (std::int64_t i = 0; i < 10'000; ++i) {
    const std::int64_t t_ns = i * kPeriodNs;
    EXPECT_EQ(all.count(t_ns), single.count(t_ns) * random.count(t_ns)) << i;
  }
}

TEST(TrackerFaults, OfOneKindDoNotChangeTheRandomNumbersOfOthers) {
  const auto poses = windingWay(500);
  TrackerFaults noise;
  noise.perturbation.noise_m = 0.01;
  TrackerFaults drift;
  drift.perturbation.drift.fraction = 0.01;
  const TrackerFaults keyframe = keyframeNoise(0.01, 0);  // without rotation: errors add up
  TrackerFaults all = noise;
  all.perturbation.keyframe = keyframe.perturbation.keyframe;
  all.perturbation.drift = drift.perturbation.drift;
  const auto of_noise = byTime(poses, noise);
  const auto of_drift = byTime(poses, drift);
  const auto of_keyframe = byTime(poses, keyframe);
  const auto of_all = byTime(poses, all);
  for (const auto& [t_ns, T_world_rig] : poses) {
    const Eigen::Vector3d sum = of_noise.at(t_ns).translation + of_drift.at(t_ns).translation +
                                of_keyframe.at(t_ns).translation - 2 * T_world_rig.translation;
    EXPECT_LT((of_all.at(t_ns).translation - sum).norm(), 1e-12);
  }
}

TEST(TrackerFaults, LosePosesBeforeTheyMoveThem) {
  const auto poses = windingWay(500);
  TrackerFaults losses;
  losses.dropouts.drop_probability = 0.5;
  TrackerFaults faults = keyframeNoise(0.01, 0);
  faults.perturbation.noise_m = 0.01;
  faults.perturbation.keyframe.start_ns = kFirstNs - 1;  // intervals begin between poses
  faults.perturbation.max_pose_gap_s = 10;
  const auto lossless = byTime(poses, faults);
  faults.dropouts = losses.dropouts;
  auto inserted = byTime(poses, faults);
  for (const auto& [t_ns, T_world_rig] : byTime(poses, losses)) {
    EXPECT_LT((inserted.at(t_ns).translation - lossless.at(t_ns).translation).norm(), 1e-12);
    inserted.erase(t_ns);
  }
  EXPECT_EQ(inserted.size(), 47U * 2);  // the poses at a jump are never lost
  for (const auto& [t_ns, T_world_rig] : inserted) {
    EXPECT_LE((t_ns - kFirstNs + 2) % 105'000'000, 1);
  }
}

TEST(TrackerFaults, OutOfRangeAreRejected) {
#define WRONG(field, value) [](TrackerFaults& faults) { faults.field = value; }
  const std::pair<void (*)(TrackerFaults&), const char*> rows[] = {
      {WRONG(perturbation.keyframe.noise_m, 1),
       "length_ns of keyframes = nothing: must be given where there is noise per keyframe"},
      {WRONG(perturbation.keyframe.length_ns, 9),
       "length_ns of keyframes = 9: must be 1e6 to 1e15"},
      {WRONG(perturbation.keyframe.start_ns, kEndOfTimeNs),
       "start_ns of keyframes = 4611686018427387903: must be within 4.6e18 of 0"},
      {WRONG(perturbation.max_pose_gap_s, 0),
       "max_pose_gap_s = 0: must be above 0 and at most 1e6"},
      {WRONG(perturbation.tick_ns, 0), "tick_ns = 0: must be 1 to 999999"}};
#undef WRONG
  for (const auto& [set, message] : rows) {
    TrackerFaults faults;
    set(faults);
    EXPECT_THAT([&] { withFaults({}, faults); },
                testing::ThrowsMessage<std::invalid_argument>(message));
  }
}

}  // namespace
}  // namespace efm
