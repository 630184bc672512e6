// SPDX-License-Identifier: BSD-3-Clause
// `map` is stopped at random times, by signals that it can catch and by one that it cannot. What it
// leaves is complete and agrees, or does not look complete.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "mapping/geometry/timestamp.h"
#include "mapping/geometry/trajectory.h"
#include "maps/io/point_cloud_file.h"
#include "test/paths.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

namespace fs = std::filesystem;
using Seconds = std::chrono::duration<double>;

/// Two maps that differ in their keyframes.
constexpr const char* kStride[] = {"keyframes.stride_s=0.1", "keyframes.stride_s=0.15"};

class Interruption : public TemporaryFolder {
 protected:
  void SetUp() override {
    if (!fs::exists(EFM_RECORDINGS "/desk_stereo")) GTEST_SKIP() << "the desk is not simulated";
    const int status =
        run({"import", EFM_RECORDINGS "/desk_stereo", "--duration", "1.2", "--out", recording()});
    ASSERT_EQ(status, 0);
  }

  std::string recording() const { return (folder() / "desk.rawlog").string(); }
  fs::path out() const { return folder() / "out"; }

  pid_t start(std::vector<std::string> arguments) const {
    const pid_t child = fork();
    if (child != 0) return child;
    for (const int number : {SIGINT, SIGTERM})
      std::signal(number, SIG_DFL);  // the parent may ignore
    const int null = open("/dev/null", O_RDWR);
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) dup2(null, stream);
    arguments.insert(arguments.begin(), EFM_EVENT_FUSION);
    std::vector<char*> words;
    for (std::string& argument : arguments) words.push_back(argument.data());
    words.push_back(nullptr);
    execv(EFM_EVENT_FUSION, words.data());
    _exit(127);
  }
  /// @return as waitpid has it.
  static int end(pid_t child) {
    int status = -1;
    EXPECT_EQ(waitpid(child, &status, 0), child);
    return status;
  }
  int run(const std::vector<std::string>& arguments) const { return end(start(arguments)); }

  std::vector<std::string> mapArguments(const std::string& stride, bool refined) const {
    return {"map",
            EFM_SOURCE_DIR "/config/simulated_stereo.ini",
            recording(),
            "--out",
            out().string(),
            "--set",
            stride,
            "--set",
            std::string("refinement.enabled=") + (refined ? "true" : "false")};
  }

  /// The time of a run that nothing interrupts.
  Seconds timeOfARun() const {
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(run(mapArguments(kStride[0], true)), 0);
    return std::chrono::steady_clock::now() - begin;
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
  nlohmann::json report() const {
    return nlohmann::json::parse(std::ifstream(out() / "report.json"));
  }

  /// A folder with a report: every file is whole, and all are of one run.
  void expectCompleteAndAgreeing() const {
    const nlohmann::json report = this->report();
    const std::size_t keyframes = report["keyframes"];
    std::set<std::string> expected = {"report.json"};
    if (keyframes > 0) {
      expected.insert({"keyframes", "map.html", "map.pcd", "map.png", "map.simplemap",
                       "overview.png", "trajectory.txt"});
      if (report.contains("refinement")) expected.insert("trajectory_tracker.txt");
      const auto poses = readTumTrajectory(out() / "trajectory.txt");
      EXPECT_EQ(poses.size(), keyframes);
      for (const StampedPose& pose : poses) {
        const std::string folder = "keyframes/" + formatSeconds(pose.t_ns);
        expected.insert({folder, folder + "/depth.tiff", folder + "/depth.png",
                         folder + "/confidence.tiff", folder + "/confidence.png"});
      }
      EXPECT_EQ(readPointCloud(out() / "map.pcd").points.size(), report["points"]);
    }
    EXPECT_EQ(files(), expected);
  }

  std::mt19937 random_{16};
};

TEST_F(Interruption, ASignalEndsAMapWithWhatIsMade) {
  const Seconds whole = timeOfARun();
  int stopped = 0;
  int with_keyframes = 0;
  for (int trial = 0; trial < 20; ++trial) {
    fs::remove_all(out());
    const Seconds delay = std::uniform_real_distribution<>(0, 1.02)(random_) * whole;
    SCOPED_TRACE(testing::Message()
                 << trial << ": after " << delay.count() << " s of " << whole.count());
    const pid_t child = start(mapArguments(kStride[0], trial % 2 == 0));
    std::this_thread::sleep_for(delay);
    kill(child, trial % 4 < 2 ? SIGINT : SIGTERM);
    const int status = end(child);
    if (!has("report.json")) {
      EXPECT_NE(status, 0) << "before the first pass ended";
      EXPECT_EQ(files(), std::set<std::string>());
      continue;
    }
    expectCompleteAndAgreeing();
    const bool was_stopped = WIFEXITED(status) && WEXITSTATUS(status) == 130;
    EXPECT_EQ(report().contains("stopped_at"), was_stopped) << status;
    stopped += was_stopped ? 1 : 0;
    with_keyframes += was_stopped && report()["keyframes"] > 0 ? 1 : 0;
  }
  EXPECT_GE(stopped, 5) << "at random times of a run, most signals find it at work";
  EXPECT_GE(with_keyframes, 3);
}

TEST_F(Interruption, AMapWithoutKeyframesKeepsTheEarlierResult) {
  ASSERT_EQ(run(mapArguments(kStride[0], false)), 0);
  const std::set<std::string> earlier = files();
  // Of a killed run: the next one removes it before it reads.
  const auto partial = out() / "map.partial-1.pcd";
  std::ofstream(partial) << "half";
  std::ofstream(out() / "report.partial.json") << R"({"recording": [], "process": 1})";
  // Packets of single events are slow to read.
  const std::string slow = (folder() / "slow.rawlog").string();
  ASSERT_EQ(run({"import", EFM_RECORDINGS "/desk_stereo", "--packet-s", "0.00001", "--out", slow}),
            0);
  const pid_t child =
      start({"map", slow, "--out", out().string(), "--set", "keyframes.window_s=30"});
  while (fs::exists(partial)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  kill(child, SIGINT);
  const int status = end(child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 130) << status;
  EXPECT_EQ(files(), earlier);
  EXPECT_FALSE(report().contains("stopped_at"));
  expectCompleteAndAgreeing();
}

TEST_F(Interruption, AKilledMapLooksCompleteOnlyIfItIs) {
  const Seconds whole = timeOfARun();
  int incomplete = 0;
  for (int trial = 0; trial < 12; ++trial) {
    const Seconds delay = std::uniform_real_distribution<>(0.2, 0.9)(random_) * whole;
    SCOPED_TRACE(testing::Message()
                 << trial << ": after " << delay.count() << " s of " << whole.count());
    const bool replaces = trial % 2 == 1;
    fs::remove_all(out());
    if (replaces) {
      ASSERT_EQ(run(mapArguments(kStride[0], false)), 0);
    }
    const std::set<std::string> earlier = files();
    const pid_t child = start(mapArguments(kStride[1], trial % 4 < 2));
    std::this_thread::sleep_for(delay);
    kill(child, SIGKILL);
    end(child);
    if (has("map.pcd")) {
      EXPECT_NO_THROW(readPointCloud(out() / "map.pcd"));
    }
    if (!has("report.json")) {
      ++incomplete;
    } else if (has("report.partial.json")) {
      const std::set<std::string> files = this->files();
      EXPECT_TRUE(std::includes(files.begin(), files.end(), earlier.begin(), earlier.end()));
    } else {
      expectCompleteAndAgreeing();
    }
  }
  EXPECT_GE(incomplete, 2) << "at random times of a run, most signals find it writing keyframes";
  ASSERT_EQ(run(mapArguments(kStride[1], true)), 0);
  expectCompleteAndAgreeing();
}

}  // namespace
}  // namespace efm
