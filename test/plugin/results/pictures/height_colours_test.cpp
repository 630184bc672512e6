// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/pictures/picture.h"

#include <gtest/gtest.h>

namespace efm {
namespace {

/// Relative luminance as in sRGB, without its curve: enough to compare lightness.
double lightness(const PointColour& colour) {
  return 0.2126 * colour[0] + 0.7152 * colour[1] + 0.0722 * colour[2];
}

TEST(ColoursByHeight, HigherIsBrighterAndOutliersDoNotWidenTheRange) {
  // 101 points along -y, which is up; then the same with an outlier far below and one far above.
  std::vector<CloudPoint> points;
  for (int i = 0; i <= 100; ++i) points.push_back({{5.0 * i, -0.1 * i, 1}, 1, 1});
  const auto colours = coloursByHeight(*mapCloudOf(points, 0.01), -Eigen::Vector3d::UnitY());
  ASSERT_EQ(colours.size(), points.size());
  for (std::size_t i = 10; i <= 100; i += 10) {
    EXPECT_GT(lightness(colours[i]), lightness(colours[i - 10]) + 5) << i;
  }
  EXPECT_GT(colours[0][2], colours[0][0]) << "the low end is blue";
  EXPECT_LT(colours[100][2], colours[100][0]) << "the high end is yellow";

  points.push_back({{0, 1000, 0}, 1, 1});
  points.push_back({{0, -1000, 0}, 1, 1});
  const auto with_outliers = coloursByHeight(*mapCloudOf(points, 0.01), -Eigen::Vector3d::UnitY());
  EXPECT_EQ(with_outliers[101], colours[0]);
  EXPECT_EQ(with_outliers[102], colours[100]);
  EXPECT_EQ(with_outliers[50], colours[50]);
  EXPECT_TRUE(coloursByHeight(MapCloud(), Eigen::Vector3d::UnitZ()).empty());
  const std::vector<CloudPoint> flat(3, {{1, 2, 3}, 1, 1});
  EXPECT_EQ(coloursByHeight(*mapCloudOf(flat, 0.01), Eigen::Vector3d::UnitZ()).size(), 3U);
}

}  // namespace
}  // namespace efm
