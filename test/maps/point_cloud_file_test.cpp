// SPDX-License-Identifier: BSD-3-Clause
#include "maps/point_cloud_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "maps/whole_file.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// What we write: extension and encoding.
struct Kind {
  const char* name;
  PointCloudEncoding encoding;
};
const std::vector<Kind> kKinds = {
    {"binary.pcd", PointCloudEncoding::kBinary},
    {"text.pcd", PointCloudEncoding::kAscii},
    {"compressed.pcd", PointCloudEncoding::kCompressed},
    {"binary.ply", PointCloudEncoding::kBinary},
    {"text.ply", PointCloudEncoding::kAscii},
};

bool isPly(const std::filesystem::path& path) { return path.extension() == ".ply"; }

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

std::vector<CloudPoint> plainPoints() {
  std::vector<CloudPoint> points;
  points.reserve(1000);
  for (int i = 0; i < 1000; ++i) points.push_back({{i * 0.1, -i / 3.0, 3.5}, i * 0.7F + 1});
  return points;
}

TEST_F(PointCloudFile, IsReadBackByPclAsItWas) {
  const std::vector<CloudPoint> points = plainPoints();
  for (const Kind& kind : kKinds) {
    SCOPED_TRACE(kind.name);
    const std::filesystem::path path = folder_ / kind.name;
    writePointCloud(path, points, kind.encoding);

    pcl::PointCloud<pcl::PointXYZI> cloud;
    ASSERT_EQ(isPly(path) ? pcl::io::loadPLYFile(path.string(), cloud)
                          : pcl::io::loadPCDFile(path.string(), cloud),
              0);
    ASSERT_EQ(cloud.size(), points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_EQ(cloud[i].x, static_cast<float>(points[i].p_world.x()));
      EXPECT_EQ(cloud[i].y, static_cast<float>(points[i].p_world.y()));
      EXPECT_EQ(cloud[i].z, static_cast<float>(points[i].p_world.z()));
      EXPECT_EQ(cloud[i].intensity, points[i].confidence);
    }
  }
  EXPECT_EQ(filesInFolder(), kKinds.size()) << "a temporary file stayed";
}

TEST_F(PointCloudFile, OfNoPointsIsAFileOfNoPoints) {
  for (const Kind& kind : kKinds) {
    SCOPED_TRACE(kind.name);
    const std::filesystem::path path = folder_ / kind.name;
    writePointCloud(path, {}, kind.encoding);

    pcl::PCLPointCloud2 cloud;
    ASSERT_EQ(isPly(path) ? pcl::PLYReader().read(path.string(), cloud)
                          : pcl::PCDReader().read(path.string(), cloud),
              0);
    EXPECT_EQ(cloud.width * cloud.height, 0U);
    EXPECT_EQ(cloud.fields.size(), 4U);
  }
}

TEST_F(PointCloudFile, OfAnUnknownFormatOrEncodingIsNotWritten) {
  const auto refusal = [this](const char* name, PointCloudEncoding encoding) -> std::string {
    try {
      writePointCloud(folder_ / name, {{{1, 2, 3}, 1.0F}}, encoding);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(refusal("map.las", PointCloudEncoding::kBinary),
              AllOf(HasSubstr("map.las"), HasSubstr("expected .pcd or .ply")));
  EXPECT_THAT(refusal("map", PointCloudEncoding::kBinary), HasSubstr("expected .pcd or .ply"));
  EXPECT_THAT(refusal("map.ply", PointCloudEncoding::kCompressed),
              HasSubstr("compressed PLY: expected binary or ASCII"));
  EXPECT_EQ(refusal("MAP.PLY", PointCloudEncoding::kAscii), "accepted");
  EXPECT_EQ(filesInFolder(), 1U);
}

TEST_F(PointCloudFile, WithAPointThatAFloatCannotHoldIsNotWritten) {
  for (const CloudPoint& point :
       {CloudPoint{{1e39, 0, 0}, 1.0F}, CloudPoint{{0, std::nan(""), 0}, 1.0F},
        CloudPoint{{0, 0, 0}, std::numeric_limits<float>::infinity()}}) {
    for (const Kind& kind : kKinds) {
      try {
        writePointCloud(folder_ / kind.name, {{{1, 2, 3}, 1.0F}, point}, kind.encoding);
        ADD_FAILURE() << "accepted";
      } catch (const std::runtime_error& error) {
        EXPECT_THAT(error.what(), AllOf(HasSubstr(kind.name), HasSubstr("point 1 ("),
                                        HasSubstr("expected finite numbers")));
      }
    }
  }
  EXPECT_EQ(filesInFolder(), 0U);
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
  for (const Kind& kind : kKinds) {
    const std::filesystem::path path = folder_ / kind.name;
    std::filesystem::create_symlink("/dev/full", temporaryName(path));

    EXPECT_THROW(writePointCloud(path, {{{1, 2, 3}, 1.0F}}, kind.encoding), std::runtime_error);
    EXPECT_FALSE(std::filesystem::exists(path));
  }
}

}  // namespace
}  // namespace efm
