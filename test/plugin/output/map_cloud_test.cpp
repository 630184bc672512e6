// SPDX-License-Identifier: BSD-3-Clause
// The exported map as other programs read it.

// PCL before MRPT, whose point maps then know it.
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <mrpt/maps/CPointsMapXYZI.h>

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "maps/io/point_cloud_file.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

class MapCloud : public TemporaryFolder {
 protected:
  void SetUp() override {
    TemporaryFolder::SetUp();
    for (int i = 0; i < 1000; ++i) {
      points_.push_back({{0.01 * i, -2.0 + 0.002 * i, 1.5}, 3.0F + static_cast<float>(i), 1});
    }
    path_ = folder() / "map.pcd";
    writePcd(path_, points_);
  }

  std::vector<CloudPoint> points_;
  std::filesystem::path path_;
};

TEST_F(MapCloud, OpensInMrptThroughPcl) {
  pcl::PointCloud<pcl::PointXYZI> cloud;
  ASSERT_EQ(pcl::io::loadPCDFile(path_.string(), cloud), 0);
  mrpt::maps::CPointsMapXYZI map;
  map.setFromPCLPointCloudXYZI(cloud);
  ASSERT_EQ(map.size(), points_.size());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    float x = 0;
    float y = 0;
    float z = 0;
    map.getPoint(i, x, y, z);
    EXPECT_EQ(Eigen::Vector3f(x, y, z), points_[i].p_world.cast<float>());
    EXPECT_EQ(map.getPointIntensity(i), points_[i].confidence);
  }
}

TEST_F(MapCloud, OpensInPclsOwnPrograms) {
  if (std::system("command -v pcl_pcd2ply >/dev/null") != 0) {
    GTEST_SKIP() << "pcl_pcd2ply (package pcl-tools) is not installed";
  }
  const std::filesystem::path ply = folder() / "map.ply";
  const std::string command =
      "pcl_pcd2ply '" + path_.string() + "' '" + ply.string() + "' >/dev/null 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0);
  EXPECT_GT(std::filesystem::file_size(ply), points_.size() * 3);
}

}  // namespace
}  // namespace efm
