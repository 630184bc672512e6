// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/map_point.h"

#include <gtest/gtest.h>
#include <pcl/conversions.h>
#include <pcl/point_types.h>

#include <cmath>
#include <string>

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
  EXPECT_EQ(names, "x y z intensity support (uint32) sigma ");
  MapCloud copy;
  pcl::fromPCLPointCloud2(fields, copy);
  EXPECT_EQ(copy.at(0).support, 70'000U);
  EXPECT_TRUE(std::isnan(copy.at(0).sigma)) << "not known";
  EXPECT_EQ(copy.at(0).data[3], 1) << "PCL transforms points as homogeneous ones";
}

TEST(MapCloud, IsRelativeToARoundOriginWhereFloatsAreTooCoarse) {
  struct Case {
    Eigen::Vector3d p_world;
    double resolution_m;
    Eigen::Vector3f origin;
  };
  const Case cases[] = {
      {{8191, -8191, 5}, 0.01, {0, 0, 0}},  // a float's step there: 0.5 mm, from 8192 m on 1 mm
      {{16383, 0, 0}, 0.01, {0, 0, 0}},
      {{16385, 0, 499}, 0.01, {16000, 0, 0}},  // 2 mm
      {{450'123.4, 5'400'456.7, 100}, 0.01, {450'000, 5'400'000, 0}},
      {{-450'623.4, 5'400'456.7, -600}, 0.01, {-451'000, 5'400'000, -1000}},
      {{450'123.4, 5'400'456.7, 100}, 0.001, {450'100, 5'400'500, 100}},
      {{450'123.4, 5'400'456.7, 100}, 10, {0, 0, 0}},
  };
  for (const Case& far : cases) {
    const std::vector<CloudPoint> points = {{far.p_world, 2, 3, 4, 0.5F}};
    const MapCloud::ConstPtr cloud = mapCloudOf(points, far.resolution_m);
    EXPECT_EQ(cloud->sensor_origin_.head<3>(), far.origin) << far.p_world.transpose();
    EXPECT_LT((positionIn(*cloud, cloud->at(0)) - far.p_world).cwiseAbs().maxCoeff(),
              0.051 * far.resolution_m)
        << far.p_world.transpose();
    EXPECT_EQ(cloud->at(0).first_keyframe, 4U);
    EXPECT_EQ(cloud->at(0).support, 3U);
    EXPECT_EQ(cloud->at(0).sigma, 0.5F);
    const auto step_m = coarseStepOf(*cloud, far.resolution_m);
    EXPECT_EQ(step_m.has_value(), !far.origin.isZero());
    // Floats of 24 bits: of 16385 in steps of 2^(14 - 23).
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

}  // namespace
}  // namespace efm
