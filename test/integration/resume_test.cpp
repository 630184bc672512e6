// SPDX-License-Identifier: BSD-3-Clause
// Ends `map` after calls that change files, and at random times, and lets it go on: the result is
// that of an undisturbed run.
#include <sys/syscall.h>
#include <sys/uio.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <map>
#include <random>
#include <string>

#include "plugin/session_file/keyframe_record.h"
#include "plugin/session_file/session_file.h"
#include "test/paths.h"
#include "test/plugin/app/app_test.h"

namespace {

std::atomic<long> calls{0};
std::atomic<long> last_call{-1};  // -1: none

/// Counts a call, and ends the process after the last one, as a crash would.
template <typename Result>
Result counted(Result result) {
  const int error = errno;
  if (++calls == last_call) _exit(99);
  errno = error;
  return result;
}

}  // namespace

// These replace the functions of the C library for the whole process.
extern "C" {
ssize_t write(int file, const void* bytes, size_t size) {
  return counted(syscall(SYS_write, file, bytes, size));
}
ssize_t pwrite(int file, const void* bytes, size_t size, off_t at) {
  return counted(syscall(SYS_pwrite64, file, bytes, size, at));
}
ssize_t writev(int file, const iovec* parts, int count) {
  return counted(syscall(SYS_writev, file, parts, count));
}
int fsync(int file) { return static_cast<int>(counted(syscall(SYS_fsync, file))); }
int fdatasync(int file) { return static_cast<int>(counted(syscall(SYS_fdatasync, file))); }
int ftruncate(int file, off_t size) noexcept {
  return static_cast<int>(counted(syscall(SYS_ftruncate, file, size)));
}
int rename(const char* from, const char* to) noexcept {
  return static_cast<int>(counted(syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0)));
}
int renameat2(int from_folder, const char* from, int to_folder, const char* to,
              unsigned int flags) noexcept {
  return static_cast<int>(counted(syscall(SYS_renameat2, from_folder, from, to_folder, to, flags)));
}
int unlink(const char* path) noexcept {
  return static_cast<int>(counted(syscall(SYS_unlinkat, AT_FDCWD, path, 0)));
}
int link(const char* from, const char* to) noexcept {
  return static_cast<int>(counted(syscall(SYS_linkat, AT_FDCWD, from, AT_FDCWD, to, 0)));
}
}

namespace efm {
namespace {

namespace fs = std::filesystem;
using Files = std::map<std::string, std::string>;

const std::string kDesk = EFM_RECORDINGS "/desk_stereo";
/// Three keyframes; no first look.
const std::string kThree =
    " --duration 1 --set dsi.min_depth_m=0.6 --set dsi.max_depth_m=6 --set dsi.num_planes=60 --set "
    "keyframes.window_s=0.4 --set keyframes.stride_s=0.3 --set map.voxel_size_m=0.02 --set "
    "checks.enabled=false --plain-pictures";

class Resume : public AppTest {
 protected:
  void SetUp() override {
    if (!fs::exists(kDesk)) GTEST_SKIP() << "the desk is not simulated";
  }

  static std::string map(const std::string& out, const std::string& options) {
    return "map " + kDesk + " --out " + out + options;
  }

  /// Returns the files of a result without what depends on the clock: times, memory.
  Files resultIn(const std::string& out) const {
    Files files;
    for (const auto& entry : fs::recursive_directory_iterator(folder() / out)) {
      if (!entry.is_regular_file()) continue;
      const std::string name = entry.path().lexically_relative(folder() / out).string();
      if (name != "map.html") files[name] = readText(entry.path());
    }
    nlohmann::json report = reportIn(out);
    for (const char* key : {"seconds", "cpu_seconds", "votes_per_second", "peak_memory_bytes",
                            "session", "threads"}) {
      report.erase(key);
    }
    report["options"].erase("performance");
    files["report.json"] = report.dump();
    const SessionFile session(folder() / out / "session.mcap");
    EXPECT_EQ(session.damage(), "");
    std::string& stored = files["session.mcap"] = session.run().dump();
    for (std::size_t i = 0; i < session.keyframes(); ++i) {
      stored += keyframeMessage(session.keyframe(i));
    }
    for (const StampedPose& pose : session.poses(true)) stored += poseMessage(pose);
    return files;
  }

  void removeOut() const {
    for (const char* name : {"out", "out.partial", "out.left"}) fs::remove_all(folder() / name);
  }

  /// Lets the run go on that was ended, and expects the undisturbed result and nothing else.
  /// @return the number of keyframes that were stored.
  std::size_t goOn(const std::string& options, const Files& undisturbed) const {
    const Result result = run(map("out", options + " --resume"));
    EXPECT_EQ(result.status, 0) << result.err;
    const Files files = resultIn("out");
    for (const auto& [name, content] : undisturbed) {
      EXPECT_TRUE(files.count(name) > 0 && files.at(name) == content) << name << " differs";
    }
    EXPECT_EQ(files.size(), undisturbed.size());
    EXPECT_FALSE(fs::exists(folder() / "out.partial"));
    EXPECT_FALSE(fs::exists(folder() / "out.left"));
    const std::string after = "goes on after the ";
    const std::size_t at = result.err.find(after);
    return at == std::string::npos ? 0 : std::stoul(result.err.substr(at + after.size()));
  }
};

TEST_F(Resume, EndedAfterAnyCallThatChangesFilesItMakesTheSameResult) {
  ASSERT_EQ(run(map("undisturbed", kThree)).status, 0);
  const Files undisturbed = resultIn("undisturbed");
  constexpr long kStride = 7;
  std::map<std::size_t, int> stored;
  bool ended = true;
  for (long call = 1; ended; call += kStride) {
    SCOPED_TRACE(call);
    removeOut();
    calls = 0;
    last_call = call;
    ended = run(map("out", kThree)).status == 99;
    last_call = -1;
    if (ended) ++stored[goOn(kThree, undisturbed)];
  }
  EXPECT_EQ(stored.size(), 4U) << "with 0, 1, 2 and 3 stored keyframes";
}

TEST_F(Resume, KilledAtRandomTimesItMakesTheSameResult) {
  std::mt19937 random(7);
  std::size_t stored = 0;
  for (const std::string& options :
       {std::string(),
        std::string(" --set refinement.enabled=true --set keyframes.stride_s=0.1")}) {
    const auto begin = std::chrono::steady_clock::now();
    ASSERT_EQ(run(map("undisturbed", options)).status, 0);
    const std::chrono::duration<double> whole = std::chrono::steady_clock::now() - begin;
    const Files undisturbed = resultIn("undisturbed");
    for (int trial = 0; trial < 4; ++trial) {
      removeOut();
      const auto end = std::chrono::steady_clock::now() +
                       std::uniform_real_distribution<>(0.4, 0.9)(random) * whole;
      interrupted(
          map("out", options), [&] { return std::chrono::steady_clock::now() >= end; },
          trial == 3 ? SIGTERM : SIGKILL);
      stored += goOn(options, undisturbed);
    }
  }
  EXPECT_GT(stored, 0U) << "at these times of a run, most signals find keyframes";
}

TEST_F(Resume, OtherOptionsAndRecordingsAreNamedAndNothingIsLost) {
  calls = 0;
  last_call = 40;
  ASSERT_EQ(run(map("out", kThree)).status, 99);
  last_call = -1;
  const auto stored = [&](const char* name) {
    const fs::path file = folder() / name / "session.mcap";
    return fs::exists(file) ? SessionFile(file).keyframes() : 0;
  };
  const std::size_t keyframes = stored("out.partial");
  ASSERT_GT(keyframes, 0U);
  const Result other = run(map("out", kThree + " --set dsi.max_depth_m=7 --resume"));
  EXPECT_EQ(other.status, 1);
  EXPECT_THAT(other.err, testing::HasSubstr("dsi.max_depth_m was 6.0, now 7.0"));
  EXPECT_EQ(stored("out.partial"), keyframes);
  // Without --resume the map begins anew. Stopped early, it keeps what was left.
  const Result anew = interrupted(
      map("out", ""),
      [&] { return contentOf("stderr.txt").find("left-result") != std::string::npos; }, SIGKILL);
  EXPECT_EQ(stored("out.left"), keyframes) << anew.err;
  EXPECT_THAT(anew.err, testing::HasSubstr("--out out --resume`, with the options of that run"));
  ASSERT_EQ(run(map("undisturbed", kThree)).status, 0);
  EXPECT_EQ(goOn(kThree + " --set performance.threads=1", resultIn("undisturbed")), keyframes);
  const auto made = fs::last_write_time(folder() / "out" / "report.json");
  const Result again = run(map("out", kThree + " --resume"));
  EXPECT_EQ(again.status, 0);
  EXPECT_THAT(again.err, testing::HasSubstr("is complete: nothing to do"));
  EXPECT_EQ(fs::last_write_time(folder() / "out" / "report.json"), made);
}

}  // namespace
}  // namespace efm
