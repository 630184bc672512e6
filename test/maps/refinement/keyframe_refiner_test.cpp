// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/keyframe_refiner.h"

#include <gmock/gmock.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "edges.h"
#include "random_poses.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using test::drawMotion;
using test::Edges;
using test::kInverseDepthSigma;
using test::metresApart;
using test::radiansApart;
using test::sameBits;
using test::viewTurned;
using testing::HasSubstr;
using testing::ThrowsMessage;
using Poses = std::vector<Rigid3>;

/// Returns options with fewer points than by default, for speed.
RefinementOptions quick() {
  RefinementOptions options;
  options.points.max_points = 300;
  options.points.max_map_points = 3000;
  return options;
}

/// Returns poses on a circle that look outwards, one every `step_deg`: 7 cm apart at 5 deg.
Poses circle(int count, double step_deg) {
  Poses poses;
  for (int i = 0; i < count; ++i) {
    const double yaw = i * step_deg * kRadiansPerDegree;
    poses.push_back(viewTurned(
        yaw, 0.8 * Eigen::Vector3d(std::sin(yaw), 0.1 * std::sin(3 * yaw), std::cos(yaw))));
  }
  return poses;
}

/// Returns the keyframes seen from the true poses.
std::vector<KeyframeDepthMap> seenAlong(const Edges& world, const Poses& truth,
                                        std::mt19937& random) {
  std::vector<KeyframeDepthMap> seen;
  for (const Rigid3& T_world_ref : truth) {
    seen.push_back(test::seenFrom(world, T_world_ref, kInverseDepthSigma, random));
  }
  return seen;
}

Poses noisy(const Poses& truth, double sigma_m, double sigma_rad, std::mt19937& random) {
  Poses tracked;
  for (const Rigid3& pose : truth) tracked.push_back(pose * drawMotion(sigma_m, sigma_rad, random));
  return tracked;
}

/// Adds a random walk to the poses: standard deviations per root of a metre of path.
Poses drifting(const Poses& truth, double per_m, double rad_per_m, std::mt19937& random) {
  Poses tracked = {truth.front()};
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const Rigid3 motion = truth[i - 1].inverse() * truth[i];
    const double root_length = std::sqrt(motion.translation.norm());
    tracked.push_back(tracked.back() * motion *
                      drawMotion(per_m * root_length, rad_per_m * root_length, random));
  }
  return tracked;
}

KeyframeRefiner refine(const std::vector<KeyframeDepthMap>& seen, const Poses& tracked,
                       const RefinementOptions& options) {
  KeyframeRefiner refiner(options);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    refiner.add(RegistrationCloud(seen[i], options.points), tracked[i]);
  }
  refiner.finish();
  return refiner;
}

Poses posesOf(const KeyframeRefiner& refiner) {
  Poses poses;
  for (std::size_t i = 0; i < refiner.keyframes(); ++i) poses.push_back(refiner.T_world_ref(i));
  return poses;
}

struct Errors {
  double m = 0;
  double rad = 0;
};

/// Returns the root mean square errors of the relative poses of all pairs. The poses are not
/// aligned: on a short arc one wrong keyframe would rotate the alignment.
Errors errorsOf(const Poses& estimate, const Poses& truth) {
  double squared_m = 0;
  double squared_rad = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    for (std::size_t j = 0; j < truth.size(); ++j) {
      const Rigid3 T_i_j = truth[i].inverse() * truth[j];
      const Rigid3 estimated = estimate[i].inverse() * estimate[j];
      squared_m += std::pow(metresApart(estimated, T_i_j), 2);
      squared_rad += std::pow(radiansApart(estimated, T_i_j), 2);
    }
  }
  const auto pairs = static_cast<double>(truth.size() * (truth.size() - 1));
  return {std::sqrt(squared_m / pairs), std::sqrt(squared_rad / pairs)};
}

/// A tracker that is wrong by far more than registrations reach: the motions by common events lead
/// to the true poses, and tell the errors of the tracker.
TEST(KeyframeRefiner, FollowsTheMotionsByCommonEvents) {
  std::mt19937 random(3);
  const Poses truth = circle(12, 5);
  const auto seen = seenAlong(test::edgesAround(250, random), truth, random);
  const Poses tracked = noisy(truth, 0.15, 4 * kRadiansPerDegree, random);
  KeyframeRefiner refiner(quick());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    std::optional<Rigid3> T_last_ref;
    if (i > 0) {
      T_last_ref =
          truth[i - 1].inverse() * truth[i] * drawMotion(0.002, 0.05 * kRadiansPerDegree, random);
    }
    refiner.add(RegistrationCloud(seen[i], quick().points), tracked[i], std::nullopt, T_last_ref);
  }
  refiner.finish();
  EXPECT_GE(refiner.counts().registered, 10U);
  const Errors by_tracker = errorsOf(tracked, truth);
  const Errors refined = errorsOf(posesOf(refiner), truth);
  const Errors alone = errorsOf(posesOf(refine(seen, tracked, quick())), truth);
  EXPECT_LT(refined.m, 0.1 * by_tracker.m);
  EXPECT_LT(refined.rad, 0.1 * by_tracker.rad);
  EXPECT_LT(refined.m, 0.3 * alone.m);
  EXPECT_GT(refiner.trackerErrors().noise_m, 0.05);
}

TEST(KeyframeRefiner, TakesMostOfATrackersNoiseAway) {
  Errors before;
  Errors after;
  for (unsigned seed = 1; seed <= 2; ++seed) {
    std::mt19937 random(seed);
    const Poses truth = circle(16, 5);
    const auto seen = seenAlong(test::edgesAround(250, random), truth, random);
    const Poses tracked = noisy(truth, 0.01, 0.5 * kRadiansPerDegree, random);
    const KeyframeRefiner refiner = refine(seen, tracked, quick());
    EXPECT_GE(refiner.counts().registered, 14U) << seed;
    const Errors by_tracker = errorsOf(tracked, truth);
    const Errors refined = errorsOf(posesOf(refiner), truth);
    before.m += by_tracker.m;
    before.rad += by_tracker.rad;
    after.m += refined.m;
    after.rad += refined.rad;
    const Errors exact = errorsOf(posesOf(refine(seen, truth, quick())), truth);
    EXPECT_LT(exact.m, 0.002) << "exact poses stay: " << seed;
    EXPECT_LT(exact.rad, 0.05 * kRadiansPerDegree) << seed;
  }
  EXPECT_LT(after.m, 0.35 * before.m);
  EXPECT_LT(after.rad, 0.25 * before.rad);
}

TEST(KeyframeRefiner, ALoopTakesTheDriftOutOfItsEnd) {
  std::mt19937 random(1);
  const Poses truth = circle(36, 11);  // 385 deg: the last keyframes see the begin
  const auto seen = seenAlong(test::edgesAround(250, random), truth, random);
  const Poses tracked = drifting(truth, 0.03, 1.5 * kRadiansPerDegree, random);
  const Rigid3 end = truth.front().inverse() * truth.back();
  const Rigid3 tracked_end = tracked.front().inverse() * tracked.back();
  RefinementOptions options = quick();
  options.tracker.drift_m = 0.03;
  options.tracker.drift_rad = 1.5 * kRadiansPerDegree;
  for (const bool loops : {true, false}) {
    options.loop.loops = loops;
    const KeyframeRefiner refiner = refine(seen, tracked, options);
    const Rigid3 refined_end = refiner.T_world_ref(0).inverse() * refiner.T_world_ref(35);
    if (!loops) {
      EXPECT_EQ(refiner.counts().loop_checks, 0U);
      EXPECT_GT(radiansApart(refined_end, end), 0.3 * kRadiansPerDegree) << "without loops";
      continue;
    }
    EXPECT_GE(refiner.counts().loops, 1U);
    EXPECT_LE(refiner.counts().loops_dropped, refiner.counts().loops);
    EXPECT_LE(refiner.counts().loops, refiner.counts().loop_checks);
    EXPECT_LT(metresApart(refined_end, end), 0.3 * metresApart(tracked_end, end));
    EXPECT_LT(radiansApart(refined_end, end), 0.3 * kRadiansPerDegree)
        << "twice a registration's error";
  }
}

/// A noisy walk in a random world.
struct Walk {
  std::mt19937 random{7};
  Poses truth = circle(10, 5);
  Edges world = test::edgesAround(250, random);
  std::vector<KeyframeDepthMap> seen = seenAlong(world, truth, random);
  Poses tracked = noisy(truth, 0.01, 0.5 * kRadiansPerDegree, random);

  Poses refined(const RefinementOptions& options = quick()) const {
    return posesOf(refine(seen, tracked, options));
  }
  /// Expects that refining changes the errors by at most this factor.
  void expectErrors(double factor, const RefinementOptions& options = quick()) const {
    const Errors before = errorsOf(tracked, truth);
    const Errors after = errorsOf(refined(options), truth);
    EXPECT_LT(after.m, factor * before.m);
    EXPECT_LT(after.rad, factor * before.rad);
  }
};

TEST(KeyframeRefiner, MovesWithTheWorldAtAnyDistance) {
  Walk walk;
  const Poses near = walk.refined();
  EXPECT_TRUE(sameBits(near[0], walk.tracked[0])) << "the first pose stays";
  const Rigid3 T_utm_world = viewTurned(0.7, {5e5, -30, 5e6});
  for (Rigid3& pose : walk.tracked) pose = T_utm_world * pose;
  const Poses far = walk.refined();
  for (std::size_t i = 0; i < near.size(); ++i) {
    // Rounding may change a few neighbours.
    EXPECT_LT(metresApart(T_utm_world.inverse() * far[i], near[i]), 5e-4) << i;
    EXPECT_LT(radiansApart(T_utm_world.inverse() * far[i], near[i]), 0.02 * kRadiansPerDegree) << i;
  }
}

TEST(KeyframeRefiner, ATrackerWithWrongExpectedErrorsIsNotMadeWorse) {
  const Walk walk;
  for (const double factor : {0.01, 100.0}) {
    for (const bool adapt : {true, false}) {
      SCOPED_TRACE(std::to_string(factor) + (adapt ? ", learnt" : ", fixed"));
      RefinementOptions options = quick();
      options.adapt_tracker = adapt;
      options.tracker.noise_m *= factor;
      options.tracker.noise_rad *= factor;
      options.tracker.drift_m *= factor;
      options.tracker.drift_rad *= factor;
      walk.expectErrors(1.1, options);
    }
  }
}

TEST(KeyframeRefiner, KeyframesWithFewPointsDoNotSpoilTheOthers) {
  const auto others = [](const Poses& poses) {
    return Poses{poses[1], poses[2], poses[3], poses[6], poses[7], poses[8]};
  };
  for (const int count : {0, 1, 5, 29}) {
    SCOPED_TRACE(count);
    Walk walk;
    for (const std::size_t sparse : {0, 4, 5, 9}) test::keepFirst(count, walk.seen[sparse]);
    walk.expectErrors(1);
    const Errors before = errorsOf(others(walk.tracked), others(walk.truth));
    const Errors after = errorsOf(others(walk.refined()), others(walk.truth));
    EXPECT_LT(after.m, 0.5 * before.m);
    EXPECT_LT(after.rad, 0.5 * before.rad);
  }
}

TEST(KeyframeRefiner, WithoutPointsThePosesOfTheTrackerStand) {
  Walk walk;
  for (KeyframeDepthMap& keyframe : walk.seen) keyframe.map.depth = 0;
  const KeyframeRefiner refiner = refine(walk.seen, walk.tracked, quick());
  for (std::size_t i = 0; i < walk.tracked.size(); ++i) {
    EXPECT_LT(metresApart(refiner.T_world_ref(i), walk.tracked[i]), 1e-6) << i;
    EXPECT_LT(radiansApart(refiner.T_world_ref(i), walk.tracked[i]), 1e-6) << i;
  }
  EXPECT_EQ(refiner.counts().registered, 0U);
  EXPECT_LT(metresApart(refiner.T_world_odom(), {}), 1e-6);
}

TEST(KeyframeRefiner, ReducesTheNoiseOfATrackerThatStandsStill) {
  std::mt19937 random(8);
  const Poses truth(8, viewTurned(0, {0.1, 0, 0}));
  const auto seen = seenAlong(test::edgesAround(250, random), truth, random);
  const Poses tracked = noisy(truth, 0.01, 0.5 * kRadiansPerDegree, random);
  const Poses refined = posesOf(refine(seen, tracked, quick()));
  const auto spread = [](const Poses& poses) {
    double sum = 0;
    for (const Rigid3& pose : poses) sum += metresApart(pose, poses.front());
    return sum;
  };
  EXPECT_LT(spread(refined), 0.5 * spread(tracked));
}

TEST(KeyframeRefiner, ExtremeVariancesMakeNothingWorse) {
  for (const float variance : {0.0F, 1e-20F, 1e3F, 1e20F}) {
    SCOPED_TRACE(variance);
    Walk walk;
    for (KeyframeDepthMap& keyframe : walk.seen) keyframe.map.variance = variance;
    walk.expectErrors(1.1);
  }
}

TEST(KeyframeRefiner, APoseOrANoiseThatIsNotFiniteIsRejectedAndChangesNothing) {
  const Walk walk;
  KeyframeRefiner plain(quick());
  KeyframeRefiner disturbed(quick());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Rigid3 rotated;
  rotated.rotation.x() = nan;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto cloud = [&] { return RegistrationCloud(walk.seen[i], quick().points); };
    const auto expect_rejected = [&](const Rigid3& pose, const std::optional<PoseNoise>& stated) {
      EXPECT_THAT([&] { disturbed.add(cloud(), pose, stated); },
                  ThrowsMessage<std::invalid_argument>(HasSubstr("keyframe: ")));
    };
    expect_rejected(rotated, {});
    expect_rejected(viewTurned(0, {0, 0, std::numeric_limits<double>::infinity()}), {});
    for (const double beyond_m : {-1.001e9, 1.001e9}) {
      expect_rejected(viewTurned(0, {beyond_m, 0, 0}), {});
      expect_rejected(viewTurned(0, {0, beyond_m, 0}), {});
    }
    for (const double wrong : {nan, -1e-9, std::numeric_limits<double>::infinity()}) {
      expect_rejected({}, PoseNoise{wrong, 0});
      expect_rejected({}, PoseNoise{0, wrong});
    }
    EXPECT_NO_THROW(KeyframeRefiner::requireUsable(viewTurned(0, {0, 0, -1e9}), PoseNoise{}));
    EXPECT_EQ(disturbed.keyframes(), i);
    plain.add(cloud(), walk.tracked[i]);
    disturbed.add(cloud(), walk.tracked[i]);
    EXPECT_TRUE(sameBits(disturbed.T_world_ref(i), plain.T_world_ref(i))) << i;
  }
}

TEST(KeyframeRefiner, CountsMinimaThatCannotBeComputedAndMovesNothing) {
  const Walk walk;
  KeyframeRefiner refiner(quick());
  for (std::size_t i = 0; i < walk.seen.size(); ++i) {
    refiner.add(RegistrationCloud(walk.seen[i], quick().points), walk.tracked[i]);
  }
  EXPECT_EQ(refiner.counts().failed_solves, 0U);
  const Poses before = posesOf(refiner);
  Rigid3 not_a_number;
  not_a_number.translation.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(refiner.propose({0, 9, not_a_number}));
  EXPECT_GT(refiner.counts().failed_solves, 0U);
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_TRUE(sameBits(refiner.T_world_ref(i), before[i])) << i;
  }
}

TEST(KeyframeRefiner, SaysWhichKeyframesMoved) {
  const Walk walk;
  RefinementOptions options = quick();
  options.window = 4;
  options.loop.loops = false;
  KeyframeRefiner refiner(options);
  EXPECT_TRUE(refiner.takeMoved().empty());
  Poses known;
  for (std::size_t i = 0; i < walk.seen.size(); ++i) {
    refiner.add(RegistrationCloud(walk.seen[i], options.points), walk.tracked[i]);
    const std::map<std::size_t, Rigid3> moved = refiner.takeMoved();
    EXPECT_TRUE(refiner.takeMoved().empty());
    EXPECT_LE(moved.size(), 4U) << "the window";
    ASSERT_FALSE(moved.empty());
    EXPECT_EQ(moved.rbegin()->first, i) << "the new one too";
    known.resize(i + 1);
    for (const auto& [k, T_world_ref] : moved) known[k] = T_world_ref;
    for (std::size_t k = 0; k <= i; ++k) {
      EXPECT_TRUE(sameBits(known[k], refiner.T_world_ref(k))) << k << " moved unsaid at " << i;
    }
  }
}

/// Draws edges that repeat every 1.5 m along x.
Edges repeatingEdges(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  Edges world;
  for (int i = 0; i < 30; ++i) {
    const Eigen::Vector3d middle(0.75 * uniform(random), 1.2 * uniform(random),
                                 3 + 0.8 * uniform(random));
    const Eigen::Vector3d direction(uniform(random), uniform(random), uniform(random));
    const Eigen::Vector3d half = 0.3 * direction.normalized();
    for (int repeat = -3; repeat <= 4; ++repeat) {
      const Eigen::Vector3d offset(1.5 * repeat, 0, 0);
      world.push_back({middle + offset - half, middle + offset + half});
    }
  }
  return world;
}

TEST(KeyframeRefiner, ALoopThatOtherFactorsContradictIsDropped) {
  std::mt19937 random(1);
  Poses truth;
  for (int i = 0; i <= 15; ++i) truth.push_back(viewTurned(0, {0.1 * i, 0, 0}));
  const auto seen = seenAlong(repeatingEdges(random), truth, random);
  RefinementOptions options = quick();
  options.loop.loops = false;
  const Poses without = posesOf(refine(seen, truth, options));
  KeyframeRefiner refiner(options);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    refiner.add(RegistrationCloud(seen[i], options.points), truth[i]);
  }
  ASSERT_TRUE(refiner.propose({0, 15, {}})) << "both see the same";
  refiner.finish();
  EXPECT_EQ(refiner.counts().loops, 1U);
  EXPECT_EQ(refiner.counts().loops_dropped, 1U);
  for (std::size_t i = 0; i < without.size(); ++i) {
    EXPECT_LT(metresApart(refiner.T_world_ref(i), without[i]), 0.02) << i;
  }
}

TEST(KeyframeRefiner, ProposalsOfUnknownKeyframesAreRejected) {
  const Walk walk;
  KeyframeRefiner refiner(quick());
  EXPECT_THROW(refiner.propose({0, 1, {}}), std::invalid_argument);
  for (std::size_t i = 0; i < 3; ++i) {
    refiner.add(RegistrationCloud(walk.seen[i], quick().points), walk.tracked[i]);
  }
  const auto rejected = [&](std::size_t older, std::size_t newer) {
    return messageOf([&] { refiner.propose({older, newer, {}}); });
  };
  EXPECT_THAT(rejected(0, 3), HasSubstr("newer keyframe of a loop = 3"));
  EXPECT_THAT(rejected(3, 2), HasSubstr("older keyframe of a loop = 3"));
  EXPECT_THAT(rejected(1, 1), HasSubstr("another one"));
  EXPECT_EQ(refiner.counts().loop_checks, 0U);
}

TEST(KeyframeRefiner, CorrectsCurrentPosesOfTheTrackerAndStatesTheirCovariance) {
  EXPECT_TRUE(sameBits(KeyframeRefiner(quick()).T_world_odom(), Rigid3{}));
  EXPECT_EQ(KeyframeRefiner(quick()).covariance(), quick().tracker.noiseCovariance());
  double squared_sigmas = 0;
  constexpr int kSeeds = 4;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    std::mt19937 random(seed);
    const Poses truth = circle(9, 5);  // the window includes the first pose
    const auto seen = seenAlong(test::edgesAround(250, random), truth, random);
    Poses tracked = noisy(truth, 0.01, 0.5 * kRadiansPerDegree, random);
    tracked[0] = truth[0];
    KeyframeRefiner refiner(quick());
    for (std::size_t i = 0; i < seen.size(); ++i) {
      refiner.add(RegistrationCloud(seen[i], quick().points), tracked[i]);
    }
    const Matrix6d& covariance = refiner.covariance();
    EXPECT_TRUE(covariance.isApprox(covariance.transpose(), 1e-9));
    ASSERT_EQ(covariance.llt().info(), Eigen::Success) << seed;
    EXPECT_LT(metresApart(refiner.T_world_odom() * tracked.back(), refiner.T_world_ref_denoised()),
              1e-9);
    // The next pose of the tracker is between keyframes and has its own noise.
    const Rigid3 now = truth.back() * viewTurned(0.02, {0.02, 0, 0});
    const Rigid3 corrected =
        refiner.T_world_odom() * (now * drawMotion(0.01, 0.5 * kRadiansPerDegree, random));
    Vector6d error;
    error << corrected.translation - now.translation,
        differenceOf({(corrected.rotation * now.rotation.conjugate()), {}}).tail<3>();
    squared_sigmas += error.dot(covariance.ldlt().solve(error));
  }
  // Chi-squared with 24 degrees of freedom is above 48 in one of 400 draws.
  EXPECT_LT(squared_sigmas, 48);
  EXPECT_GT(squared_sigmas, 3);
}

TEST(KeyframeRefiner, WorksWithTheSmallestWindowAndMap) {
  RefinementOptions options = quick();
  options.window = 1;
  options.map_keyframes = 1;
  Walk().expectErrors(1, options);
}

TEST(KeyframeRefiner, AJumpOfTheTrackerAndBackLeavesNoError) {
  for (const double jump_m : {10.0, 1e8}) {
    Walk walk;
    walk.tracked[5].translation.x() += jump_m;
    const Poses refined = walk.refined();
    for (std::size_t i = 0; i < refined.size(); ++i) {
      ASSERT_TRUE(refined[i].translation.allFinite()) << i;
      if (i == 5) continue;
      const Rigid3 T_first_ref = walk.truth[0].inverse() * walk.truth[i];
      const Rigid3 refined_first = refined[0].inverse() * refined[i];
      // Four standard deviations of the difference of two tracker poses.
      EXPECT_LT(metresApart(refined_first, T_first_ref), 4 * std::sqrt(2) * 0.02)
          << jump_m << ", " << i;
    }
  }
}

TEST(KeyframeRefiner, RejectsOptionsOutOfRange) {
  RefinementOptions options;
  options.graph.max_iterations = 0;
  EXPECT_THROW(KeyframeRefiner{options}, OptionError);
}

}  // namespace
}  // namespace efm
