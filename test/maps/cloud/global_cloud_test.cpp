// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/global_cloud.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "test/maps/cloud/cloud_points.h"
#include "test/maps/refusals.h"

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
    points.push_back({p_world, confidence(random), 1, 0, 0.01F * confidence(random)});
  }
  return points;
}

TEST(GlobalCloud, TheErrorOfAPointWithoutOneIsNotKnown) {
  GlobalCloud cloud({1.0, 1});
  cloud.insert(1, {{{0.5, 0.5, 0.5}, 2, 1, 0, 0.6F}});
  cloud.insert(2, {{{0.5, 0.5, 0.5}, 1}});
  EXPECT_TRUE(std::isnan(cloud.points()->at(0).sigma));
  cloud.remove(2);
  EXPECT_EQ(cloud.points()->at(0).sigma, 0.6F);
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
    std::map<std::size_t, double> sigmas;  // per keyframe, weighted
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
      mean.sigmas[k] += weight * point.sigma;
    }
  }

  const std::vector<CloudPoint> points = test::worldPoints(*cloud.points());
  RC_ASSERT(points.size() == means.size());
  // Far away the cloud's floats have steps of a tenth of a voxel at most: off by half of it per
  // axis.
  const double tolerance_m = far_m > 0 ? 0.09 * voxel_m : 1e-6;
  std::size_t i = 0;
  for (const auto& [index, mean] : means) {  // sorted by index, as the export is
    RC_ASSERT((points[i].p_world - mean.p / mean.weight).norm() < tolerance_m);
    RC_ASSERT(std::abs(points[i].confidence - mean.weight / mean.count) < 1e-5);
    RC_ASSERT(points[i].support == mean.sigmas.size());
    RC_ASSERT(points[i].first_keyframe == mean.sigmas.begin()->first);
    double squares = 0;  // common within a keyframe, independent between keyframes
    for (const auto& [keyframe, sigma] : mean.sigmas) squares += sigma * sigma;
    RC_ASSERT(std::abs(points[i].sigma - std::sqrt(squares) / mean.weight) < 1e-6);
    ++i;
  }
}

RC_GTEST_PROP(GlobalCloud, DependsOnItsKeyframesAloneBitForBit, ()) {
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  std::uniform_int_distribution<std::uint64_t> number(0, 11);  // some do not check each other
  std::uniform_int_distribution<int> count(0, 120);
  const Rigid3 T_world_ref{Eigen::Quaterniond(0.5, 0.5, 0.5, 0.5), {-1, 0, 0}};
  GlobalCloud cloud({0.4, 1});
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
    RC_ASSERT(cloud.voxels() == fresh.voxels());
    RC_ASSERT(cloud.keyframes() == inside.size());
  }
}

TEST(GlobalCloud, SupportIsThatOfTheKeyframesThatRemain) {
  GlobalCloud cloud({1.0, 2});
  cloud.insert(0, {{{0.2, 0.5, 0.5}, 1.0F}});
  cloud.insert(1, {{{0.6, 0.5, 0.5}, 1.0F}, {{5.5, 0.5, 0.5}, 1.0F}});
  ASSERT_EQ(cloud.points()->size(), 1U);

  cloud.remove(0);
  EXPECT_EQ(cloud.points()->size(), 0U);
  EXPECT_EQ(cloud.points(1)->size(), 2U);
  EXPECT_EQ(cloud.points(1)->at(0).support, 1U);
  EXPECT_EQ(cloud.points(1)->at(0).first_keyframe, 1U);
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

TEST(GlobalCloud, ARefusedKeyframeLeavesNothingBehind) {
  const double limit = std::ldexp(1, 60);  // of indices of 64 bits, where a voxel has 1/8 m
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
  EXPECT_EQ(cloud.voxels(), 1U);
  EXPECT_EQ(cloud.keyframes(), 1U);
  EXPECT_NO_THROW(cloud.insert(4, {{{below, -limit, 0}, 1.0F}}));
}

TEST(GlobalCloudOptions, ValuesOutOfRangeAreRefusedByName) {
  test::expectRange(&GlobalCloudOptions::voxel_size_m, 1e-6, 1000, "voxel_size_m");
  test::expectRange(&GlobalCloudOptions::min_keyframes, 1, std::numeric_limits<int>::max(),
                    "min_keyframes");
  GlobalCloudOptions options;
  options.outliers = {0, 0};
  EXPECT_THAT(messageOf([&] { GlobalCloud{options}; }), HasSubstr("outlier_min_neighbors = 0"));
  options = {};
  options.consistency.max_contradictions = -1;
  EXPECT_THAT(messageOf([&] { GlobalCloud{options}; }), HasSubstr("max_contradictions = -1"));
}

}  // namespace
}  // namespace efm
