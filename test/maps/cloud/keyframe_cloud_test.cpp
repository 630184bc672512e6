// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "maps/cloud/keyframe_cloud.h"
#include "test/maps/cloud/cloud_points.h"
#include "test/maps/refinement/random_poses.h"

namespace efm {
namespace {

using test::drawMotion;

/// Returns a view of 3 x 2 pixels, f = 2, principal point (1, 0), without depths.
KeyframeDepthMap smallKeyframe() {
  KeyframeDepthMap keyframe;
  keyframe.view = {3, 2, 2.0, 2.0, 1.0, 0.0};
  keyframe.map.depth = cv::Mat1f::zeros(2, 3);
  keyframe.map.confidence = cv::Mat1f::ones(2, 3);
  return keyframe;
}

TEST(KeyframeCloud, PointOfAPixelIsWorkedOutByHand) {
  KeyframeDepthMap keyframe = smallKeyframe();
  keyframe.map.depth(1, 2) = 4.0F;  // p_ref = ((2-1)/2*4, (1-0)/2*4, 4) = (2, 2, 4)
  keyframe.map.confidence(1, 2) = 7.0F;
  keyframe.map.variance = cv::Mat1f::ones(2, 3);
  keyframe.map.variance(1, 2) = 0.0025F;  // sigma of depth: 4^2 * sqrt(0.0025) = 0.8
  keyframe.map.probability = cv::Mat1f::zeros(2, 3);
  keyframe.map.probability(1, 2) = 0.95F;
  // Rotation by 90 deg about z: (x, y, z) -> (-y, x, z). Then a translation of (10, 20, 30).
  keyframe.T_world_ref.rotation = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ());
  keyframe.T_world_ref.translation = {10, 20, 30};

  const MapCloud::ConstPtr cloud = keyframeCloud(keyframe);

  ASSERT_EQ(cloud->size(), 1U);
  const MapPoint& point = cloud->front();
  EXPECT_NEAR(point.x, 8, 1e-5);
  EXPECT_NEAR(point.y, 22, 1e-5);
  EXPECT_NEAR(point.z, 34, 1e-5);
  EXPECT_EQ(point.intensity, 7.0F);
  EXPECT_EQ(point.support, 1U);
  EXPECT_EQ(point.sigma, 0.8F);
  EXPECT_EQ(point.probability, 0.95F);
  keyframe.map.variance.release();
  keyframe.map.probability.release();
  EXPECT_TRUE(std::isnan(keyframeCloud(keyframe)->front().sigma)) << "without variances";
  EXPECT_TRUE(std::isnan(keyframeCloud(keyframe)->front().probability)) << "not known";
}

TEST(KeyframeCloud, PixelsWithoutDepthOrConfidenceGiveNoPoint) {
  KeyframeDepthMap keyframe = smallKeyframe();
  keyframe.map.depth(0, 0) = 1.0F;
  keyframe.map.depth(0, 1) = 1.0F;
  keyframe.map.confidence(0, 1) = 0.0F;

  keyframe.map.variance = cv::Mat1f::ones(2, 3);
  keyframe.map.variance(0, 0) = INFINITY;
  ASSERT_EQ(viewPoints(keyframe).size(), 1U);
  EXPECT_TRUE(std::isnan(viewPoints(keyframe)[0].sigma)) << "of a peak without curvature";
}

TEST(KeyframeCloud, LateFusionIsThePointsOfOneCameraAfterTheOther) {
  KeyframeDepthMap keyframe = smallKeyframe();
  EXPECT_TRUE(lateFusionPoints(keyframe).empty());
  keyframe.camera_maps.resize(2);
  for (int c = 0; c < 2; ++c) {
    keyframe.camera_maps[c].map = smallKeyframe().map;
    keyframe.camera_maps[c].map.depth = cv::Mat1f::zeros(2, 3);
    keyframe.camera_maps[c].map.depth(c, 2) = 2.0F + static_cast<float>(c);
  }
  const std::vector<ViewPoint> points = lateFusionPoints(keyframe);
  ASSERT_EQ(points.size(), 2U);
  EXPECT_EQ(points[0].p_ref, Eigen::Vector3f(1, 0, 2));
  EXPECT_EQ(points[1].p_ref, Eigen::Vector3f(1.5F, 1.5F, 3));
}

TEST(KeyframeCloud, ImagesOfAnotherSizeThanTheViewAreRejected) {
  for (cv::Mat1f DepthMap::*image :
       {&DepthMap::depth, &DepthMap::confidence, &DepthMap::variance}) {
    KeyframeDepthMap keyframe = smallKeyframe();
    keyframe.map.*image = cv::Mat1f::ones(3, 3);
    EXPECT_THROW(keyframeCloud(keyframe), std::invalid_argument);
  }
}

/// Draws points in front of a view, on a surface that all views share.
std::vector<ViewPoint> randomPoints(std::mt19937& random, std::size_t count) {
  std::uniform_real_distribution<float> uniform(-1, 1);
  std::vector<ViewPoint> points;
  while (points.size() < count) {
    const float x = uniform(random);
    const float y = uniform(random);
    const float depth_m = 2 + 0.2F * uniform(random);
    const float confidence = 1 + uniform(random) / 2;
    points.push_back({{x, y, depth_m}, confidence, 0.01F * confidence});
  }
  return points;
}

GlobalCloudOptions optionsOf(Consistency consistency) {
  GlobalCloudOptions options;
  options.voxel_size_m = 0.05;
  options.consistency.consistency = consistency;
  return options;
}

/// Keyframes with their poses, of which a new map can be made.
struct PosedKeyframes {
  std::vector<std::vector<ViewPoint>> points;
  std::vector<Rigid3> T_world_ref;

  MapCloud::ConstPtr pointsOf(const GlobalCloudOptions& options) const {
    GlobalCloud cloud(options);
    for (std::size_t i = 0; i < points.size(); ++i) {
      cloud.insert(i, pointsInWorld(points[i], T_world_ref[i]), T_world_ref[i]);
    }
    return cloud.points();
  }
};

// Keyframes of an earlier map, new ones, motions and `applyPending` in any order.
RC_GTEST_PROP(RefinedCloud, IsANewMapOfTheSameKeyframes, ()) {
  const GlobalCloudOptions options = optionsOf(Consistency::kVisibility);
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  RefinedCloud cloud(options, RefinedCloud::kAll);
  PosedKeyframes keyframes;
  const std::size_t fixed = random() % 4;
  for (std::size_t i = 0; i < fixed; ++i) {
    keyframes.points.push_back(randomPoints(random, random() % 80));
    keyframes.T_world_ref.push_back(drawMotion(0.2, 0.1, random));
    cloud.insertFixed(pointsInWorld(keyframes.points[i], keyframes.T_world_ref[i]),
                      keyframes.T_world_ref[i]);
  }
  std::vector<Rigid3> asked = keyframes.T_world_ref;
  for (int step = 0; step < 40; ++step) {
    const std::size_t count = keyframes.points.size() - fixed;
    const unsigned what = random() % 4;
    if (what == 0 || count == 0) {
      keyframes.points.push_back(randomPoints(random, random() % 80));
      keyframes.T_world_ref.push_back(drawMotion(0.2, 0.1, random));
      asked.push_back(keyframes.T_world_ref.back());
      cloud.insert(keyframes.points.back(), keyframes.T_world_ref.back());
    } else if (what < 3) {
      const std::size_t moved = random() % count;
      const double extent = std::pow(10.0, -static_cast<double>(random() % 5));
      asked[fixed + moved] = asked[fixed + moved] * drawMotion(extent, extent, random);
      cloud.move({{moved, asked[fixed + moved]}});
    } else {
      cloud.applyPending(random() % 2 == 0 ? 0 : 0.01, random() % 6);
    }
    // The map is made with the poses that it returns, also if other poses are pending.
    for (std::size_t i = 0; i < keyframes.points.size() - fixed; ++i) {
      keyframes.T_world_ref[fixed + i] = cloud.T_world_ref()[i];
    }
    RC_ASSERT(test::sameBits(*cloud.cloud().points(), *keyframes.pointsOf(options)));
  }
  cloud.applyPending(0);
  for (std::size_t i = fixed; i < asked.size(); ++i) {
    RC_ASSERT(isSame(cloud.T_world_ref()[i - fixed], asked[i]));
  }
  keyframes.T_world_ref = asked;
  RC_ASSERT(test::sameBits(*cloud.cloud().points(), *keyframes.pointsOf(options)));
}

TEST(RefinedCloud, AKeyframeWithinTheToleranceStays) {
  std::mt19937 random(2);
  RefinedCloud cloud(optionsOf(Consistency::kNone), RefinedCloud::kAll);
  for (int i = 0; i < 2; ++i) cloud.insert({{{0, 0, 2}, 1}, {{0, 0, 4}, 1}}, {});
  Rigid3 T_shifted;
  T_shifted.translation = {0.003, 0, 0};
  Rigid3 T_rotated;  // 0.004 m at 4 m
  T_rotated.rotation = Eigen::AngleAxisd(0.001, Eigen::Vector3d::UnitY());
  cloud.move({{0, T_shifted}});
  cloud.move({{1, T_rotated}});

  cloud.applyPending(0.0045);
  EXPECT_TRUE(isSame(cloud.T_world_ref()[0], {}));
  EXPECT_TRUE(isSame(cloud.T_world_ref()[1], {}));
  cloud.applyPending(0.0035);
  EXPECT_TRUE(isSame(cloud.T_world_ref()[0], {}));
  EXPECT_TRUE(isSame(cloud.T_world_ref()[1], T_rotated));
  cloud.applyPending(0.0025);
  EXPECT_TRUE(isSame(cloud.T_world_ref()[0], T_shifted));
}

TEST(RefinedCloud, WithoutToleranceTheLastDigitsCount) {
  RefinedCloud cloud(optionsOf(Consistency::kNone), RefinedCloud::kAll);
  std::mt19937 random(2);
  for (int i = 0; i < 200; ++i) {
    const Rigid3 T_world_ref = drawMotion(1, 1, random);
    Rigid3 T_nearest_ref = T_world_ref;
    T_nearest_ref.rotation.x() = std::nextafter(T_nearest_ref.rotation.x(), 2);
    cloud.insert({{{0, 0, 2}, 1}}, T_world_ref);
    cloud.move({{cloud.T_world_ref().size() - 1, T_nearest_ref}});
    cloud.applyPending(0);
    EXPECT_TRUE(isSame(cloud.T_world_ref().back(), T_nearest_ref));
  }
}

TEST(RefinedCloud, MovesTheOldestFirstUpToTheMaximum) {
  RefinedCloud cloud(optionsOf(Consistency::kNone), RefinedCloud::kAll);
  Rigid3 T_world_ref;
  T_world_ref.translation = {1, 0, 0};
  for (std::size_t i = 0; i < 5; ++i) cloud.insert({{{0, 0, 2}, 1}}, {});
  for (const std::size_t i : {4U, 0U, 2U, 3U}) cloud.move({{i, T_world_ref}});
  const auto moved = [&] {
    std::vector<std::size_t> numbers;
    for (std::size_t i = 0; i < 5; ++i) {
      if (isSame(cloud.T_world_ref()[i], T_world_ref)) numbers.push_back(i);
    }
    return numbers;
  };
  cloud.applyPending(0.1, 0);
  EXPECT_EQ(moved(), (std::vector<std::size_t>{}));
  cloud.applyPending(0.1, 2);
  EXPECT_EQ(moved(), (std::vector<std::size_t>{0, 2}));
  cloud.applyPending(0.1, 1);
  EXPECT_EQ(moved(), (std::vector<std::size_t>{0, 2, 3}));
  cloud.applyPending(0.1);
  EXPECT_EQ(moved(), (std::vector<std::size_t>{0, 2, 3, 4}));
}

TEST(RefinedCloud, RejectsToMoveWhatItDoesNotHaveOrHold) {
  using Poses = std::map<std::size_t, Rigid3>;
  Rigid3 T_world_ref;
  T_world_ref.translation = {1, 0, 0};
  for (const std::size_t movable : {RefinedCloud::kAll, std::size_t{0}}) {
    RefinedCloud cloud(optionsOf(Consistency::kNone), movable);
    cloud.insertFixed({{{0, 0, 2}, 1}}, {});
    EXPECT_THROW(cloud.move({{0, T_world_ref}}), std::invalid_argument) << "an earlier map's";
    cloud.insert({{{0, 0, 2}, 1}}, {});
    const Poses beyond = {{0, T_world_ref}, {1, T_world_ref}};
    EXPECT_THAT(
        [&] {
          cloud.move(movable > 0 ? beyond : Poses{{0, T_world_ref}});
        },
        testing::ThrowsMessage<std::invalid_argument>(
            testing::HasSubstr(movable > 0 ? "not in the cloud" : "are fixed")));
    cloud.applyPending(0);
    EXPECT_TRUE(isSame(cloud.T_world_ref()[0], {})) << "nothing was requested";
    EXPECT_THROW(cloud.insertFixed({}, {}), std::invalid_argument);
  }
}

TEST(RefinedCloud, OnlyTheNewestKeyframesMoveAndTheMapIsThatOfTheirPoses) {
  std::mt19937 random(5);
  GlobalCloudOptions options = optionsOf(Consistency::kVisibility);
  options.voxel_size_m = 0.001;  // almost one voxel per point: enough to finalize
  constexpr std::size_t kMovable = 3;
  RefinedCloud cloud(options, kMovable);
  cloud.insertFixed({}, {});
  PosedKeyframes keyframes;
  std::size_t stayed = 0;
  for (std::size_t k = 0; k < 32; ++k) {
    // Five keyframes make 200,000 voxels, which trigger a merge.
    keyframes.points.push_back(randomPoints(random, k % 12 < 5 ? 42'000 : 500));
    cloud.insert(keyframes.points.back(), drawMotion(0.1, 0.1, random));
    // The newest keyframe, the oldest one that may move, and random keyframes are moved.
    std::map<std::size_t, Rigid3> moves{{k, drawMotion(0.1, 0.1, random)}};
    if (k >= kMovable) moves[k - kMovable] = drawMotion(0.1, 0.1, random);
    for (int i = 0; i < 2; ++i) moves[random() % (k + 1)] = drawMotion(0.1, 0.1, random);
    cloud.move(moves);
    if (k % 3 != 2) continue;  // other moves stay pending meanwhile
    cloud.applyPending(0);
    for (const auto& [keyframe, T_world_ref] : moves) {
      const bool moved = isSame(cloud.T_world_ref()[keyframe], T_world_ref);
      EXPECT_TRUE(moved || keyframe + kMovable < k) << keyframe << " of " << k;
      if (!moved) ++stayed;
    }
  }
  EXPECT_GT(cloud.cloud().finalizedVoxels(), 0U);
  EXPECT_GT(stayed, 0U);
  cloud.applyPending(0);
  GlobalCloud same(options);
  same.insert(0, {}, Rigid3{});
  for (std::size_t k = 0; k < keyframes.points.size(); ++k) {
    const Rigid3& T_world_ref = cloud.T_world_ref()[k];
    same.insert(k + 1, pointsInWorld(keyframes.points[k], T_world_ref), T_world_ref);
  }
  EXPECT_TRUE(test::sameBits(*cloud.cloud().points(), *same.points()));
}

TEST(RefinedCloud, KeyframesThatNeverMoveSettleToo) {
  GlobalCloudOptions options = optionsOf(Consistency::kNone);
  options.voxel_size_m = 0.001;
  using Case = std::pair<std::size_t, std::size_t>;
  for (const auto& [movable, of_earlier_map] : {Case{0, 0}, {0, 2}, {3, 20}}) {
    std::mt19937 random(6);
    RefinedCloud cloud(options, movable);
    GlobalCloud same(options);
    for (std::size_t k = 0; k < 24; ++k) {
      const std::vector<ViewPoint> points = randomPoints(random, k < 6 ? 42'000 : 500);
      const Rigid3 T_world_ref = drawMotion(0.1, 0.1, random);
      const std::vector<CloudPoint> in_world = pointsInWorld(points, T_world_ref);
      k < of_earlier_map ? cloud.insertFixed(in_world, T_world_ref)
                         : cloud.insert(points, T_world_ref);
      same.insert(k, in_world, T_world_ref);
    }
    EXPECT_GT(cloud.cloud().finalizedVoxels(), 0U) << movable << ", " << of_earlier_map;
    EXPECT_TRUE(test::sameBits(*cloud.cloud().points(), *same.points()));
  }
}

TEST(RefinedCloud, KeyframesWithoutPointsAreFinalizedSoThatTheirNumberStaysBounded) {
  RefinedCloud cloud({}, 0);
  for (int i = 0; i < 25'000; ++i) cloud.insert({}, {});
  // The memory of 20,000 empty keyframes is that of 200,000 voxels.
  const std::uint64_t kAllKeyframes = std::numeric_limits<std::uint64_t>::max();
  EXPECT_LT(cloud.cloud().unfinalizedVoxels(kAllKeyframes), 100'000U);
}

TEST(RefinedCloud, WithoutItsNewestKeyframeOrAfterARejectedMoveItIsAsBefore) {
  std::mt19937 random(4);
  const GlobalCloudOptions options = optionsOf(Consistency::kVisibility);
  RefinedCloud cloud(options, RefinedCloud::kAll);
  PosedKeyframes keyframes;
  for (int i = 0; i < 3; ++i) {
    keyframes.points.push_back(randomPoints(random, 50));
    keyframes.T_world_ref.push_back(drawMotion(0.1, 0.1, random));
    cloud.insert(keyframes.points.back(), keyframes.T_world_ref.back());
  }
  cloud.insert(randomPoints(random, 50), {});
  cloud.move({{3, drawMotion(1, 1, random)}});
  cloud.removeNewest();
  cloud.applyPending(0);
  EXPECT_EQ(cloud.T_world_ref().size(), 3U);
  EXPECT_TRUE(test::sameBits(*cloud.cloud().points(), *keyframes.pointsOf(options)));
  for (const double too_far_m : {1e30, std::numeric_limits<double>::quiet_NaN()}) {
    Rigid3 T_world_ref;
    T_world_ref.translation = {too_far_m, 0, 0};
    cloud.move({{1, T_world_ref}});
    EXPECT_THROW(cloud.applyPending(0), std::invalid_argument);
    EXPECT_TRUE(test::sameBits(*cloud.cloud().points(), *keyframes.pointsOf(options)));
    EXPECT_NO_THROW(cloud.applyPending(0)) << "it is not tried again";
  }
  keyframes.T_world_ref[1] = drawMotion(0.1, 0.1, random);
  cloud.move({{1, keyframes.T_world_ref[1]}});
  cloud.applyPending(0);
  EXPECT_TRUE(test::sameBits(*cloud.cloud().points(), *keyframes.pointsOf(options)));
}

}  // namespace

}  // namespace efm
