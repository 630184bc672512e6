// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include <cmath>
#include <limits>
#include <random>

#include "edges.h"
#include "mapping/geometry/rigid3.h"
#include "maps/refinement/keyframe_graph.h"
#include "maps/refinement/tracker_model.h"
#include "random_poses.h"

namespace efm {
namespace {

using test::drawVector;
using test::emptyKeyframe;
using test::smallView;

/// Draws samples of a tracker with the errors `truth` and of registrations with 2 mm and 0.1 deg.
std::vector<MotionSample> drawSamples(const TrackerErrors& truth, int count, double path_length_m,
                                      std::mt19937& random) {
  std::vector<MotionSample> samples;
  for (int i = 0; i < count; ++i) {
    MotionSample sample;
    sample.path_length_m = path_length_m * (1 + i % 4);
    sample.covariance = test::covarianceOf(0.002, 0.1 * kRadiansPerDegree);
    const Matrix6d all = sample.covariance + 2 * truth.noiseCovariance() +
                         truth.driftCovariance(sample.path_length_m);
    Vector6d unit;
    unit << drawVector(1, random), drawVector(1, random);
    sample.difference = all.llt().matrixL() * unit;
    samples.push_back(sample);
  }
  return samples;
}

bool same(const TrackerErrors& a, const TrackerErrors& b) {
  return a.noise_m == b.noise_m && a.noise_rad == b.noise_rad && a.drift_m == b.drift_m &&
         a.drift_rad == b.drift_rad;
}

TEST(TrackerErrors, CovariancesAreWorkedOutByHand) {
  const TrackerErrors errors{0.03, 0.02, 0.01, 0.005};
  Vector6d noise;
  noise << Eigen::Vector3d::Constant(9e-4 + 1e-8), Eigen::Vector3d::Constant(4e-4 + 1e-10);
  EXPECT_LT((errors.noiseCovariance() - Matrix6d(noise.asDiagonal())).norm(), 1e-15);
  Vector6d drift;  // random walk: sigma at 0.25 m is half the sigma at 1 m
  drift << Eigen::Vector3d::Constant(2.5e-5 + 1e-8), Eigen::Vector3d::Constant(6.25e-6 + 1e-10);
  EXPECT_LT((errors.driftCovariance(0.25) - Matrix6d(drift.asDiagonal())).norm(), 1e-15);
  Vector6d far;  // one direction: sigma at 4 m is 4 times the sigma at 1 m
  far << Eigen::Vector3d::Constant(1.6e-3 + 1e-8), Eigen::Vector3d::Constant(4e-4 + 1e-10);
  EXPECT_LT((errors.driftCovariance(4) - Matrix6d(far.asDiagonal())).norm(), 1e-15);
}

/// Returns the log probability of errors under the model of `estimateTrackerErrors`: Student's
/// t-distribution with 10 degrees of freedom, two samples count as one, lognormal priors.
double logPosterior(const std::vector<MotionSample>& samples, const TrackerErrors& errors,
                    const TrackerErrors& expected) {
  double sum = 0;
  for (const MotionSample& sample : samples) {
    const Matrix6d covariance = sample.covariance + errors.noiseCovariance(sample.from) +
                                errors.noiseCovariance(sample.to) +
                                errors.driftCovariance(sample.path_length_m);
    const double squared = sample.difference.dot(covariance.inverse() * sample.difference);
    sum -= 0.25 * std::log(covariance.determinant()) + 4 * std::log(1 + squared / 10);
  }
  const auto prior = [](double error, double expected_error, double factor) {
    return -0.5 * std::pow(std::log(error / expected_error) / std::log(factor), 2);
  };
  return sum + prior(errors.noise_m, expected.noise_m, 10) +
         prior(errors.noise_rad, expected.noise_rad, 10) +
         prior(errors.drift_m, expected.drift_m, 2) +
         prior(errors.drift_rad, expected.drift_rad, 2);
}

TEST(EstimateTrackerErrors, IsAsLikelyAsItsNeighboursAtLeast) {
  constexpr double TrackerErrors::*kFields[] = {&TrackerErrors::noise_m, &TrackerErrors::noise_rad,
                                                &TrackerErrors::drift_m, &TrackerErrors::drift_rad};
  for (unsigned seed = 1; seed <= 6; ++seed) {
    std::mt19937 random(seed);
    const TrackerErrors expected{0.02, 0.004, 0.01, 0.003};
    TrackerErrors truth = expected;
    truth.*kFields[seed % 4] *= seed % 2 == 0 ? 5 : 0.2;
    auto samples = drawSamples(truth, 20, 0.3, random);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      samples[i].from = {0.5 + 0.1 * static_cast<double>(i), 2};
      samples[i].to = {1, 0.3 * static_cast<double>(i)};
    }
    if (seed > 3) samples[4].difference << drawVector(1, random), drawVector(1, random);  // failed
    const TrackerErrors found = estimateTrackerErrors(samples, expected);
    const double best = logPosterior(samples, found, expected);
    EXPECT_GT(best, logPosterior(samples, expected, expected)) << seed;
    for (const auto field : kFields) {
      for (const double change : {-0.25, 0.25}) {  // the last steps of the search
        TrackerErrors changed = found;
        changed.*field *= std::exp(change);
        EXPECT_LT(logPosterior(samples, changed, expected), best + 1e-9) << seed;
      }
    }
  }
  EXPECT_TRUE(
      same(estimateTrackerErrors({}, {0.02, 0.01, 0.03, 0.002}), {0.02, 0.01, 0.03, 0.002}));
}

TEST(TrackerModel, ScalesStatedNoiseIsCautiousAndIncreasesItsDriftToALimit) {
  const TrackerErrors expected{0.02, 0.004, 0.01, 0};
  TrackerModel model(expected, true);
  const NoiseScale scale = model.scaleOf(PoseNoise{0.06, 0.002});
  EXPECT_DOUBLE_EQ(scale.translation, 3);
  EXPECT_DOUBLE_EQ(scale.rotation, 0.5);
  EXPECT_EQ(model.scaleOf({}).translation, 1);
  EXPECT_EQ(TrackerModel({0, 0, 0, 0}, true).scaleOf(PoseNoise{0.06, 0.002}).rotation, 1);
  for (const double factor : {3.0, 9.0, 9.0}) {
    EXPECT_EQ(model.increaseDrift(), model.inGraph().drift_m < 0.08);
    EXPECT_NEAR(model.inGraph().drift_m, factor * 0.01, 1e-15);
    EXPECT_EQ(model.inGraph().noise_m, 0.02);
  }
  EXPECT_EQ(model.errors().drift_m, 0.01);

  // Exact motions reduce the estimate; registrations reduce it to a quarter at most.
  const auto keyframe = [] {
    return RefinedKeyframe{RegistrationCloud(emptyKeyframe(smallView()), {}), {}, {}, {}};
  };
  const RefinedKeyframe from = keyframe();
  RefinedKeyframe to = keyframe();
  to.T_odom_ref.translation = {0.1, 0, 0};
  to.path_length_m = 0.1;
  RelativePoseFactor factor{0, 1, to.T_odom_ref};
  factor.sqrt_information *= 1e4;
  for (int i = 0; i < 30; ++i) model.addSample(factor, from, to);
  EXPECT_TRUE(same(model.errors(), expected)) << "until the update";
  model.update();
  EXPECT_LT(model.errors().noise_m, 0.004);
  EXPECT_LT(model.errors().noise_rad, 0.0008);
  EXPECT_EQ(model.cautious().noise_m, 0.005);
  EXPECT_EQ(model.cautious().noise_rad, 0.001);
  TrackerModel fixed(expected, false);
  fixed.addSample(factor, from, to);
  fixed.update();
  EXPECT_TRUE(same(fixed.cautious(), expected));
}

TEST(EstimateTrackerErrors, StaysFiniteWhateverTheSamplesAre) {
  std::mt19937 random(4);
  const TrackerErrors expected;
  for (const double strange : {0.0, 1e12, 1e200, std::numeric_limits<double>::infinity(),
                               std::numeric_limits<double>::quiet_NaN()}) {
    auto samples = drawSamples(expected, 10, 0.1, random);
    samples[3].difference.setConstant(strange);
    samples[5].path_length_m = strange;
    EXPECT_TRUE(same(estimateTrackerErrors(samples, {0, 0, 0, 0}), {0, 0, 0, 0})) << strange;
    const TrackerErrors found = estimateTrackerErrors(samples, expected);
    for (const double error : {found.noise_m, found.noise_rad, found.drift_m, found.drift_rad}) {
      EXPECT_TRUE(std::isfinite(error) && error > 0) << strange;
      EXPECT_LT(error, 1) << strange;
    }
  }
}

}  // namespace

// Graphs of many keyframes.

namespace {

using test::covarianceOf;
using test::drawMotion;
using test::metresApart;

/// Keyframes without points on a circle of 10 m. The tracker drifts as expected. Loops to the
/// previous lap are exact.
struct Laps {
  static constexpr std::size_t kLap = 150;

  std::mt19937 random{3};
  std::vector<Rigid3> truth;
  KeyframeGraph graph{{}, {}, TrackerModel({}, false)};

  explicit Laps(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      const double yaw = 2 * M_PI * static_cast<double>(i) / kLap;
      truth.push_back(test::viewTurned(yaw, {10 * std::sin(yaw), 0, 10 * std::cos(yaw)}));
      addKeyframe(i);
      if (i >= kLap && i % 10 == 0) addLoop(i - kLap, i);
    }
  }

  void addKeyframe(std::size_t i) {
    RefinedKeyframe keyframe{RegistrationCloud(test::emptyKeyframe(test::smallView()), {}),
                             truth[i], truth[i], truth[i]};
    if (i > 0) {
      const RefinedKeyframe& last = graph.keyframes[i - 1];
      const Rigid3 motion = truth[i - 1].inverse() * truth[i];
      const double root_m = std::sqrt(motion.translation.norm());
      const TrackerErrors errors;
      keyframe.T_odom_ref = last.T_odom_ref * motion *
                            drawMotion(errors.drift_m * root_m, errors.drift_rad * root_m, random);
      keyframe.path_length_m = last.path_length_m + motion.translation.norm();
    }
    keyframe.T_world_ref = keyframe.T_world_ref_denoised = keyframe.T_odom_ref;
    keyframe.first_factor = graph.factors.size();
    graph.keyframes.push_back(std::move(keyframe));
  }

  void addLoop(std::size_t older, std::size_t newer) {
    RelativePoseFactor loop{older, newer, truth[older].inverse() * truth[newer],
                            sqrtInformation(covarianceOf(0.005, 0.1 * kRadiansPerDegree))};
    loop.robust = true;
    graph.factors.push_back(loop);
  }

  double rmsM() const {
    double squared = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      squared += std::pow(metresApart(graph.keyframes[i].T_world_ref, truth[i]), 2);
    }
    return std::sqrt(squared / static_cast<double>(truth.size()));
  }
};

TEST(SolveCondensed, IsNearlyAsGoodAsTheWholeGraph) {
  Laps whole(2 * kMaxSolvedTogether);
  Laps condensed(2 * kMaxSolvedTogether);
  const double before_m = whole.rmsM();
  PoseGraphOptions trusting;
  trusting.robust_sigmas = 1000;
  whole.graph.solveFrom(1, trusting);
  solveCondensed(condensed.graph, 1, trusting);
  EXPECT_EQ(condensed.graph.failed_solves, 0U);
  EXPECT_LT(whole.rmsM(), 0.5 * before_m);
  EXPECT_LT(condensed.rmsM(), 1.2 * whole.rmsM());
}

TEST(SolveCondensed, LeavesFixedKeyframesAndStepsBetweenOthers) {
  Laps laps(1500);
  const Laps before(1500);
  constexpr std::size_t kFirstFree = 400;
  solveCondensed(laps.graph, kFirstFree, {});
  for (std::size_t i = 0; i < 1500; ++i) {
    const RefinedKeyframe& keyframe = laps.graph.keyframes[i];
    const RefinedKeyframe& was = before.graph.keyframes[i];
    EXPECT_EQ(isSame(keyframe.T_world_ref, was.T_world_ref), i < kFirstFree) << i;
    if (i == 0) continue;
    const Rigid3 step = laps.graph.keyframes[i - 1].T_world_ref.inverse() * keyframe.T_world_ref;
    const Rigid3 step_was = before.graph.keyframes[i - 1].T_world_ref.inverse() * was.T_world_ref;
    // A correction of metres is distributed over hundreds of steps of 0.4 m.
    EXPECT_LT(metresApart(step, step_was), 0.02) << i;
  }
}

TEST(SolveCondensed, WithoutAMinimumIsCountedAndMovesNothing) {
  Laps laps(600);
  laps.graph.factors.back().offset[0] = std::numeric_limits<double>::quiet_NaN();
  const Laps before(600);
  solveCondensed(laps.graph, 1, {});
  EXPECT_EQ(laps.graph.failed_solves, 1U);
  for (std::size_t i = 0; i < 600; ++i) {
    EXPECT_TRUE(isSame(laps.graph.keyframes[i].T_world_ref, before.graph.keyframes[i].T_world_ref));
  }
}

TEST(KeyframeGraph, OfTooManyPlacesTheMostRedundantOneLosesItsPoints) {
  std::mt19937 random(1);
  KeyframeDepthMap seen = test::seenFrom(test::edgesAround(20, random), {}, 0.0025, random);
  test::keepFirst(20, seen);
  KeyframeGraph graph{{}, {}, TrackerModel({}, false)};
  constexpr std::size_t kPlaces = 1000;
  constexpr std::size_t kTwice = 700;
  for (std::size_t i = 0; i <= kPlaces; ++i) {
    Rigid3 T_world_ref;
    T_world_ref.translation.x() = static_cast<double>(i == kTwice ? 2 : 10 * i);
    graph.keyframes.push_back({RegistrationCloud(seen, {}), T_world_ref, T_world_ref, T_world_ref});
    graph.addPlace(i);
    EXPECT_EQ(graph.places.size(), std::min(i + 1, kPlaces));
  }
  for (std::size_t i = 0; i <= kPlaces; ++i) {
    EXPECT_EQ(graph.keyframes[i].cloud.points().empty(), i == kTwice) << i;
  }
  EXPECT_EQ(graph.nearestViews().front(), kPlaces);
  EXPECT_EQ(graph.nearestViews().size(), 50U);
}

TEST(KeyframeGraph, RanksKeyframesByOverlapAndByTheDistanceOfWhatTheySee) {
  KeyframeDepthMap wall = test::emptyKeyframe(test::smallView());
  wall.map.depth = 2;
  wall.map.variance = 1e-4;
  KeyframeGraph graph{{}, {}, TrackerModel({}, false)};
  const Rigid3 poses[] = {test::viewTurned(0, {0, 0, 0}),      test::viewTurned(0, {0, 0, -4}),
                          test::viewTurned(M_PI, {1.8, 0, 0}), test::viewTurned(M_PI, {0.3, 0, 0}),
                          test::viewTurned(M_PI, {0.9, 0, 0}), test::viewTurned(M_PI, {0, 0, 0})};
  for (const Rigid3& T_world_ref : poses) {
    graph.keyframes.push_back({RegistrationCloud(wall, {}), T_world_ref, T_world_ref, T_world_ref});
  }
  using Numbers = std::vector<std::size_t>;
  // The newest keyframe sees (0, 0, -2), as keyframe 1 does from the other side. 1.8 m are 117 and
  // 0.9 m are 59 of its 160 columns (depth 2 m, focal length 130 px).
  EXPECT_EQ(graph.bestOverlaps({0, 1, 2, 3, 4}, 0.1, 9), (Numbers{1, 3, 4, 2}));
  EXPECT_EQ(graph.bestOverlaps({0, 1, 2, 3, 4}, 0.1, 2), (Numbers{1, 3}));
  EXPECT_EQ(graph.bestOverlaps({2, 4}, 0.4, 9), (Numbers{4}));
  graph.places = {0, 1, 2, 3, 4};
  EXPECT_EQ(graph.nearestViews(), (Numbers{1, 3, 4, 2, 0}));
}

TEST(WindowGraph, TheErrorOfADenoisedPoseIsTheFirstPosesNoiseAndTheDriftSince) {
  std::vector<RefinedKeyframe> keyframes;
  for (const double path_length_m : {0.0, 0.7}) {
    keyframes.push_back({RegistrationCloud(test::emptyKeyframe(test::smallView()), {}), Rigid3{},
                         Rigid3{}, Rigid3{}, path_length_m});
  }
  WindowGraph window(keyframes, 1);
  TrackerErrors errors;
  errors.noise_m = 0.02;
  window.addTracker(errors);
  ASSERT_TRUE(window.solve({}));
  const auto covariance = window.denoisedCovariance({}, 1);
  ASSERT_TRUE(covariance);
  const Matrix6d expected = errors.noiseCovariance() + errors.driftCovariance(0.7);
  EXPECT_TRUE(covariance->isApprox(expected, 1e-6)) << *covariance << "\n" << expected;
}

}  // namespace

}  // namespace efm
