// SPDX-License-Identifier: BSD-3-Clause
#include "maps/point_cloud_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <filesystem>
#include <fstream>

namespace efm {
namespace {

using testing::HasSubstr;

class PointCloudFile : public testing::Test {
 protected:
  void SetUp() override {
    const std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ = std::filesystem::temp_directory_path() / ("efm_" + name);
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::size_t filesInFolder() const {
    std::size_t files = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder_)) ++files;
    return files;
  }

  std::filesystem::path folder_;
};

TEST_F(PointCloudFile, IsReadBackByPclAsItWas) {
  std::vector<CloudPoint> points;
  for (int i = 0; i < 1000; ++i) points.push_back({{i * 0.125, -i * 0.25, 3.5}, i * 0.5F + 1});

  writePcd(folder_ / "map.pcd", points);

  pcl::PointCloud<pcl::PointXYZI> cloud;
  ASSERT_EQ(pcl::io::loadPCDFile((folder_ / "map.pcd").string(), cloud), 0);
  ASSERT_EQ(cloud.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(cloud[i].x, static_cast<float>(points[i].p_world.x()));
    EXPECT_EQ(cloud[i].y, static_cast<float>(points[i].p_world.y()));
    EXPECT_EQ(cloud[i].z, static_cast<float>(points[i].p_world.z()));
    EXPECT_EQ(cloud[i].intensity, points[i].confidence);
  }
  EXPECT_EQ(filesInFolder(), 1U) << "a temporary file stayed";
}

TEST_F(PointCloudFile, OfNoPointsIsAFileOfNoPoints) {
  writePcd(folder_ / "map.pcd", {});

  pcl::PCLPointCloud2 cloud;
  Eigen::Vector4f origin;
  Eigen::Quaternionf orientation;
  int version = 0;
  int type = 0;
  unsigned int offset = 0;
  EXPECT_GE(pcl::PCDReader().readHeader((folder_ / "map.pcd").string(), cloud, origin, orientation,
                                        version, type, offset),
            0);
  EXPECT_EQ(cloud.width * cloud.height, 0U);
  EXPECT_EQ(cloud.fields.size(), 4U);
}

TEST_F(PointCloudFile, ReplacesTheFileThatWasThere) {
  writePcd(folder_ / "map.pcd", {{{1, 2, 3}, 1.0F}, {{1, 2, 3}, 1.0F}});
  writePcd(folder_ / "map.pcd", {{{4, 5, 6}, 1.0F}});

  pcl::PointCloud<pcl::PointXYZI> cloud;
  ASSERT_EQ(pcl::io::loadPCDFile((folder_ / "map.pcd").string(), cloud), 0);
  ASSERT_EQ(cloud.size(), 1U);
  EXPECT_EQ(cloud[0].x, 4.0F);
}

TEST_F(PointCloudFile, ThatCannotBeWrittenIsAnErrorNamingThePath) {
  const std::filesystem::path path = folder_ / "nowhere" / "map.pcd";
  for (const std::vector<CloudPoint>& points :
       {std::vector<CloudPoint>{}, std::vector<CloudPoint>{{{1, 2, 3}, 1.0F}}}) {
    try {
      writePcd(path, points);
      ADD_FAILURE() << "no error with " << points.size() << " points";
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), HasSubstr(path.string()));
    }
  }
}

TEST_F(PointCloudFile, ThatCannotBeWrittenLeavesNoHalfFile) {
  // A folder of that name: writing beside it works, renaming onto it does not.
  std::filesystem::create_directories(folder_ / "map.pcd" / "inside");

  EXPECT_THROW(writePcd(folder_ / "map.pcd", {{{1, 2, 3}, 1.0F}}), std::runtime_error);

  EXPECT_EQ(filesInFolder(), 1U);
  EXPECT_TRUE(std::filesystem::is_directory(folder_ / "map.pcd"));
}

TEST_F(PointCloudFile, OnAFullDeviceIsAnError) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  std::filesystem::create_symlink("/dev/full", folder_ / "map.partial.pcd");

  EXPECT_THROW(writePcd(folder_ / "map.pcd", {{{1, 2, 3}, 1.0F}}), std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "map.pcd"));
}

}  // namespace
}  // namespace efm
