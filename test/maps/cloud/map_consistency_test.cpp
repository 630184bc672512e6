// SPDX-License-Identifier: BSD-3-Clause
// Keyframes check each other's points.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "maps/cloud/global_cloud.h"
#include "test/maps/cloud/cloud_points.h"

namespace efm {
namespace {

constexpr std::uint64_t kAll = std::numeric_limits<std::uint64_t>::max();

struct View {
  std::vector<CloudPoint> points;
  Rigid3 T_world_ref;
};

GlobalCloudOptions withConsistency(Consistency consistency) {
  GlobalCloudOptions options;
  options.voxel_size_m = 0.02;
  options.consistency.consistency = consistency;
  return options;
}

Rigid3 viewAt(double x_m) { return {Eigen::Quaterniond::Identity(), {x_m, 0, 0}}; }

/// The view of a wall at z = 3 m. Each point is off along its ray by a random fraction of its
/// inverse depth, up to `noise`.
std::vector<CloudPoint> wallSeenFrom(const Rigid3& T_world_ref, double noise,
                                     std::mt19937& random) {
  std::uniform_real_distribution<double> error(-noise, noise);
  std::vector<CloudPoint> points;
  for (int y = -30; y <= 30; ++y) {
    for (int x = -30; x <= 30; ++x) {
      const Eigen::Vector3d p_ref(0.03 * x, 0.03 * y, 3);
      points.push_back(
          {T_world_ref * (p_ref / (1 + error(random))), 1.0F, 1, 0, 0.001F * (x + 31)});
    }
  }
  return points;
}

/// Adjacent views. One of 50 points lies in front of the wall.
std::vector<View> viewsWithOutliers(std::mt19937& random, int count) {
  std::uniform_real_distribution<double> wrong(1.2, 2.2);
  std::vector<View> views;
  for (int k = 0; k < count; ++k) {
    View seen{{}, viewAt(0.05 * k)};
    seen.points = wallSeenFrom(seen.T_world_ref, 0.015, random);
    for (std::size_t i = 0; i < seen.points.size(); i += 50) {
      Eigen::Vector3d& p_world = seen.points[i].p_world;
      const Eigen::Vector3d eye = seen.T_world_ref.translation;
      p_world = eye + (p_world - eye) / wrong(random);
    }
    views.push_back(seen);
  }
  return views;
}

std::size_t outliersIn(const MapCloud& cloud) {
  const std::vector<CloudPoint> points = test::worldPoints(cloud);
  return static_cast<std::size_t>(std::count_if(points.begin(), points.end(), [](const auto& p) {
    return std::abs(p.p_world.z() - 3) > 0.3;
  }));
}

TEST(MapConsistency, FreeSpaceViolationsAreExcludedAndTheWallIsNot) {
  std::mt19937 random(1);
  const std::vector<View> views = viewsWithOutliers(random, 5);
  GlobalCloud plain(withConsistency(Consistency::kNone));
  GlobalCloud support(withConsistency(Consistency::kSupport));
  GlobalCloud visible(withConsistency(Consistency::kVisibility));
  for (std::size_t k = 0; k < views.size(); ++k) {
    for (GlobalCloud* cloud : {&plain, &support, &visible}) {
      cloud->insert(k, views[k].points, views[k].T_world_ref);
    }
  }
  const std::size_t outliers = outliersIn(*plain.points());
  EXPECT_GT(outliers, 300U);
  EXPECT_EQ(support.points()->size(), plain.points()->size());
  EXPECT_LT(outliersIn(*visible.points()), outliers / 10);
  EXPECT_EQ(visible.points()->size() - outliersIn(*visible.points()),
            plain.points()->size() - outliers);
  EXPECT_LT(outliersIn(*support.points(2)), outliers / 10) << "without support";
  EXPECT_GT(support.points(2)->size(), (plain.points()->size() - outliers) * 99 / 100)
      << "though the voxels of a point are rarely the same in two keyframes:";
  EXPECT_LT(plain.points(3)->size(), plain.points()->size() / 2);
}

TEST(MapConsistency, SupportCountsKeyframesWithAPointInTheVoxelOrNearIt) {
  std::mt19937 random(1);
  GlobalCloud cloud(withConsistency(Consistency::kSupport));
  cloud.insert(10, {{{0.21, 0.01, 2.93}, 1.0F}}, viewAt(0));
  EXPECT_EQ(cloud.points()->at(0).support, 1U);
  for (const std::uint64_t earlier : {1, 2, 11}) {
    cloud.insert(earlier, wallSeenFrom(viewAt(0), 0, random), viewAt(0));
  }
  cloud.insert(18, wallSeenFrom(viewAt(0.1), 0, random), viewAt(0.1));
  cloud.insert(19, wallSeenFrom(viewAt(0.1), 0, random), viewAt(0.1));
  const std::vector<CloudPoint> points = test::worldPoints(*cloud.points());
  const auto lone = std::find_if(points.begin(), points.end(),
                                 [](const auto& p) { return p.p_world.z() < 2.95; });
  ASSERT_NE(lone, points.end());
  EXPECT_EQ(lone->support, 4U) << "2, 10, 11 and 18; 1 and 19 are too far from 10";
}

TEST(MapConsistency, AKeyframeWithoutAPoseIsCheckedAndChecksNoOther) {
  std::mt19937 random(1);
  const std::vector<CloudPoint> stray = {{{0.01, 0.01, 1.5}, 1.0F}};
  for (const bool posed : {false, true}) {
    GlobalCloud cloud(withConsistency(Consistency::kVisibility));
    cloud.insert(0, stray);
    const auto pose = posed ? std::optional<Rigid3>(viewAt(0)) : std::nullopt;
    cloud.insert(1, wallSeenFrom(viewAt(0), 0, random), pose);
    EXPECT_EQ(outliersIn(*cloud.points()), posed ? 0U : 1U);
  }
}

TEST(MapConsistency, APointWithMoreViolationsThanAllowedAndNoSupportIsExcluded) {
  std::mt19937 random(1);
  const std::vector<CloudPoint> stray = {{{0.01, 0.01, 1.5}, 1.0F}};
  for (const bool seen_twice : {false, true}) {
    for (int allowed = 0; allowed <= 3; ++allowed) {
      GlobalCloudOptions options = withConsistency(Consistency::kVisibility);
      options.consistency.max_contradictions = allowed;
      GlobalCloud cloud(options);
      cloud.insert(0, stray, viewAt(0));
      if (seen_twice) cloud.insert(1, stray, viewAt(0));
      for (std::uint64_t k = 2; k < 4; ++k) {
        cloud.insert(k, wallSeenFrom(viewAt(0), 0, random), viewAt(0));
      }
      EXPECT_EQ(outliersIn(*cloud.points()), seen_twice || allowed >= 2 ? 1U : 0U) << allowed;
    }
  }
}

TEST(MapConsistency, PointsOnATrueSurfaceAreNeverExcluded) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> shift(-0.5, 0.5);
    std::uniform_real_distribution<double> turn(-0.2, 0.2);
    GlobalCloud plain(withConsistency(Consistency::kNone));
    GlobalCloud visible(withConsistency(Consistency::kVisibility));
    for (std::uint64_t k = 0; k < 6; ++k) {
      const Eigen::Vector3d axis(turn(random), turn(random), turn(random));
      const Rigid3 T_world_ref{
          Eigen::Quaterniond(Eigen::AngleAxisd(axis.norm(), axis.normalized())),
          {shift(random), shift(random), shift(random)}};
      // A pole hides a part of the wall.
      std::vector<CloudPoint> points = wallSeenFrom(viewAt(0), 0.01, random);
      for (int y = -100; y <= 100; ++y) points.push_back({{0.1, 0.01 * y, 1.5}, 1.0F});
      const Eigen::Vector3d eye = T_world_ref.translation;
      points.erase(
          std::remove_if(points.begin(), points.end(),
                         [&](const CloudPoint& point) {
                           if (point.p_world.z() < 2) return false;
                           const double share = (1.5 - eye.z()) / (point.p_world.z() - eye.z());
                           const double x = eye.x() + share * (point.p_world.x() - eye.x());
                           return std::abs(x - 0.1) < 0.05;
                         }),
          points.end());
      plain.insert(k, points, T_world_ref);
      visible.insert(k, points, T_world_ref);
    }
    EXPECT_EQ(visible.points()->size(), plain.points()->size()) << "seed " << seed;
  }
}

TEST(MapConsistency, SettledKeyframesMakeTheSameMapBitForBit) {
  std::mt19937 random(7);
  const std::vector<View> views = viewsWithOutliers(random, 40);
  for (const Consistency consistency :
       {Consistency::kNone, Consistency::kSupport, Consistency::kVisibility}) {
    GlobalCloud kept(withConsistency(consistency));
    GlobalCloud settled(withConsistency(consistency));
    for (std::uint64_t k = 0; k < views.size(); ++k) {
      kept.insert(k, views[k].points, views[k].T_world_ref);
      settled.insert(k, views[k].points, views[k].T_world_ref);
      // At any time, one keyframe or several at once.
      if (k >= GlobalCloud::kMaxNumberDifference && random() % 3 == 0) {
        settled.settle(k - GlobalCloud::kMaxNumberDifference);
      }
      if (k % 10 != 9) continue;
      for (const int min_keyframes : {1, 3}) {
        EXPECT_TRUE(test::sameBits(*settled.points(min_keyframes), *kept.points(min_keyframes)));
      }
    }
    EXPECT_EQ(settled.keyframes(), kept.keyframes());
    EXPECT_GT(settled.settledVoxels(), 0U);
    EXPECT_LT(settled.unsettledVoxels(kAll), kept.unsettledVoxels(kAll) / 2);
    EXPECT_EQ(settled.unsettledVoxels(0), 0U);
    settled.settle(31);  // the limits of what may change from now on
    settled.settle(5);   // which do not become wider again
    EXPECT_THROW(settled.insert(38, {}), std::invalid_argument);
    EXPECT_THROW(settled.remove(30), std::invalid_argument);
    EXPECT_THROW(settled.replace(30, {}, {}), std::invalid_argument);
    EXPECT_EQ(settled.keyframes(), 40U);
    settled.remove(39);
    kept.remove(39);
    EXPECT_TRUE(test::sameBits(*settled.points(), *kept.points()));
  }
}

}  // namespace
}  // namespace efm
