// SPDX-License-Identifier: BSD-3-Clause
// The example pcl_host.cpp uses PCL's own classes on the builder's map.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "maps/io/point_cloud_file.h"
#include "test/paths.h"
#include "test/plugin/program_test.h"

namespace efm {
namespace {

class PclHost : public ProgramTest {
 protected:
  /// The number after a name in the program's output.
  static double numberAfter(const std::string& text, const std::string& name) {
    const std::size_t at = text.find(name + ": ");
    EXPECT_NE(at, std::string::npos) << name;
    return at == std::string::npos ? -1 : std::atof(text.c_str() + at + name.size() + 2);
  }
};

TEST_F(PclHost, FiltersSearchesAndAlignsTheMap) {
  importRecording(SyntheticRecording());
  mapOf("data.rawlog");
  const auto expected = readPointCloud(folder() / "out" / "map.pcd").points;
  write("host.ini", optionText());

  const Result result = shell("'" EFM_PCL_HOST "' host.ini data.rawlog");

  ASSERT_EQ(result.status, 0) << result.err;
  const auto points = static_cast<double>(expected.size());
  EXPECT_EQ(numberAfter(result.out, "points"), points);
  for (const char* filtered : {"voxel grid", "with a neighbour", "near their neighbours"}) {
    EXPECT_GT(numberAfter(result.out, filtered), 0.1 * points) << result.out;
    EXPECT_LE(numberAfter(result.out, filtered), points) << result.out;
  }
  const Eigen::Vector3d& middle = expected[expected.size() / 2].p_world;
  const auto neighbours = std::count_if(
      expected.begin(), expected.end(),
      [&](const CloudPoint& point) { return (point.p_world - middle).norm() <= 0.5; });
  EXPECT_EQ(numberAfter(result.out, "neighbours in the k-d tree"), neighbours);
  EXPECT_EQ(numberAfter(result.out, "neighbours in the octree"), neighbours);
  EXPECT_NEAR(numberAfter(result.out, "ICP moved by"), -0.01, 1e-4) << result.out;
}

}  // namespace
}  // namespace efm
