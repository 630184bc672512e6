// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "maps/cloud/global_cloud.h"
#include "test/maps/cloud/cloud_points.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::HasSubstr;

using Keyframes = std::vector<std::vector<CloudPoint>>;

std::vector<CloudPoint> randomPoints(std::mt19937& random, int count, double extent_m) {
  std::uniform_real_distribution<double> coordinate(-extent_m, extent_m);
  std::uniform_real_distribution<float> confidence(0.1F, 20.0F);
  std::vector<CloudPoint> points;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d p_world(coordinate(random), coordinate(random), coordinate(random));
    points.push_back({p_world, confidence(random), 1, 0, 0.01F * confidence(random),
                      0.05F * confidence(random)});
  }
  return points;
}

TEST(GlobalCloud, ErrorAndProbabilityOfAPointWithoutThemAreNotKnown) {
  GlobalCloud cloud({1.0, 1});
  cloud.insert(1, {{{0.5, 0.5, 0.5}, 2, 1, 0, 0.6F, 0.75F}});
  cloud.insert(2, {{{0.5, 0.5, 0.5}, 1}});
  EXPECT_TRUE(std::isnan(cloud.points()->at(0).sigma));
  EXPECT_TRUE(std::isnan(cloud.points()->at(0).probability));
  cloud.remove(2);
  EXPECT_EQ(cloud.points()->at(0).sigma, 0.6F);
  EXPECT_EQ(cloud.points()->at(0).probability, 0.75F);
}

RC_GTEST_PROP(GlobalCloud, MeansEqualThoseOfANaiveFilter, ()) {
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  const double voxel_m = *rc::gen::element(0.05, 0.3, 1.0);
  const auto far_m = *rc::gen::element(0.0, 1e6);
  Keyframes keyframes;
  GlobalCloud cloud({voxel_m, 1});
  for (int k = 0; k < *rc::gen::inRange(1, 6); ++k) {
    keyframes.push_back(randomPoints(random, *rc::gen::inRange(0, 200), 2.0));
    for (CloudPoint& point : keyframes.back()) point.p_world += Eigen::Vector3d(far_m, 0, -far_m);
    cloud.insert(static_cast<std::uint64_t>(k), keyframes.back());
  }

  struct Mean {
    double weight = 0;
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    int count = 0;
    double probability = 0;                // weighted
    std::map<std::size_t, double> sigmas;  // weighted, per keyframe
  };
  std::map<std::array<long, 3>, Mean> means;
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    for (const CloudPoint& point : keyframes[k]) {
      std::array<long, 3> index{};
      for (std::size_t i = 0; i < 3; ++i) {
        index[i] = std::lround(std::floor(point.p_world[static_cast<int>(i)] / voxel_m));
      }
      Mean& mean = means[index];
      const double weight = point.confidence;
      mean.weight += weight;
      mean.p += weight * point.p_world;
      ++mean.count;
      mean.probability += weight * point.probability;
      mean.sigmas[k] += weight * point.sigma;
    }
  }

  const std::vector<CloudPoint> points = test::worldPoints(*cloud.points());
  RC_ASSERT(points.size() == means.size());
  // The float steps of a far cloud are at most a tenth of a voxel: errors are half a step per axis.
  const double tolerance_m = far_m > 0 ? 0.09 * voxel_m : 1e-6;
  std::size_t i = 0;
  for (const auto& [index, mean] : means) {  // sorted by index like the export
    RC_ASSERT((points[i].p_world - mean.p / mean.weight).norm() < tolerance_m);
    RC_ASSERT(std::abs(points[i].confidence - mean.weight / mean.count) < 1e-5);
    RC_ASSERT(points[i].support == mean.sigmas.size());
    RC_ASSERT(points[i].first_keyframe == mean.sigmas.begin()->first);
    double squares = 0;  // errors are common within a keyframe only
    for (const auto& [keyframe, sigma] : mean.sigmas) squares += sigma * sigma;
    RC_ASSERT(std::abs(points[i].sigma - std::sqrt(squares) / mean.weight) < 1e-6);
    RC_ASSERT(std::abs(points[i].probability - mean.probability / mean.weight) < 1e-6);
    ++i;
  }
}

RC_GTEST_PROP(GlobalCloud, DependsOnItsKeyframesAloneBitForBit, ()) {
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  std::uniform_int_distribution<std::uint64_t> number(0, 11);  // some pairs are not compared
  std::uniform_int_distribution<int> count(0, 120);
  const Rigid3 T_world_ref{Eigen::Quaterniond(0.5, 0.5, 0.5, 0.5), {-1, 0, 0}};
  GlobalCloud cloud({0.4, 2});
  std::map<std::uint64_t, std::vector<CloudPoint>> inside;
  for (int step = 0; step < 40; ++step) {
    const std::uint64_t keyframe = number(random);
    if (inside.count(keyframe) != 0) {
      cloud.remove(keyframe);
      inside.erase(keyframe);
    } else {
      inside[keyframe] = randomPoints(random, count(random), 1.0);
      cloud.insert(keyframe, inside[keyframe], T_world_ref);
    }
    if (inside.count(3) != 0 && step % 5 == 0) {
      inside[3] = randomPoints(random, count(random), 1.0);
      cloud.replace(3, inside[3], T_world_ref);
    }

    GlobalCloud fresh({0.4, 1});
    for (const auto& [fresh_number, points] : inside) {
      fresh.insert(fresh_number, points, T_world_ref);
    }
    for (const int min_keyframes : {1, 2, 4}) {
      RC_ASSERT(test::sameBits(*cloud.points(min_keyframes), *fresh.points(min_keyframes)));
    }
    RC_ASSERT(test::sameBits(*cloud.points(), *fresh.points(2)));
    RC_ASSERT(cloud.keyframes() == inside.size());
  }
}

TEST(GlobalCloud, OutliersOfAKeyframeStayOutsideEvenWhereAnotherKeyframeHasPoints) {
  GlobalCloudOptions options;
  options.voxel_size_m = 1.0;
  options.outliers = {0.5, 1};
  GlobalCloud cloud(options);
  cloud.insert(0, {{{0.5, 0, 0}, 1.0F}, {{0.6, 0, 0}, 1.0F}, {{5.5, 0, 0}, 1.0F}});
  cloud.insert(1, {{{5.5, 0, 0}, 1.0F}, {{5.6, 0, 0}, 1.0F}, {{0.5, 0, 0}, 1.0F}});

  const std::vector<CloudPoint> points = test::worldPoints(*cloud.points());

  ASSERT_EQ(points.size(), 2U);
  EXPECT_NEAR(points[0].p_world.x(), 0.55, 1e-6);
  EXPECT_EQ(points[0].support, 1U);
  EXPECT_NEAR(points[1].p_world.x(), 5.55, 1e-6);
  EXPECT_EQ(points[1].support, 1U);
}

TEST(GlobalCloud, ARejectedKeyframeLeavesNothingBehind) {
  const double limit = std::ldexp(1, 60);  // limit of 64-bit indices of 1/8 m voxels
  const double above = std::nextafter(limit, INFINITY);
  const double below = std::nextafter(limit, 0);
  GlobalCloud cloud({0.125, 1});
  cloud.insert(3, {{{0, 0, 0}, 1.0F}});
  for (const CloudPoint& wrong : {CloudPoint{{0, std::nan(""), 0}, 1},
                                  {{0, 0, 0}, 0},
                                  {{0, 0, 0}, -1},
                                  {{0, 0, 0}, INFINITY},
                                  {{limit, 0, 0}, 1},
                                  {{0, 0, -above}, 1}}) {
    EXPECT_THAT(messageOf([&] {
                  cloud.insert(4, {{{0, 0, 0}, 1.0F}, wrong});
                }),
                HasSubstr("point ("))
        << pointText(wrong);
  }
  EXPECT_THAT(messageOf([&] { cloud.insert(3, {}); }),
              HasSubstr("keyframe 3 is in the map already"));
  EXPECT_THAT(messageOf([&] { cloud.remove(4); }), HasSubstr("keyframe 4 is not in the map"));
  EXPECT_THAT(messageOf([&] { cloud.replace(4, {}, {}); }), HasSubstr("keyframe 4 is not in"));
  EXPECT_EQ(cloud.points()->size(), 1U);
  EXPECT_EQ(cloud.keyframes(), 1U);
  EXPECT_NO_THROW(cloud.insert(4, {{{below, -limit, 0}, 1.0F}}));
}

TEST(GlobalCloud, RejectsOptionsOutOfRange) {
  GlobalCloudOptions options;
  options.outliers = {0, 0};
  EXPECT_THAT(messageOf([&] { GlobalCloud{options}; }), HasSubstr("outlier_min_neighbors = 0"));
}

}  // namespace

// Keyframes check each other's points.

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

/// Draws the points of a wall at z = 3 m. The inverse depth of each point has a random relative
/// error of up to `noise`.
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

/// Draws adjacent views. One point of 50 lies in front of the wall.
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

TEST(MapConsistency, FinalizedKeyframesMakeTheSameMapBitForBit) {
  std::mt19937 random(7);
  const std::vector<View> views = viewsWithOutliers(random, 40);
  for (const Consistency consistency :
       {Consistency::kNone, Consistency::kSupport, Consistency::kVisibility}) {
    GlobalCloud kept(withConsistency(consistency));
    GlobalCloud finalized(withConsistency(consistency));
    for (std::uint64_t k = 0; k < views.size(); ++k) {
      kept.insert(k, views[k].points, views[k].T_world_ref);
      finalized.insert(k, views[k].points, views[k].T_world_ref);
      // Keyframes are finalized at any time, one or several at once.
      if (k >= GlobalCloud::kMaxNumberDifference && random() % 3 == 0) {
        finalized.finalize(k - GlobalCloud::kMaxNumberDifference);
      }
      if (k % 10 != 9) continue;
      for (const int min_keyframes : {1, 3}) {
        EXPECT_TRUE(test::sameBits(*finalized.points(min_keyframes), *kept.points(min_keyframes)));
      }
    }
    EXPECT_EQ(finalized.keyframes(), kept.keyframes());
    EXPECT_GT(finalized.finalizedVoxels(), 0U);
    EXPECT_LT(finalized.unfinalizedVoxels(kAll), kept.unfinalizedVoxels(kAll) / 2);
    EXPECT_EQ(finalized.unfinalizedVoxels(0), 0U);
    finalized.finalize(31);  // only keyframes from 31 on may change
    finalized.finalize(5);   // a smaller number changes nothing
    EXPECT_THROW(finalized.insert(38, {}), std::invalid_argument);
    EXPECT_THROW(finalized.remove(30), std::invalid_argument);
    EXPECT_THROW(finalized.replace(30, {}, {}), std::invalid_argument);
    EXPECT_EQ(finalized.keyframes(), 40U);
    finalized.remove(39);
    kept.remove(39);
    EXPECT_TRUE(test::sameBits(*finalized.points(), *kept.points()));
  }
}

TEST(MapConsistency, SlabsMakeTheSameMapBitForBit) {
  constexpr std::size_t kMaxVoxels = 300;
  std::mt19937 random(7);
  const std::vector<View> views = viewsWithOutliers(random, 40);
  for (const Consistency consistency :
       {Consistency::kNone, Consistency::kSupport, Consistency::kVisibility}) {
    GlobalCloud whole(withConsistency(consistency));
    for (std::uint64_t k = 0; k < views.size(); ++k) {
      whole.insert(k, views[k].points, views[k].T_world_ref);
    }
    std::vector<CloudPoint> points;
    int slabs = 0;
    constexpr std::int64_t kEnd = std::numeric_limits<std::int64_t>::max();
    for (std::int64_t begin = -kEnd, end = begin; end != kEnd; ++slabs) {
      begin = end;
      end = kEnd;
      GlobalCloud slab(withConsistency(consistency));
      slab.keepSlab(begin, end);
      for (std::uint64_t k = 0; k < views.size(); ++k) {
        slab.insert(k, views[k].points, views[k].T_world_ref);
        if (k > GlobalCloud::kMaxNumberDifference && random() % 3 == 0) {
          slab.finalize(k - GlobalCloud::kMaxNumberDifference);
        }
        if (slab.finalizedVoxels() <= kMaxVoxels) continue;
        if (const auto middle = slab.middleX()) slab.keepSlab(begin, end = *middle);
      }
      const std::vector<CloudPoint> more = slab.pointsInWorld(1);
      points.insert(points.end(), more.begin(), more.end());
    }
    EXPECT_GT(slabs, 4);
    const double voxel_m = whole.options().voxel_size_m;
    EXPECT_TRUE(test::sameBits(*mapCloudOf(points, voxel_m), *whole.points(1)));
  }
}

}  // namespace

}  // namespace efm
