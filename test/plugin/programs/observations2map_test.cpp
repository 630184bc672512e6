// SPDX-License-Identifier: BSD-3-Clause
// MRPT's observations2map builds our map from the simplemap that `event-fusion map` wrote.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "maps/io/point_cloud_file.h"
#include "test/plugin/program_test.h"

namespace efm {
namespace {

class Observations2map : public ProgramTest {};

TEST_F(Observations2map, BuildsTheMapThatEventFusionWrote) {
  if (!isInstalled("observations2map")) GTEST_SKIP() << "observations2map is not installed";
  importRecording(SyntheticRecording());
  mapOf("data.rawlog");
  write("map.ini",
        "[MappingApplication]\neventFusionMap_count = 1\n"
        "[MappingApplication_eventFusionMap_00_insertOpts]\nvoxel_size_m = 0.01\n");
  const Result result =
      shell("env LD_PRELOAD='" EFM_PLUGIN "' observations2map map.ini out/map.simplemap built");
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, testing::HasSubstr("4 observations"));

  const auto expected = readPointCloud(folder() / "out" / "map.pcd").points;
  const auto built = readPointCloud(folder() / "built_efm__CEventFusionMap_00.pcd").points;
  ASSERT_GT(expected.size(), 30U);
  ASSERT_EQ(built.size(), expected.size());
  for (std::size_t i = 0; i < built.size(); ++i) {
    EXPECT_LT((built[i].p_world - expected[i].p_world).norm(), 1e-6);
    EXPECT_EQ(built[i].confidence, expected[i].confidence);
  }
}

}  // namespace
}  // namespace efm
