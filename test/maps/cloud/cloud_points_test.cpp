// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <pcl/conversions.h>
#include <pcl/point_types.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "maps/cloud/cloud_points.h"
#include "maps/cloud/map_point.h"
#include "maps/cloud/visibility_grid.h"

namespace efm {
namespace {

TEST(MapPoint, HasItsFieldsInPcl) {
  MapCloud cloud;
  cloud.emplace_back().support = 70'000;
  pcl::PCLPointCloud2 fields;
  pcl::toPCLPointCloud2(cloud, fields);
  std::string names;
  for (const pcl::PCLPointField& field : fields.fields) {
    names += field.name + (field.datatype == pcl::PCLPointField::UINT32 ? " (uint32) " : " ");
    EXPECT_EQ(field.count, 1U);
  }
  EXPECT_EQ(names, "x y z intensity support (uint32) sigma probability ");
  MapCloud copy;
  pcl::fromPCLPointCloud2(fields, copy);
  EXPECT_EQ(copy.at(0).support, 70'000U);
  EXPECT_TRUE(std::isnan(copy.at(0).sigma)) << "not known";
  EXPECT_TRUE(std::isnan(copy.at(0).probability)) << "not known";
  EXPECT_EQ(copy.at(0).data[3], 1) << "PCL transforms points as homogeneous ones";
}

TEST(MapCloud, IsRelativeToARoundOriginWhereFloatsAreTooCoarse) {
  struct Case {
    Eigen::Vector3d p_world;
    double resolution_m;
    Eigen::Vector3f origin;
  };
  const Case cases[] = {
      {{8191, -8191, 5}, 0.01, {0, 0, 0}},  // float step: 0.5 mm, from 8192 m on 1 mm
      {{16383, 0, 0}, 0.01, {0, 0, 0}},
      {{16385, 0, 499}, 0.01, {16000, 0, 0}},  // float step: 2 mm
      {{450'123.4, 5'400'456.7, 100}, 0.01, {450'000, 5'400'000, 0}},
      {{-450'623.4, 5'400'456.7, -600}, 0.01, {-451'000, 5'400'000, -1000}},
      {{450'123.4, 5'400'456.7, 100}, 0.001, {450'100, 5'400'500, 100}},
      {{450'123.4, 5'400'456.7, 100}, 10, {0, 0, 0}},
  };
  for (const Case& far : cases) {
    const std::vector<CloudPoint> points = {{far.p_world, 2, 3, 4, 0.5F, 0.75F}};
    const MapCloud::ConstPtr cloud = mapCloudOf(points, far.resolution_m);
    EXPECT_EQ(cloud->sensor_origin_.head<3>(), far.origin) << far.p_world.transpose();
    EXPECT_LT((positionIn(*cloud, cloud->at(0)) - far.p_world).cwiseAbs().maxCoeff(),
              0.051 * far.resolution_m)
        << far.p_world.transpose();
    EXPECT_EQ(cloud->at(0).first_keyframe, 4U);
    EXPECT_EQ(cloud->at(0).support, 3U);
    EXPECT_EQ(cloud->at(0).sigma, 0.5F);
    EXPECT_EQ(cloud->at(0).probability, 0.75F);
    const auto step_m = coarseStepOf(*cloud, far.resolution_m);
    EXPECT_EQ(step_m.has_value(), !far.origin.isZero());
    // Floats have 24 bits: the step at 16385 is 2^(14 - 23).
    if (far.p_world.x() == 16385) {
      EXPECT_EQ(step_m, std::ldexp(1, -9));
    }
    const auto xyzi = xyziCloudOf(*cloud);
    EXPECT_EQ(xyzi->sensor_origin_, cloud->sensor_origin_);
    EXPECT_EQ(xyzi->at(0).getVector3fMap(), cloud->at(0).getVector3fMap());
    EXPECT_EQ(xyzi->at(0).intensity, 2);
  }
}

TEST(MapCloud, APointFarFromTheOthersDoesNotMoveTheOrigin) {
  std::vector<CloudPoint> points(1000, {{1, 2, 3}, 1});
  points[500].p_world = {1e7, 0, 0};
  const auto cloud = mapCloudOf(points, 0.01);
  EXPECT_EQ(cloud->sensor_origin_.head<3>(), Eigen::Vector3f::Zero());
  EXPECT_FALSE(coarseStepOf(*cloud, 0.01)) << "the map is not far away";
  points[501].p_world = {0, -1e7, 0};
  EXPECT_TRUE(coarseStepOf(*mapCloudOf(points, 0.01), 0.01)) << "more than 0.1 % of it are";
  EXPECT_TRUE(mapCloudOf({}, 0.01)->empty());
}

using testing::ElementsAre;

/// Returns points on the x axis. Their confidences are numbers from 1 on.
std::vector<CloudPoint> onALine(const std::vector<double>& xs) {
  std::vector<CloudPoint> points;
  points.reserve(xs.size());
  for (const double x : xs) points.push_back({{x, 0, 0}, static_cast<float>(points.size() + 1)});
  return points;
}

std::vector<float> numbers(const std::vector<CloudPoint>& points) {
  std::vector<float> numbers;
  numbers.reserve(points.size());
  for (const CloudPoint& point : points) numbers.push_back(point.confidence);
  return numbers;
}

/// Draws points in a box around `middle`, on a lattice of 1/8 m (exact in float).
std::vector<CloudPoint> latticePoints(std::mt19937& random, int count,
                                      const Eigen::Vector3d& middle, int radius) {
  std::uniform_int_distribution<int> eighths(-radius, radius);
  std::vector<CloudPoint> points;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d offset(eighths(random), eighths(random), eighths(random));
    points.push_back({middle + offset / 8, static_cast<float>(i + 1)});
  }
  return points;
}

std::vector<float> survivorsByBruteForce(const std::vector<CloudPoint>& points,
                                         const OutlierRemovalOptions& options) {
  std::vector<float> survivors;
  for (const CloudPoint& point : points) {
    // The point itself is within the radius.
    const auto within = std::count_if(points.begin(), points.end(), [&](const CloudPoint& other) {
      return (other.p_world - point.p_world).norm() <= options.outlier_radius_m;
    });
    if (within - 1 >= options.outlier_min_neighbors) survivors.push_back(point.confidence);
  }
  return survivors;
}

RC_GTEST_PROP(RemoveOutliers, KeepsWhatBruteForceKeepsAtAnyDistanceFromTheOrigin, ()) {
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  const auto middle = *rc::gen::element(0.0, 1e6);
  const std::vector<CloudPoint> points = latticePoints(
      random, *rc::gen::inRange(0, 400), {middle, -middle, middle}, *rc::gen::element(4, 16, 64));
  OutlierRemovalOptions options;
  options.outlier_radius_m = *rc::gen::element(0.125, 0.5, 1.0, 3.0);  // some on the radius
  options.outlier_min_neighbors = *rc::gen::inRange(1, 12);

  RC_ASSERT(numbers(removeOutliers(points, options)) == survivorsByBruteForce(points, options));
}

TEST(RemoveOutliers, AFarOutlierDoesNotReduceThePrecisionOfTheOthers) {
  // Floats relative to the middle of the bounds, 5e8 m away, would have steps of 32 m.
  const std::vector<CloudPoint> points = onALine({0, 0.01, 0.02, 0.03, 0.5, 1e9});

  EXPECT_THAT(numbers(removeOutliers(points, {0.015, 1})), ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(removeOutliers(points, {}).size(), points.size()) << "radius 0";
}

TEST(RemoveOutliers, PointsThatAreNotFiniteAreRejected) {
  // The square of 1e18 fits a float; the square of 1e20 does not.
  for (const double wrong : {std::nan(""), 1.0 * INFINITY, 1e18, -1e30}) {
    EXPECT_THROW(removeOutliers(onALine({0, 0, wrong}), {1, 1}), std::invalid_argument) << wrong;
  }
  EXPECT_THAT(numbers(removeOutliers(onALine({0, 0, 9.9e17}), {1, 1})), ElementsAre(1, 2));
}

ConsistencyOptions options() {
  ConsistencyOptions options;
  options.consistency_tolerance = 0.05;
  options.consistency_cell_deg = 1;
  return options;
}

TEST(VisibilityGrid, HiddenAndUnseenPointsAreUnknown) {
  std::vector<CloudPoint> wall;  // x and y from -1 to 1 m, spacing of half a degree or less
  for (int y = -100; y <= 100; ++y) {
    for (int x = -100; x <= 100; ++x) wall.push_back({{0.01 * x, 0.01 * y, 2}, 1.0F});
  }
  const VisibilityGrid grid(wall, {}, options());
  EXPECT_EQ(grid.verdictOn({0.1, 0.1, 2.2}), Verdict::kUnknown) << "behind the wall";
  EXPECT_EQ(grid.verdictOn({1.2, 0, 1.5}), Verdict::kUnknown) << "outside of it";
  EXPECT_EQ(grid.verdictOn({0.1, 0.1, -2}), Verdict::kUnknown) << "behind the view";
  EXPECT_EQ(grid.verdictOn({0.1, 0.1, 0}), Verdict::kUnknown);
  EXPECT_EQ(grid.verdictOn({1e12, 0.1, 1e-9}), Verdict::kUnknown) << "far to the side";
  const auto verdict_of = [](const Eigen::Vector3d& only, const Eigen::Vector3d& asked) {
    return VisibilityGrid({{only, 1.0F}}, {}, options()).verdictOn(asked);
  };
  EXPECT_EQ(verdict_of({0, 0, 2}, {0, 0, 1}), Verdict::kUnknown) << "a single cell behind";
  EXPECT_EQ(verdict_of({0, 0, -1}, {0, 0, -1}), Verdict::kUnknown) << "a point behind the view";
  EXPECT_EQ(VisibilityGrid({}, {}, options()).verdictOn({0, 0, 1}), Verdict::kUnknown);
  // A point is in view up to 20 times its depth to the side.
  for (const double sign : {-1.0, 1.0}) {
    for (const Eigen::Vector3d& side : {Eigen::Vector3d(sign, 0, 0), Eigen::Vector3d(0, sign, 0)}) {
      const Eigen::Vector3d inside = 19.9 * side + Eigen::Vector3d::UnitZ();
      const Eigen::Vector3d outside = 20.1 * side + Eigen::Vector3d::UnitZ();
      EXPECT_EQ(verdict_of(inside, inside), Verdict::kSupports) << side.transpose();
      EXPECT_EQ(verdict_of(outside, outside), Verdict::kUnknown) << side.transpose();
    }
  }
}

RC_GTEST_PROP(VisibilityGrid, DecidesLikeBruteForce, ()) {
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  std::uniform_real_distribution<double> side(-0.3, 0.3);
  std::uniform_real_distribution<double> depth(1, 2);
  const auto draw = [&] {
    const double z = depth(random);
    return Eigen::Vector3d(side(random) * z, side(random) * z, z);
  };
  std::vector<CloudPoint> points;
  for (int i = 0; i < *rc::gen::inRange(1, 200); ++i) points.push_back({draw(), 1.0F});
  // The view is rotated by right angles and moved by whole metres.
  const Rigid3 T_world_ref{Eigen::Quaterniond(0.5, 0.5, 0.5, 0.5), {16, -8, 4}};
  std::vector<CloudPoint> in_world = points;
  for (CloudPoint& point : in_world) point.p_world = T_world_ref * point.p_world;
  const VisibilityGrid grid(in_world, T_world_ref, options());
  int differing = 0;

  std::vector<double> inverse;
  for (const CloudPoint& point : points) inverse.push_back(1 / point.p_world.z());
  std::sort(inverse.rbegin(), inverse.rend());
  const double tolerance = 0.05 * inverse[inverse.size() / 20];
  const auto cellOf = [](const Eigen::Vector3d& p) {
    const double cell = M_PI / 180;
    return Eigen::Vector2d(std::floor(p.x() / p.z() / cell), std::floor(p.y() / p.z() / cell));
  };
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d asked = draw();
    bool supports = false;
    bool nearer = true;
    int cells = 0;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        double nearest = 0;
        double farthest = 1e9;
        for (const CloudPoint& point : points) {
          if (cellOf(point.p_world) != cellOf(asked) + Eigen::Vector2d(dx, dy)) continue;
          nearest = std::max(nearest, 1 / point.p_world.z());
          farthest = std::min(farthest, 1 / point.p_world.z());
        }
        if (nearest == 0) continue;
        ++cells;
        const double own = 1 / asked.z();
        supports = supports || std::abs(own - nearest) <= tolerance ||
                   std::abs(own - farthest) <= tolerance;
        nearer = nearer && own - nearest > 2 * tolerance;
      }
    }
    const Verdict expected = supports               ? Verdict::kSupports
                             : nearer && cells >= 2 ? Verdict::kFreeSpaceViolation
                                                    : Verdict::kUnknown;
    if (grid.verdictOn(T_world_ref * asked) != expected) ++differing;
  }
  RC_ASSERT(differing <= 1);  // rounding may move a point over a cell's border
}

}  // namespace

}  // namespace efm
