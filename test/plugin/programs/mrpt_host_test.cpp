// SPDX-License-Identifier: BSD-3-Clause
// A program that has MRPT alone (mrpt_host.cpp) maps a rawlog with the plugin.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/obs/CRawlog.h>

#include <sstream>

#include "maps/io/point_cloud_file.h"
#include "plugin/mrpt/CEventFusionMapBuilder.h"
#include "test/paths.h"
#include "test/plugin/program_test.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class MrptHost : public ProgramTest {
 protected:
  Result host(const std::string& prefix) const {
    return shell("'" EFM_MRPT_HOST "' '" EFM_PLUGIN "' host.ini '" + prefix +
                 "' data.rawlog saved");
  }

  void expectTheMapOfEventFusion() const {
    const auto expected = readPointCloud(folder() / "out" / "map.pcd").points;
    std::istringstream text(contentOf("saved.txt"));
    std::size_t count = 0;
    for (float x = 0, y = 0, z = 0, confidence = 0; text >> x >> y >> z >> confidence; ++count) {
      ASSERT_LT(count, expected.size());
      EXPECT_NEAR(x, expected[count].p_world.x(), 1e-5);
      EXPECT_NEAR(y, expected[count].p_world.y(), 1e-5);
      EXPECT_NEAR(z, expected[count].p_world.z(), 1e-5);
      EXPECT_NEAR(confidence, expected[count].confidence, 1e-5 * expected[count].confidence);
    }
    EXPECT_EQ(count, expected.size());
  }
};

TEST_F(MrptHost, MapsARecordingShorterThanASecond) {
  importRecording(SyntheticRecording());
  mapOf("data.rawlog");
  write("host.ini", "[camera]\nfps = abc\n" + optionText("mapper_"));

  const Result result = host("mapper");

  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("4 keyframes"), HasSubstr("event fusion map")));
  EXPECT_GT(file_size(folder() / "saved.simplemap"), 1000U);
  expectTheMapOfEventFusion();
}

TEST_F(MrptHost, WithDefaultOptionsMakesTheMapOfTheProgram) {
  importRecording(SyntheticRecording(3.2));
  ASSERT_EQ(run("map data.rawlog --out out").status, 0);
  write("host.ini", "[camera]\nfps = 30\n");

  const Result result = host("");

  ASSERT_EQ(result.status, 0) << result.err;
  expectTheMapOfEventFusion();
  // Bit for bit.
  CEventFusionMapBuilder builder;
  mrpt::obs::CRawlog rawlog;
  ASSERT_TRUE(rawlog.loadFromRawLogFile((folder() / "data.rawlog").string()));
  for (std::size_t i = 0; i < rawlog.size(); ++i) {
    builder.processObservation(rawlog.getAsObservation(i));
  }
  builder.finish();
  writePcd(folder() / "host.pcd", *builder.points());
  EXPECT_EQ(contentOf("host.pcd"), contentOf("out/map.pcd"));
}

}  // namespace
}  // namespace efm
