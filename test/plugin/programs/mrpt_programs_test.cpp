// SPDX-License-Identifier: BSD-3-Clause
// Tests MRPT's programs and other programs with the plugin. The first is mrpt_host.cpp, which uses
// MRPT only.
#include <gmock/gmock.h>
#include <mrpt/obs/CRawlog.h>

#include <algorithm>
#include <cstdlib>
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
  // The maps are equal bit for bit.
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

// Tests that MRPT's observations2map builds our map from the simplemap of `event-fusion map`.

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

// Tests MRPT's rawlog-edit with the plugin on our rawlogs.

namespace {

using testing::Not;

class RawlogEdit : public ProgramTest {
 protected:
  void SetUp() override {
    if (!isInstalled("rawlog-edit")) GTEST_SKIP() << "rawlog-edit is not installed";
    importRecording(recording_);
  }

  Result edit(const std::string& arguments) const {
    return shell("rawlog-edit -p '" EFM_PLUGIN "' -i data.rawlog " + arguments);
  }

  SyntheticRecording recording_;
};

TEST_F(RawlogEdit, InfoCountsOurObservations) {
  const Result result = edit("--info");
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.out, AllOf(HasSubstr("All sensor labels                 : cam0, cam1, pose"),
                                HasSubstr("Observations format               : Yes"),
                                Not(HasSubstr("not registered"))));
}

TEST_F(RawlogEdit, ExportedTextHasTheEventsOfEachCamera) {
  ASSERT_EQ(edit("--export-txt").status, 0);
  for (const std::size_t camera : {0, 1}) {
    std::istringstream text(contentOf("data_cam" + std::to_string(camera) + ".txt"));
    std::string line;
    std::getline(text, line);
    EXPECT_THAT(line, HasSubstr("NUM_EVENTS"));
    std::size_t events = 0;
    double time = 0;
    for (std::size_t count = 0; text >> time >> count && std::getline(text, line);) events += count;
    EXPECT_EQ(events, recording_.events[camera].size());
  }
}

TEST_F(RawlogEdit, APartOfARawlogIsReadAgain) {
  const std::string events = std::to_string(recording_.events[0].size()) + " events";
  ASSERT_EQ(edit("--cut --from-time 10.1 --to-time 10.3 -o cut.rawlog").status, 0);
  EXPECT_THAT(run("info cut.rawlog").out,
              AllOf(HasSubstr("21 poses from 10.100000000 s to 10.300000000 s"),
                    HasSubstr("cam0: 120x90"), HasSubstr("cam1: 120x90")));
  ASSERT_EQ(edit("--keep-label cam0,pose -o kept.rawlog").status, 0);
  EXPECT_THAT(run("info kept.rawlog").out,
              AllOf(HasSubstr(events), HasSubstr("51 poses"), Not(HasSubstr("cam1"))));
}

}  // namespace

// The example pcl_host.cpp uses PCL's own classes on the builder's map.

namespace {

class PclHost : public ProgramTest {
 protected:
  /// Returns the number after a name in the program's output.
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
