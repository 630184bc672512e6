// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "edges.h"
#include "mapping/geometry/rigid3.h"
#include "maps/refinement/keyframe_registration.h"
#include "maps/refinement/registration_points.h"
#include "random_poses.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using test::drawMotion;
using test::Edges;
using test::kInverseDepthSigma;
using test::metresApart;
using test::priorOf;
using test::radiansApart;
using test::seenFrom;
using test::viewTurned;

/// Two views of a world, one step apart. The first view is the map.
struct Step {
  Rigid3 T_world_map = viewTurned(0, {0, 0, 0});
  Rigid3 T_world_ref = viewTurned(4 * kRadiansPerDegree, {0.15, 0.02, 0.05});
  RegistrationCloud map;
  RegistrationCloud cloud;

  Step(const Edges& world, std::mt19937& random, double sigma = kInverseDepthSigma)
      : map(seenFrom(world, T_world_map, sigma, random), {}),
        cloud(seenFrom(world, T_world_ref, sigma, random), {}) {}

  Registration from(const PosePrior& prior, const KeyframeRegistrationOptions& options = {}) const {
    return registerKeyframe(1, cloud, {{0, &map, T_world_map}}, prior, options);
  }
};

TEST(KeyframeRegistration, FindsAPoseThatThePriorMissesByTwoCentimetresAndADegree) {
  constexpr int kSeeds = 8;
  double squared_m = 0;
  double squared_rad = 0;
  double squared_sigmas = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    std::mt19937 random(seed);
    const Step step(test::edgesAround(150, random), random);
    const Rigid3 prior = step.T_world_ref * drawMotion(0.02, 1 * kRadiansPerDegree, random);
    const Registration found = step.from(priorOf(prior, 0.02, 1 * kRadiansPerDegree));
    squared_m += std::pow(metresApart(found.T_world_ref, step.T_world_ref), 2);
    squared_rad += std::pow(radiansApart(found.T_world_ref, step.T_world_ref), 2);
    EXPECT_GT(found.inlierRatio(), 0.6) << seed;
    EXPECT_LE(found.inliers, found.visible) << seed;
    EXPECT_LE(found.visible, step.cloud.numQueryPoints()) << seed;
    EXPECT_GT(found.from_prior, 0.5) << seed;
    EXPECT_LT(found.median_error, 1) << seed;
    ASSERT_EQ(found.factors.size(), 1U);
    const RelativePoseFactor& factor = found.factors[0];
    EXPECT_EQ(factor.from, 0U);
    EXPECT_EQ(factor.to, 1U);
    EXPECT_FALSE(factor.robust);
    squared_sigmas += std::pow(errorOf(factor, step.T_world_map, step.T_world_ref), 2) -
                      std::pow(errorOf(factor, step.T_world_map, found.T_world_ref), 2);
  }
  // About 800 points are measured across their edges only, with pixels of 0.44 deg (1.3 cm at 3 m):
  // errors of 6.6 mm and 0.15 deg, because rotation and translation are correlated.
  EXPECT_LT(std::sqrt(squared_m / kSeeds), 0.009);
  EXPECT_LT(std::sqrt(squared_rad / kSeeds), 0.2 * kRadiansPerDegree);
  // Chi-squared with 48 degrees of freedom is above 75 in 1 % of the draws.
  EXPECT_LT(squared_sigmas, 75);
  EXPECT_GT(squared_sigmas, 5);
}

TEST(KeyframeRegistration, FindsAPoseThatAnUncertainPriorMissesByManyPixels) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    std::mt19937 random(seed);
    const Step step(test::edgesAround(150, random), random);
    const Rigid3 off = viewTurned(3 * kRadiansPerDegree, {0.06, -0.04, 0.03});  // 7 px and 2 px
    const Registration found =
        step.from(priorOf(step.T_world_ref * off, 0.05, 2 * kRadiansPerDegree));
    // Limits are twice those of the more certain prior above.
    EXPECT_LT(metresApart(found.T_world_ref, step.T_world_ref), 0.018) << seed;
    EXPECT_LT(radiansApart(found.T_world_ref, step.T_world_ref), 0.4 * kRadiansPerDegree) << seed;
  }
}

TEST(KeyframeRegistration, SeveralKeyframesGiveAFactorEach) {
  std::mt19937 random(3);
  const Edges world = test::edgesAround(150, random);
  const Step step(world, random);
  const Rigid3 T_world_other = viewTurned(-3 * kRadiansPerDegree, {-0.1, 0, 0});
  const RegistrationCloud other(seenFrom(world, T_world_other, kInverseDepthSigma, random), {});
  const RegistrationCloud nothing(test::emptyKeyframe(test::smallView()), {});
  const std::vector<MapKeyframe> map = {
      {7, &step.map, step.T_world_map}, {3, &nothing, T_world_other}, {5, &other, T_world_other}};
  const Rigid3 prior = step.T_world_ref * drawMotion(0.02, 1 * kRadiansPerDegree, random);
  const Registration found =
      registerKeyframe(9, step.cloud, map, priorOf(prior, 0.02, 1 * kRadiansPerDegree), {});
  ASSERT_EQ(found.factors.size(), 2U);
  EXPECT_EQ(found.factors[0].from, 7U);
  EXPECT_EQ(found.factors[1].from, 5U);
  for (const RelativePoseFactor& factor : found.factors) EXPECT_EQ(factor.to, 9U);
  EXPECT_LT(metresApart(found.T_world_ref, step.T_world_ref), 0.006);
}

TEST(KeyframeRegistration, ItsFactorsHaveTheirMinimumAtItsPose) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    std::mt19937 random(seed);
    const Step step(test::edgesAround(150, random), random);
    const Rigid3 off = step.T_world_ref * drawMotion(0.02, 1 * kRadiansPerDegree, random);
    // The points determine the pose, because the prior is uncertain.
    const Registration found = step.from(priorOf(off, 0.5, 0.2));
    // The minimum may be off by the motion of the last round.
    const RelativePoseFactor& factor = found.factors[0];
    const Vector6d minimum = -(factor.sqrt_information.transpose() * factor.sqrt_information +
                               1e-6 * Matrix6d::Identity())
                                  .ldlt()
                                  .solve(factor.sqrt_information.transpose() * factor.offset);
    EXPECT_LT(minimum.head<3>().norm(), 0.003) << seed;
    EXPECT_LT(minimum.tail<3>().norm(), 0.1 * kRadiansPerDegree) << seed;
  }
}

TEST(KeyframeRegistration, WithoutOverlapItIsThePriorWithoutFactors) {
  std::mt19937 random(6);
  const Step step(test::edgesAround(150, random), random);
  const RegistrationCloud nothing(test::emptyKeyframe(test::smallView()), {});
  const auto stays = [](const Registration& found, const Rigid3& prior, const char* why) {
    EXPECT_LT(metresApart(found.T_world_ref, prior), 1e-12) << why;
    EXPECT_LT(radiansApart(found.T_world_ref, prior), 1e-12) << why;
    EXPECT_TRUE(found.factors.empty()) << why;
    EXPECT_EQ(found.inliers, 0U) << why;
    EXPECT_EQ(found.inlierRatio(), 0) << why;
    EXPECT_EQ(found.median_error, 0) << why;
    EXPECT_NEAR(found.from_prior, 0, 1e-9) << why;
  };
  const Rigid3 behind = viewTurned(M_PI, {0, 0, 0});
  stays(step.from(priorOf(behind, 0.02, 0.02)), behind, "looks the other way");
  const Rigid3 away = viewTurned(0, {50, 0, 0});
  stays(step.from(priorOf(away, 0.02, 0.02)), away, "is elsewhere");
  const PosePrior prior = priorOf(step.T_world_ref, 0.02, 0.02);
  stays(registerKeyframe(1, nothing, {{0, &step.map, {}}}, prior, {}), step.T_world_ref,
        "no points");
  stays(registerKeyframe(1, step.cloud, {{0, &nothing, {}}}, prior, {}), step.T_world_ref,
        "no points in the map");
  stays(registerKeyframe(1, step.cloud, {}, prior, {}), step.T_world_ref, "no map");
}

TEST(KeyframeRegistration, AlongStripesItStaysWithThePrior) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    std::mt19937 random(seed);
    const Step step(test::stripes(), random);
    const Rigid3 off = step.T_world_ref * drawMotion(0.02, 0, random);
    const Registration found = step.from(priorOf(off, 0.02, 0.2 * kRadiansPerDegree));
    // Along a stripe, every point has a near neighbour. Only chance and the rotation about y change
    // x; the rotation stays within its prior (0.2 deg at 3 m: 1 cm).
    const Eigen::Vector3d before = off.translation - step.T_world_ref.translation;
    const Eigen::Vector3d after = found.T_world_ref.translation - step.T_world_ref.translation;
    EXPECT_NEAR(after.x(), before.x(), 0.01) << seed;
    EXPECT_LT(std::abs(after.y()), 0.006) << seed;
  }
}

TEST(KeyframeRegistrationOptions, TheFirstDistanceIsAtLeastTheLast) {
  KeyframeRegistrationOptions options;
  const auto error = [&] { return messageOf([&] { options.validate(); }); };
  options.first_distance_px = options.last_distance_px = 1e4;
  EXPECT_EQ(error(), "no error");
  const std::string expected = ": must be from last_distance_px to 10000 (pixels)";
  options.first_distance_px = 9999;
  EXPECT_EQ(error(), "first_distance_px = 9999" + expected);
  options.first_distance_px = 10'001;
  EXPECT_EQ(error(), "first_distance_px = 10001" + expected);
}

using test::emptyKeyframe;
using test::smallView;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kFloatNan = std::numeric_limits<float>::quiet_NaN();

void put(KeyframeDepthMap& keyframe, int x, int y, float depth, float sigma) {
  keyframe.map.depth(y, x) = depth;
  keyframe.map.variance(y, x) = sigma * sigma;
}

/// Returns a wall 2 m in front of the view.
KeyframeDepthMap wall(float sigma) {
  KeyframeDepthMap keyframe = emptyKeyframe(smallView());
  keyframe.map.depth = 2;
  keyframe.map.variance = sigma * sigma;
  return keyframe;
}

RegistrationCloudOptions few(int max_points, int max_map_points) {
  RegistrationCloudOptions options;
  options.max_points = max_points;
  options.max_map_points = max_map_points;
  return options;
}

/// Returns the pixel of a point.
cv::Point pixelOf(const RegistrationPoint& point) {
  const Eigen::Vector2d at = smallView().project(point.p_ref.cast<double>());
  return {static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y()))};
}

TEST(RegistrationCloud, HasAtMostTheRequestedNumberOfPoints) {
  const KeyframeDepthMap keyframe = wall(0.01F);  // 19,200 points
  for (const auto& [chosen, all] : {std::pair{10, 10}, {100, 350}, {2000, 6000}}) {
    const RegistrationCloud cloud(keyframe, few(chosen, all));
    EXPECT_EQ(cloud.numQueryPoints(), static_cast<std::size_t>(chosen));
    EXPECT_EQ(cloud.points().size(), static_cast<std::size_t>(all));
  }
  const RegistrationCloud everything(keyframe, few(100000, 1000000));
  EXPECT_EQ(everything.numQueryPoints(), 19200U);
  EXPECT_EQ(everything.points().size(), 19200U);
}

TEST(RegistrationCloud, SpreadsItsPointsWhereOneCornerIsTheMostCertain) {
  KeyframeDepthMap keyframe = wall(0.02F);
  keyframe.map.variance(cv::Rect(0, 0, 80, 60)) = 1e-6F;
  const RegistrationCloud cloud(keyframe, few(200, 400));
  std::array<int, 4> of_quadrant{};
  for (std::size_t i = 0; i < cloud.numQueryPoints(); ++i) {
    const cv::Point pixel = pixelOf(cloud.points()[i]);
    ++of_quadrant[(pixel.x >= 80 ? 1 : 0) + (pixel.y >= 60 ? 2 : 0)];
  }
  // 100 cells for 400 points: about 25 for each quadrant. Each cell gives one point; the other
  // points are the most certain ones.
  for (const int points : of_quadrant) EXPECT_GE(points, 20);
}

TEST(RegistrationCloud, SelectsTheMostCertainPointsOfACell) {
  KeyframeDepthMap keyframe = wall(0.02F);
  for (int y = 0; y < 120; y += 4) {
    for (int x = 0; x < 160; x += 4) put(keyframe, x, y, 2, 0.002F);  // 1200 points
  }
  const RegistrationCloud cloud(keyframe, few(100, 400));
  for (std::size_t i = 0; i < cloud.numQueryPoints(); ++i) {
    const cv::Point pixel = pixelOf(cloud.points()[i]);
    EXPECT_EQ(pixel.x % 4, 0);
    EXPECT_EQ(pixel.y % 4, 0);
  }
}

TEST(RegistrationCloud, MeasuresCertaintyByDepthNotByItsInverse) {
  // The variance of inverse depth is the same: the sigma is 2 mm at 1 m and 3.2 cm at 4 m.
  KeyframeDepthMap keyframe = emptyKeyframe(smallView());
  for (int x = 40; x < 60; ++x) put(keyframe, x, 50, x < 50 ? 4.0F : 1.0F, 0.002F);
  const RegistrationCloud cloud(keyframe, few(10, 10));
  // Cells are 40 px wide: all 20 points are in one cell.
  for (const RegistrationPoint& point : cloud.points()) EXPECT_EQ(point.p_ref.z(), 1.0F);
}

TEST(RegistrationCloud, AnEdgeIsLongAlongItselfAndUncertainAlongTheRay) {
  KeyframeDepthMap keyframe = emptyKeyframe(smallView());
  keyframe.view.cy = 60;  // rays of row 60 lie in the plane y = 0
  for (const float sigma : {0.004F, 0.0F}) {
    for (int x = 10; x < 150; ++x) put(keyframe, x, 60, 2, sigma);
    const RegistrationCloud cloud(keyframe, {});
    int looked_at = 0;
    for (const RegistrationPoint& point : cloud.points()) {
      const double column = keyframe.view.project(point.p_ref.cast<double>()).x();
      if (column < 13 || column > 146) continue;  // ends of the edge
      ++looked_at;
      // Seven adjacent pixels (of 2 m / 130) have a variance of 4 pixels^2. The sigma of the
      // position is half a pixel; the sigma of the depth is 6 * 2 m * 2 m * sigma along the ray.
      const double pixel_m = 2.0 / 130;
      Eigen::Matrix3d expected = std::pow(0.5 * pixel_m, 2) * Eigen::Matrix3d::Identity();
      expected(0, 0) += 4 * pixel_m * pixel_m;
      expected(0, 0) += std::pow(100 * pixel_m, 2);  // no measurement along an edge
      const Eigen::Vector3d along = point.p_ref.cast<double>() * 6 * 2 * sigma;
      expected += along * along.transpose();
      EXPECT_LT((point.covariance.cast<double>() - expected).cwiseAbs().maxCoeff(), 1e-6)
          << column;  // rounding of floats
    }
    EXPECT_EQ(looked_at, 134) << sigma;
  }
}

TEST(RegistrationCloud, AnEdgeBehindIsNotPartOfANeighbourhood) {
  KeyframeDepthMap keyframe = emptyKeyframe(smallView());
  for (int x = 10; x < 150; ++x) put(keyframe, x, 60, 2, 0.004F);
  const RegistrationCloud alone(keyframe, {});
  for (int x = 10; x < 150; ++x) put(keyframe, x, 61, 3, 0.004F);  // 1/6 farther: 42 sigmas
  const RegistrationCloud both(keyframe, {});
  std::size_t compared = 0;
  for (const RegistrationPoint& point : alone.points()) {
    for (const RegistrationPoint& other : both.points()) {
      if (other.p_ref != point.p_ref) continue;
      EXPECT_EQ(other.covariance, point.covariance);
      ++compared;
    }
  }
  EXPECT_EQ(compared, 140U);
}

RC_GTEST_PROP(RegistrationCloud, FindsTheSameNeighbourAsBruteForce, ()) {
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  const test::Edges world = test::edgesAround(40, random);
  const RegistrationCloud cloud(test::seenFrom(world, {}, kInverseDepthSigma, random), {});
  const ReferenceView view = smallView();
  const auto coordinates = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector2d pixel = view.project(p);
    return Eigen::Vector3d(pixel.x(), pixel.y(), 1 / p.z() / kInverseDepthSigma);
  };
  std::uniform_real_distribution<double> column(-30, 190);
  std::uniform_real_distribution<double> row(-30, 150);
  std::uniform_real_distribution<double> depth(1.5, 5);
  for (int i = 0; i < 100; ++i) {
    if (i % 40 == 20) cloud.releaseTree();
    const Eigen::Vector3d p_ref = view.pointAt(column(random), row(random), depth(random));
    for (const double within_px : {2.0, 16.0}) {
      double least = std::numeric_limits<double>::infinity();
      for (const RegistrationPoint& point : cloud.points()) {
        least =
            std::min(least, (coordinates(point.p_ref.cast<double>()) - coordinates(p_ref)).norm());
      }
      const auto index = cloud.nearest(p_ref, within_px);
      constexpr double kFloatPx = 1e-3;  // rounding of some hundreds of pixels
      if (least < within_px - kFloatPx) RC_ASSERT(index.has_value());
      if (least > within_px + kFloatPx) RC_ASSERT(!index.has_value());
      if (!index) continue;
      const Eigen::Vector3d found = coordinates(cloud.points()[*index].p_ref.cast<double>());
      RC_ASSERT((found - coordinates(p_ref)).norm() <= least + kFloatPx);
    }
  }
}

TEST(RegistrationCloud, PointsBehindOrOutsideTheViewHaveNoNeighbour) {
  const RegistrationCloud cloud(wall(0.01F), {});
  EXPECT_TRUE(cloud.nearest({0, 0, 2}, 2));
  EXPECT_FALSE(cloud.nearest({0, 0, -2}, 1e4));
  EXPECT_FALSE(cloud.nearest({0, 0, 0}, 1e4));
  EXPECT_FALSE(cloud.nearest({1e9, 0, 1e-9}, 1e4));
  EXPECT_FALSE(cloud.nearest({3, 0, 2}, 2)) << "115 px to the side";
  EXPECT_TRUE(cloud.nearest({3, 0, 2}, 120));
  EXPECT_FALSE(cloud.nearest({kFloatNan, 0, 2}, 2));
  EXPECT_FALSE(cloud.nearest({0, 0, kFloatNan}, 2));
  EXPECT_FALSE(cloud.nearest({0, 0, kInfinity}, 2));
}

TEST(RegistrationCloud, PointsBetweenItsMinAndMaxDepthAreInView) {
  KeyframeDepthMap keyframe = emptyKeyframe(smallView());
  put(keyframe, 30, 30, 1, 0.01F);
  put(keyframe, 50, 70, 4, 0.01F);
  const RegistrationCloud cloud(keyframe, {});
  EXPECT_TRUE(cloud.isInView({0, 0, 2}));
  EXPECT_TRUE(cloud.isInView({0, 0, 1.001}));
  EXPECT_TRUE(cloud.isInView({0, 0, 3.999}));
  // The range is wider by three standard deviations of inverse depth, 0.03 1/m, on each side.
  EXPECT_TRUE(cloud.isInView({0, 0, 1 / 1.029}));
  EXPECT_FALSE(cloud.isInView({0, 0, 1 / 1.031}));
  EXPECT_TRUE(cloud.isInView({0, 0, 1 / 0.221}));
  EXPECT_FALSE(cloud.isInView({0, 0, 1 / 0.219}));
  EXPECT_FALSE(cloud.isInView({0, 0, -2}));
  // From its centre the view extends 79.5 / 130 = 0.61 sideways and 59.5 / 130 = 0.46 up and down.
  EXPECT_TRUE(cloud.isInView({1.22, 0, 2}));
  EXPECT_FALSE(cloud.isInView({1.23, 0, 2}));
  EXPECT_TRUE(cloud.isInView({0, -0.91, 2}));
  EXPECT_FALSE(cloud.isInView({0, -0.92, 2}));
  EXPECT_FALSE(cloud.isInView({kFloatNan, 0, 2}));
  EXPECT_FALSE(cloud.isInView({0, 0, kFloatNan}));
  EXPECT_DOUBLE_EQ(cloud.middleInverseDepth(), 0.625);
}

TEST(RegistrationCloud, IgnoresPixelsWithoutADepthOrAVariance) {
  KeyframeDepthMap keyframe = emptyKeyframe(smallView());
  put(keyframe, 30, 30, 2, 0.5F);  // three sigmas include infinite depth
  put(keyframe, 31, 30, 2, kInfinity);
  put(keyframe, 32, 30, 2, kFloatNan);
  put(keyframe, 33, 30, kFloatNan, 0.01F);
  put(keyframe, 29, 30, kInfinity, 0.01F);
  put(keyframe, 35, 30, -2, 0.01F);
  put(keyframe, 36, 30, 0, 0.01F);
  keyframe.map.depth(30, 37) = 2;
  keyframe.map.variance(30, 37) = -1;
  const RegistrationCloud cloud(keyframe, {});
  ASSERT_EQ(cloud.points().size(), 1U);
  EXPECT_TRUE(cloud.points()[0].covariance.allFinite());
}

TEST(RegistrationCloud, AnUncertainDepthHasACovarianceWithinAFloat) {
  for (const float sigma : {1.0F, 31.0F, 1e4F}) {
    KeyframeDepthMap keyframe = emptyKeyframe(smallView());
    for (int x = 3; x < 157; x += 7) put(keyframe, x, 5, 3, sigma);
    const RegistrationCloud cloud(keyframe, {});
    EXPECT_EQ(cloud.points().size(), 22U) << sigma;
    for (const RegistrationPoint& point : cloud.points()) {
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(point.covariance.cast<double>());
      // The least eigenvalue is the square of 1/1000 of the length. Float rounding is 1/20 of that.
      const double least = 1e-6 * eigen.eigenvalues().maxCoeff();
      EXPECT_NEAR(eigen.eigenvalues().minCoeff(), least, 0.3 * least) << sigma;
    }
  }
}

TEST(RegistrationCloud, WithoutPointsNothingIsInView) {
  const RegistrationCloud cloud(emptyKeyframe(smallView()), {});
  EXPECT_TRUE(cloud.points().empty());
  EXPECT_EQ(cloud.numQueryPoints(), 0U);
  EXPECT_FALSE(cloud.isInView({0, 0, 2}));
  EXPECT_FALSE(cloud.nearest({0, 0, 2}, 100));
  EXPECT_EQ(cloud.middleInverseDepth(), 0);
  cloud.releaseTree();
}

TEST(RegistrationCloud, AViewOfOnePixelAndAVarianceOfZeroAreValid) {
  KeyframeDepthMap keyframe = emptyKeyframe({1, 1, 1, 1, 0, 0});
  put(keyframe, 0, 0, 2, 0);
  const RegistrationCloud cloud(keyframe, {});
  ASSERT_EQ(cloud.points().size(), 1U);
  EXPECT_TRUE(cloud.points()[0].covariance.allFinite());
  EXPECT_EQ(cloud.nearest({0, 0, 2}, 1), std::optional<std::size_t>(0));
  EXPECT_TRUE(cloud.isInView({0, 0, 2}));
}

TEST(RegistrationCloud, ExtremeDepthsDoNotSpoilTheOthers) {
  for (const float strange : {1e-42F, 1e-30F, 1e-6F, 1e6F, 1e20F, 3e38F}) {
    KeyframeDepthMap keyframe = wall(0.01F);
    put(keyframe, 80, 60, strange, 0.01F);
    put(keyframe, 5, 5, strange, 0.01F);
    const RegistrationCloud cloud(keyframe, {});
    for (const RegistrationPoint& point : cloud.points()) {
      ASSERT_TRUE(point.p_ref.allFinite()) << strange;
      ASSERT_TRUE(point.covariance.allFinite()) << strange;
      const Eigen::LLT<Eigen::Matrix3d> llt(point.covariance.cast<double>());
      ASSERT_EQ(llt.info(), Eigen::Success) << strange;
    }
    EXPECT_TRUE(cloud.nearest({0.3, 0.2, 2}, 5)) << strange;
    EXPECT_TRUE(std::isfinite(cloud.middleInverseDepth())) << strange;
  }
}

TEST(RegistrationCloudOptions, TheMapHasAtLeastThePointsOfAKeyframe) {
  EXPECT_NO_THROW(few(100'000, 1'000'000).validate());
  EXPECT_NO_THROW(few(100, 100).validate());
  EXPECT_THROW(few(100, 99).validate(), OptionError);
  EXPECT_THROW(few(100, 1'000'001).validate(), OptionError);
  EXPECT_THROW(RegistrationCloud(emptyKeyframe(smallView()), few(9, 100)), OptionError);
}

}  // namespace

}  // namespace efm
