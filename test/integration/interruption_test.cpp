// SPDX-License-Identifier: BSD-3-Clause
// Stops `map` at random times with signals that it can catch and a signal that it cannot catch. The
// result is complete and agrees, or is recognisably incomplete.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "mapping/geometry/timestamp.h"
#include "maps/io/point_cloud_file.h"
#include "plugin/recordings/open/recording_formats.h"
#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

namespace fs = std::filesystem;
using Seconds = std::chrono::duration<double>;

const std::string kDesk = EFM_RECORDINGS "/desk_stereo";
/// Two maps that differ in their keyframes.
constexpr const char* kStride[] = {"keyframes.stride_s=0.1", "keyframes.stride_s=0.15"};

class Interruption : public AppTest {
 protected:
  void SetUp() override {
    if (!fs::exists(kDesk)) GTEST_SKIP() << "the desk is not simulated";
    ASSERT_EQ(run("import " + kDesk + " --duration 1.2 --out desk.rawlog").status, 0);
  }

  fs::path out() const { return folder() / "out"; }

  static std::string mapArguments(const std::string& stride, bool refined) {
    return "map " EFM_SOURCE_DIR "/config/simulated_stereo.ini desk.rawlog --out out --set " +
           stride + " --set refinement.enabled=" + (refined ? "true" : "false");
  }

  /// Returns the duration of a run without interruption.
  Seconds timeOfARun() const {
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(run(mapArguments(kStride[0], true)).status, 0);
    return std::chrono::steady_clock::now() - begin;
  }
  /// @return the status of a run that gets a signal after a delay.
  int statusAfter(Seconds delay, int signal, const std::string& arguments) const {
    const auto end = std::chrono::steady_clock::now() + delay;
    const auto is_over = [&] { return std::chrono::steady_clock::now() >= end; };
    return interrupted(arguments, is_over, signal).status;
  }

  std::set<std::string> files() const {
    std::set<std::string> files;
    if (!fs::exists(out())) return files;
    for (const auto& entry : fs::recursive_directory_iterator(out())) {
      files.insert(entry.path().lexically_relative(out()).string());
    }
    return files;
  }
  bool has(const char* file) const { return fs::exists(out() / file); }

  /// Expects of a folder with a report that every file is complete, and that all are of one run.
  void expectCompleteAndAgreeing() const {
    const nlohmann::json report = reportIn("out");
    const std::size_t keyframes = report["keyframes"];
    std::set<std::string> expected = {"report.json"};
    if (keyframes > 0) {
      expected.insert({"keyframes", "map.html", "map.pcd", "map.png", "map.simplemap",
                       "overview.png", "session.mcap", "trajectory.txt"});
      if (report.contains("refinement")) expected.insert("trajectory_tracker.txt");
      const auto poses = readPoses(out() / "trajectory.txt");
      EXPECT_EQ(poses.size(), keyframes);
      for (const StampedPose& pose : poses) {
        const std::string folder = "keyframes/" + formatSeconds(pose.t_ns);
        expected.insert({folder, folder + "/depth.tiff", folder + "/depth.png",
                         folder + "/confidence.tiff", folder + "/probability.tiff",
                         folder + "/confidence.png"});
      }
      EXPECT_EQ(readPointCloud(out() / "map.pcd").points.size(), report["points"]);
    }
    EXPECT_EQ(files(), expected);
  }

  std::mt19937 random_{16};
};

TEST_F(Interruption, ASignalEndsAMapWithWhatIsMade) {
  Seconds whole = timeOfARun();
  int stopped = 0;
  int with_keyframes = 0;
  // A machine with other work changes its speed: then most signals come too early or too late.
  const auto rare = [&] { return stopped < 5 || with_keyframes < 3; };
  for (int trial = 0; trial < 20 || (rare() && trial < 80); ++trial) {
    if (trial % 20 == 0 && trial > 0) whole = timeOfARun();
    fs::remove_all(out());
    const Seconds delay = std::uniform_real_distribution<>(0, 1.02)(random_) * whole;
    SCOPED_TRACE(testing::Message()
                 << trial << ": after " << delay.count() << " s of " << whole.count());
    const int status = statusAfter(delay, trial % 4 < 2 ? SIGINT : SIGTERM,
                                   mapArguments(kStride[0], trial % 2 == 0));
    if (!has("report.json")) {
      EXPECT_NE(status, 0) << "before the first pass ended";
      EXPECT_EQ(files(), std::set<std::string>());
      continue;
    }
    expectCompleteAndAgreeing();
    const bool was_stopped = status == 130;
    EXPECT_EQ(reportIn("out").contains("stopped_at"), was_stopped) << status;
    stopped += was_stopped ? 1 : 0;
    with_keyframes += was_stopped && reportIn("out")["keyframes"] > 0 ? 1 : 0;
  }
  EXPECT_FALSE(rare()) << stopped << " runs were stopped, " << with_keyframes << " with keyframes";
}

TEST_F(Interruption, AMapWithoutKeyframesKeepsTheEarlierResult) {
  ASSERT_EQ(run(mapArguments(kStride[0], false)).status, 0);
  const std::set<std::string> earlier = files();
  // A keyframe of a killed run: the next run renames its folder before it maps.
  fs::create_directories(folder() / "out.partial");
  std::ofstream(folder() / "out.partial" / "run.lock");
  fs::copy(out() / "keyframes", folder() / "out.partial" / "keyframes",
           fs::copy_options::recursive);
  // Packets of single events are slow to read.
  ASSERT_EQ(run("import " + kDesk + " --packet-s 0.00001 --out slow.rawlog").status, 0);
  const Result result = interrupted("map slow.rawlog --out out --set keyframes.window_s=30",
                                    [&] { return fs::exists(folder() / "out.left"); });
  EXPECT_EQ(result.status, 130) << result.err;
  EXPECT_EQ(files(), earlier);
  EXPECT_TRUE(fs::exists(folder() / "out.left"));
  EXPECT_FALSE(fs::exists(folder() / "out.partial"));
  EXPECT_FALSE(reportIn("out").contains("stopped_at"));
  expectCompleteAndAgreeing();
}

TEST_F(Interruption, AKilledMapLooksCompleteOnlyIfItIs) {
  const Seconds whole = timeOfARun();
  int incomplete = 0;
  for (int trial = 0; trial < 12 || (incomplete < 2 && trial < 48); ++trial) {
    const Seconds delay = std::uniform_real_distribution<>(0.2, 0.9)(random_) * whole;
    SCOPED_TRACE(testing::Message()
                 << trial << ": after " << delay.count() << " s of " << whole.count());
    const bool replaces = trial % 2 == 1;
    fs::remove_all(out());
    if (replaces) {
      ASSERT_EQ(run(mapArguments(kStride[0], false)).status, 0);
    }
    statusAfter(delay, SIGKILL, mapArguments(kStride[1], trial % 4 < 2));
    incomplete += fs::exists(folder() / "out.partial" / "keyframes") ? 1 : 0;
    EXPECT_TRUE(!replaces || has("report.json")) << "the earlier result or the new one";
    if (fs::exists(out())) expectCompleteAndAgreeing();
  }
  EXPECT_GE(incomplete, 2) << "at random times of a run, most signals find it writing keyframes";
  ASSERT_EQ(run(mapArguments(kStride[1], true)).status, 0);
  expectCompleteAndAgreeing();
}

}  // namespace
}  // namespace efm
