// SPDX-License-Identifier: BSD-3-Clause
// MRPT's observations2map builds our map from the simplemap that `event-fusion map` wrote.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "maps/io/point_cloud_file.h"
#include "test/plugin/program_test.h"

namespace efm {
namespace {

using testing::HasSubstr;

class Observations2map : public ProgramTest {
 protected:
  void SetUp() override {
    if (!isInstalled("observations2map")) GTEST_SKIP() << "observations2map is not installed";
    importRecording(SyntheticRecording());
    mapOf("data.rawlog");
  }

  Result build(const std::string& insert_options) const {
    write("map.ini",
          "[MappingApplication]\neventFusionMap_count = 1\n"
          "[MappingApplication_eventFusionMap_00_insertOpts]\n" +
              insert_options);
    return shell("env LD_PRELOAD='" EFM_PLUGIN
                 "' observations2map map.ini out/map.simplemap built");
  }
};

TEST_F(Observations2map, BuildsTheMapThatEventFusionWrote) {
  const Result result = build("voxel_size_m = 0.01\n");
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("4 observations"));

  const auto expected = readPointCloud(folder() / "out" / "map.pcd").points;
  const auto built = readPointCloud(folder() / "built_efm__CEventFusionMap_00.pcd").points;
  ASSERT_GT(expected.size(), 30U);
  ASSERT_EQ(built.size(), expected.size());
  for (std::size_t i = 0; i < built.size(); ++i) {
    EXPECT_LT((built[i].p_world - expected[i].p_world).norm(), 1e-6);
    EXPECT_EQ(built[i].confidence, expected[i].confidence);
  }
}

TEST_F(Observations2map, TakesOptionsAndRefusesWrongOnes) {
  EXPECT_EQ(build("voxel_size_m = 0.5\n").status, 0);
  EXPECT_LT(readPointCloud(folder() / "built_efm__CEventFusionMap_00.pcd").points.size(),
            readPointCloud(folder() / "out" / "map.pcd").points.size());

  const Result refused = build("voxel_size_m = abc\n");
  EXPECT_NE(refused.status, 0);
  EXPECT_THAT(refused.out + refused.err,
              HasSubstr("map.ini, section MappingApplication_eventFusionMap_00_insertOpts: "
                        "voxel_size_m = abc: must be a number"));
}

}  // namespace
}  // namespace efm
