// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/cloud_alignment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::HasSubstr;

/// Points of the floor and of two walls of a room of 4 x 3 x 2 m, every 5 cm, and of a box on the
/// floor.
std::vector<CloudPoint> room(const Eigen::Vector3d& corner) {
  std::vector<CloudPoint> points;
  const auto wall = [&](Eigen::Vector3d from, const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
    for (double a = 0; a < u.norm(); a += 0.05) {
      for (double b = 0; b < v.norm(); b += 0.05) {
        points.push_back({corner + from + a * u.normalized() + b * v.normalized(), 1, 1});
      }
    }
  };
  wall({0, 0, 0}, {4, 0, 0}, {0, 3, 0});
  wall({0, 0, 0}, {4, 0, 0}, {0, 0, 2});
  wall({0, 0, 0}, {0, 3, 0}, {0, 0, 2});
  wall({2, 1, 0}, {0, 1, 0}, {0, 0, 1});
  return points;
}

/// Every third point with 1 cm of noise, each tenth of these an outlier of up to 1 m.
std::vector<CloudPoint> noisy(const std::vector<CloudPoint>& truth) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.01);
  std::uniform_real_distribution<double> outlier(-1, 1);
  std::vector<CloudPoint> map;
  for (std::size_t i = 0; i < truth.size(); i += 3) {
    const auto add = [&](auto& of) {
      map.push_back(truth[i]);
      map.back().p_world += Eigen::Vector3d(of(random), of(random), of(random));
    };
    if (i % 10 == 0) {
      add(outlier);
    } else {
      add(noise);
    }
  }
  return map;
}

TEST(AlignCloud, RecoversAKnownTransform) {
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, 2) / 3;
  const auto turned = [&](double angle_rad) { return rotationBy(angle_rad * axis); };
  struct Case {
    Rigid3 T_map_truth;  ///< About the corner of the room.
    Eigen::Vector3d corner;
  };
  const Eigen::Vector3d utm(450'000, 5'200'000, 300);
  for (const Case& example :
       {Case{{turned(0), {0, 0, 0}}, {0, 0, 0}}, Case{{turned(0.05), {0.1, -0.2, 0.1}}, {0, 0, 0}},
        Case{{turned(0.2), {0.3, 0.2, -0.3}}, {0, 0, 0}},
        Case{{turned(0.05), {0.1, -0.2, 0.1}}, utm}}) {
    const std::vector<CloudPoint> truth = room(example.corner);
    const std::vector<CloudPoint> map = noisy(truth);
    std::vector<CloudPoint> displaced = map;
    for (CloudPoint& point : displaced) {
      point.p_world =
          example.T_map_truth * Eigen::Vector3d(point.p_world - example.corner) + example.corner;
    }
    const CloudAlignment alignment = alignCloud(displaced, truth);
    // 3,600 points, 800 at least on each wall: 1 cm of noise moves a wall by 1 cm / sqrt(800) =
    // 0.35 mm, and its far end twice that. Five times this, because outliers near the walls count.
    double worst_m = 0;
    for (std::size_t i = 0; i < map.size(); ++i) {
      const Eigen::Vector3d error = alignment.T_truth_map * displaced[i].p_world - map[i].p_world;
      worst_m = std::max(worst_m, error.norm());
    }
    EXPECT_LT(worst_m, 5 * 0.7e-3) << example.T_map_truth.translation.transpose();
    EXPECT_EQ(alignment.points, map.size());
    // All but the outliers (a tenth) and the tail of the noise.
    EXPECT_GT(alignment.points_used, 0.85 * map.size());
    EXPECT_LT(alignment.points_used, map.size());
  }
}

TEST(AlignCloud, WhatCannotBeAlignedIsAnErrorThatSaysWhy) {
  const auto errorOf = [](const std::vector<CloudPoint>& map,
                          const std::vector<CloudPoint>& truth) {
    return messageOf([&] { alignCloud(map, truth); });
  };
  const std::vector<CloudPoint> truth = room({0, 0, 0});
  const std::vector<CloudPoint> few(truth.begin(), truth.begin() + 49);
  EXPECT_THAT(errorOf(few, truth), HasSubstr("49 points of the map"));
  EXPECT_THAT(errorOf(truth, few), HasSubstr("expected at least 50 of each"));
  // Only the floor, exact and with the noise of a scanner.
  const std::vector<CloudPoint> floor(truth.begin(), truth.begin() + 80 * 60);
  EXPECT_THAT(errorOf(noisy(truth), floor), HasSubstr("not a single wall"));
  std::vector<CloudPoint> rough = floor;
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.002);
  for (CloudPoint& point : rough) point.p_world.z() += noise(random);
  EXPECT_THAT(errorOf(noisy(truth), rough), HasSubstr("not a single wall"));
  // The truth has all walls, the map only the floor away from them.
  std::vector<CloudPoint> middle;
  for (const CloudPoint& point : floor) {
    if (point.p_world.x() > 2.5 && point.p_world.y() > 0.5) middle.push_back(point);
  }
  EXPECT_THAT(errorOf(noisy(middle), truth), HasSubstr("not a single wall"));
  // A map of something else.
  std::vector<CloudPoint> other;
  std::uniform_real_distribution<double> anywhere(-3, 3);
  for (int i = 0; i < 300; ++i) {
    other.push_back({{anywhere(random), anywhere(random), anywhere(random)}, 1, 1});
  }
  EXPECT_THAT(errorOf(other, truth), HasSubstr("does not converge"));
}

}  // namespace
}  // namespace efm
