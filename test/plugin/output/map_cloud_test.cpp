// SPDX-License-Identifier: BSD-3-Clause
// The exported map as other programs read it.

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "maps/io/point_cloud_file.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

class MapCloud : public TemporaryFolder {};

TEST_F(MapCloud, OpensInPclsOwnPrograms) {
  if (std::system("command -v pcl_pcd2ply >/dev/null") != 0) {
    GTEST_SKIP() << "pcl_pcd2ply (package pcl-tools) is not installed";
  }
  std::vector<CloudPoint> points;
  for (int i = 0; i < 1000; ++i) {
    points.push_back({{0.01 * i, -2.0 + 0.002 * i, 1.5}, 3.0F + static_cast<float>(i), 1});
  }
  writePcd(folder() / "map.pcd", points);
  const std::string command = "cd '" + folder().string() + "' && pcl_pcd2ply map.pcd map.ply";
  ASSERT_EQ(std::system((command + " >/dev/null 2>&1").c_str()), 0);
  const std::vector<CloudPoint> read = readPointCloud(folder() / "map.ply").points;
  ASSERT_EQ(read.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(read[i].p_world.cast<float>(), points[i].p_world.cast<float>());
    EXPECT_EQ(read[i].confidence, points[i].confidence);
  }
}

}  // namespace
}  // namespace efm
