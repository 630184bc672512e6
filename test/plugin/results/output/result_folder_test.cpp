// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/output/result_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "test/plugin/temporary_folder.h"

namespace {

/// The process is killed before this change of names (1: the first one); 0: never.
int g_kill_before = 0;
/// The error of an exchange of two names; 0: none.
int g_exchange_error = 0;

void countChange() {
  if (g_kill_before > 0 && --g_kill_before == 0) kill(getpid(), SIGKILL);
}

int resultOf(long result) { return static_cast<int>(result); }

}  // namespace

// The changes of names of this program. They replace those of the C library.
extern "C" {
int rename(const char* from, const char* to) noexcept {
  countChange();
  return resultOf(syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0));
}
int renameat2(int, const char* from, int, const char* to, unsigned int flags) noexcept {
  countChange();
  if (g_exchange_error != 0) {
    errno = g_exchange_error;
    return -1;
  }
  return resultOf(syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, flags));
}
/// The tests kill processes, not the machine: they need not wait for the disk.
int fsync(int) { return 0; }
int unlink(const char* path) noexcept {
  countChange();
  return resultOf(syscall(SYS_unlinkat, AT_FDCWD, path, 0));
}
int rmdir(const char* path) noexcept {
  countChange();
  return resultOf(syscall(SYS_unlinkat, AT_FDCWD, path, AT_REMOVEDIR));
}
}

namespace efm {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// The contents of all files below a folder, by their paths.
using Files = std::map<std::string, std::string>;

Files filesBelow(const fs::path& folder) {
  Files files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    files[fs::relative(entry.path(), folder).string()] = readText(entry.path());
  }
  return files;
}

/// The result of a run, which all its files tell.
Files resultOf(const std::string& run, int keyframes = 2) {
  Files files;
  for (const char* name : {"map.pcd", "map.html", "trajectory.txt"}) files[name] = run;
  for (int i = 0; i < keyframes; ++i) {
    for (const char* name : {"depth.tiff", "depth.png", "cam0/depth.tiff"}) {
      files[fmt::format("keyframes/{}{}.000000000/{}", run.size(), i, name)] = run;
    }
  }
  files["report.json"] =
      fmt::format(R"({{"version": "1", "options": {{}}, "keyframes": {}, "recording": ["{}"]}})",
                  keyframes, run);
  return files;
}

void write(const fs::path& folder, const Files& files) {
  for (const auto& [name, content] : files) writeFile(folder / name, content);
}

const Files kFilesOfOthers = {{"notes.txt", "mine"}, {"keyframes/readme.txt", "mine"}};

Files together(Files files, const Files& others) {
  files.insert(others.begin(), others.end());
  return files;
}

class ResultFolderTest : public TemporaryFolder {
 protected:
  /// Writes the result of a run to OUT.
  void run(const fs::path& out, const std::string& name) {
    ResultFolder folder(out, OutputKind::kMap);
    write(folder.path(), resultOf(name));
    folder.commit();
  }
  /// Runs in a process of its own. @return false if the process was killed.
  static bool runApart(const std::function<void()>& work) {
    const pid_t child = fork();
    if (child == 0) {
      work();
      _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status) || WEXITSTATUS(status) == 0);
    return !WIFSIGNALED(status);
  }
};

/// What OUT is before the run.
enum class Before { kNothing, kEmpty, kResult, kOthers, kResultAndOthers, kLink };

class EachBefore : public ResultFolderTest, public testing::WithParamInterface<Before> {
 protected:
  /// Makes the folder as it is before. @return its files.
  Files make() {
    fs::remove_all(folder() / "a");
    fs::create_directories(folder() / "a");
    const fs::path target = GetParam() == Before::kLink ? folder() / "a" / "target" : out();
    if (GetParam() == Before::kNothing) return {};
    fs::create_directories(target);
    if (GetParam() == Before::kLink) fs::create_directory_symlink("target", out());
    Files files;
    if (GetParam() == Before::kOthers || GetParam() == Before::kResultAndOthers)
      files = kFilesOfOthers;
    if (GetParam() != Before::kEmpty && GetParam() != Before::kOthers) {
      files = together(resultOf("old", 3), files);
    }
    write(target, files);
    return files;
  }
  bool hasOthers() const {
    return GetParam() == Before::kOthers || GetParam() == Before::kResultAndOthers;
  }
  fs::path out() const { return folder() / "a" / "out"; }
  /// The new result, beside the files of others.
  Files made() const {
    return together(resultOf("the new run"), hasOthers() ? kFilesOfOthers : Files());
  }
};

INSTANTIATE_TEST_SUITE_P(All, EachBefore,
                         testing::Values(Before::kNothing, Before::kEmpty, Before::kResult,
                                         Before::kOthers, Before::kResultAndOthers, Before::kLink));

TEST_P(EachBefore, TheResultIsThereAtTheEndAndNothingElse) {
  const Files before = make();
  {
    ResultFolder folder(out(), OutputKind::kMap);
    EXPECT_EQ(folder.hasEarlier(), before.count("report.json") > 0);
    write(folder.path(), resultOf("the new run"));
    if (hasOthers()) {
      EXPECT_EQ(folder.path(), fs::canonical(out()) / "result.partial");
    } else {
      EXPECT_EQ(folder.path().filename(),
                GetParam() == Before::kLink ? "target.partial" : "out.partial");
    }
    folder.commit();
  }
  EXPECT_EQ(filesBelow(out()), made());
  EXPECT_EQ(fs::is_symlink(out()), GetParam() == Before::kLink);
  const auto entries = fs::directory_iterator(folder() / "a");
  EXPECT_EQ(std::distance(begin(entries), end(entries)), GetParam() == Before::kLink ? 2 : 1);
}

TEST_P(EachBefore, WithoutACommitAllIsAsBefore) {
  const Files before = make();
  { ResultFolder(out(), OutputKind::kMap).path(); }
  { write(ResultFolder(out(), OutputKind::kMap).path(), resultOf("the new run")); }
  EXPECT_EQ(filesBelow(folder() / "a").size(), before.size());
  ResultFolder folder(out(), OutputKind::kMap);
  EXPECT_EQ(folder.abandon().find("stays") != std::string::npos, before.count("report.json") > 0);
}

/// Kills a run before each change of a name. After the next command has looked at the folder, the
/// earlier result or the new one is whole, and the files of others are there.
TEST_P(EachBefore, AKilledRunLeavesOneOfBothResultsWhole) {
  // The file system cannot exchange names; the folder cannot be renamed.
  for (const int exchange_error : {0, EINVAL, EBUSY}) {
    bool ended = false;
    int new_ones = 0;
    for (int moment = 1; !ended; ++moment) {
      SCOPED_TRACE(fmt::format("error {}, moment {}", exchange_error, moment));
      const Files before = make();
      ended = runApart([&] {
        g_exchange_error = exchange_error;
        ResultFolder folder(out(), OutputKind::kMap);
        write(folder.path(), resultOf("the new run"));
        g_kill_before = moment;
        folder.commit();
      });
      ResultFolder::require(out(), OutputKind::kMap, true);
      Files after;
      for (const auto& [name, content] : fs::exists(out()) ? filesBelow(out()) : Files()) {
        if (name.find("result.") != 0 && name != "run.lock") after[name] = content;
      }
      EXPECT_TRUE(after == before || after == made());
      new_ones += after == made() ? 1 : 0;
      if (exchange_error == EBUSY) run(out(), "a run that may be in place");
      run(out(), "a third run");
      EXPECT_EQ(filesBelow(out()),
                together(resultOf("a third run"), hasOthers() ? kFilesOfOthers : Files()));
      const auto entries = fs::directory_iterator(folder() / "a");
      EXPECT_EQ(std::distance(begin(entries), end(entries)), GetParam() == Before::kLink ? 2 : 1);
      if (HasFailure()) return;
    }
    EXPECT_GT(new_ones, 0);
  }
}

TEST_F(ResultFolderTest, FilesOfTheOtherKindStayIfNoResultWasThere) {
  const fs::path out = folder() / "out";
  const Files of_depth = {
      {"points.pcd", "mine"}, {"depth.png", "mine"}, {"cam0/depth.png", "mine"}};
  write(out, of_depth);
  for (const int moment : {4, 0}) {
    runApart([&] {
      ResultFolder result(out, OutputKind::kMap);
      write(result.path(), resultOf("new"));
      g_kill_before = moment;
      result.commit();
    });
    ResultFolder::require(out, OutputKind::kDepth, true);
    const Files after = filesBelow(out);
    for (const auto& [name, content] : of_depth) EXPECT_EQ(after.count(name), 1U) << name;
  }
  EXPECT_EQ(filesBelow(out), together(resultOf("new"), of_depth));
}

TEST_F(ResultFolderTest, FilesThatCameMeanwhileStay) {
  const fs::path out = folder() / "out";
  run(out, "old");
  {
    ResultFolder result(out, OutputKind::kMap);
    write(result.path(), resultOf("new"));
    write(out, kFilesOfOthers);
    result.commit();
  }
  EXPECT_EQ(filesBelow(out), together(resultOf("new"), kFilesOfOthers));
  EXPECT_EQ(filesBelow(folder()).size(), filesBelow(out).size());
}

TEST_F(ResultFolderTest, TheWorkingFolderIsNotRenamed) {
  const fs::path before = fs::current_path();
  fs::create_directories(folder() / "b");
  write(folder() / "b", resultOf("old"));
  fs::current_path(folder() / "b");
  for (const char* out : {".", "../b/", ""}) {
    const fs::path path = *out == '\0' ? folder() : fs::path(out);  // also the folder above it
    ResultFolder result(path, OutputKind::kMap);
    EXPECT_EQ(result.path().filename(), "result.partial") << out;
  }
  run(".", "new");
  EXPECT_EQ(filesBelow("."), resultOf("new"));
  fs::current_path(before);
}

TEST_F(ResultFolderTest, OneRunAtATimeWritesAFolderAndTheFilesOfAKilledOneAreKept) {
  const fs::path out = folder() / "out";
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t other = fork();
  if (other == 0) {
    ResultFolder result(out, OutputKind::kMap);
    write(result.path(), resultOf("killed"));
    static_cast<void>(::write(ready[1], "x", 1));
    pause();
    _exit(1);
  }
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  const std::string at_work = out.string() + ": process " + std::to_string(other) + " on ";
  const auto require = [&] { ResultFolder::require(out, OutputKind::kMap, true); };
  EXPECT_THAT(messageOf(require), HasSubstr(at_work));
  EXPECT_THAT(messageOf([&] { ResultFolder result(out, OutputKind::kMap); }), HasSubstr(at_work));
  EXPECT_TRUE(ResultFolder::hasPartial(out));
  kill(other, SIGKILL);
  waitpid(other, nullptr, 0);

  require();
  const fs::path left = folder() / "out.left";
  int next = 0;
  for (const std::uint64_t keyframes : {2U, 2U, 3U}) {
    ResultFolder result(out, OutputKind::kMap);
    EXPECT_EQ(result.left(), left);
    EXPECT_EQ(countKeyframes(left), keyframes) << "of the killed run that made the most";
    write(result.path(), {{"keyframes/7.000000000/depth.tiff", ""}});
    if (next++ > 0) write(result.path(), resultOf("third"));
    result.abandon();
    for (const fs::path& same : {out, result.path()}) {
      EXPECT_THAT(messageOf([&] { ResultFolder second(same, OutputKind::kMap); }),
                  HasSubstr(" is writing its result there"));
    }
  }
  EXPECT_TRUE(fs::exists(left)) << "that run made no result";
  EXPECT_FALSE(fs::exists(out));
  {
    ResultFolder stopped(out, OutputKind::kMap);
    write(stopped.path(), resultOf("stopped"));
    stopped.commit(false);
  }
  EXPECT_TRUE(fs::exists(left)) << "that run was stopped";
  run(out, "new");
  EXPECT_FALSE(fs::exists(left));
  EXPECT_EQ(filesBelow(folder()).size(), resultOf("new").size());
}

TEST_F(ResultFolderTest, FoldersThatNoRunHasMadeAreNotTouched) {
  const fs::path out = folder() / "out";
  for (const char* name : {"out.partial", "out.left", "out.earlier"}) {
    const fs::path path = folder() / name;
    const std::vector<std::function<void()>> foreign = {
        [&] { write(path, resultOf("a user's own")); }, [&] { std::ofstream(path) << "mine"; },
        [&] { fs::create_symlink("elsewhere", path); }};
    for (const auto& make : foreign) {
      make();
      const auto before = fs::symlink_status(path).type();
      for (const auto& call : std::vector<std::function<void()>>{
               [&] { ResultFolder::require(out, OutputKind::kMap, true); },
               [&] { ResultFolder result(out, OutputKind::kMap); }}) {
        EXPECT_THAT(messageOf(call), HasSubstr(path.string() + ": a run for ")) << name;
      }
      EXPECT_EQ(fs::symlink_status(path).type(), before);
      EXPECT_FALSE(fs::exists(out));
      if (fs::is_directory(path)) {
        EXPECT_EQ(filesBelow(path), resultOf("a user's own"));
      }
      fs::remove_all(path);
    }
  }
}

TEST_F(ResultFolderTest, OfAFailedRunTheKeyframesStayIfThereIsNoEarlierResult) {
  const fs::path out = folder() / "out";
  const Files keyframe = {{"keyframes/1.000000000/depth.tiff", ""}};
  {
    ResultFolder result(out, OutputKind::kMap);
    EXPECT_EQ(result.abandon(), "") << "nothing was written";
  }
  EXPECT_TRUE(fs::is_empty(folder()));
  {
    ResultFolder result(out, OutputKind::kMap);
    write(result.path(), keyframe);
    EXPECT_EQ(result.abandon(),
              "; the keyframes before it (1) are in " + out.string() + ".partial");
  }
  EXPECT_TRUE(fs::exists(folder() / "out.partial" / "keyframes"));
  run(out, "old");
  {
    ResultFolder result(out, OutputKind::kMap);
    write(result.path(), keyframe);
    EXPECT_EQ(result.abandon(), "; the earlier result in " + out.string() + " stays");
  }
  EXPECT_FALSE(fs::exists(folder() / "out.partial")) << "the disk may be full";
  {
    ResultFolder result(out, OutputKind::kMap);
    write(result.path(), keyframe);
    write(result.path(), {{"session.mcap", ""}});
    EXPECT_EQ(result.abandon(), "; the earlier result in " + out.string() +
                                    " stays; the keyframes before it (1) are in " + out.string() +
                                    ".partial: run again with --resume to go on with them");
  }
  EXPECT_EQ(filesBelow(folder() / "out.partial").count("keyframes/1.000000000/depth.tiff"), 1U);
  EXPECT_EQ(filesBelow(out), resultOf("old"));
}

TEST_F(ResultFolderTest, TheLockOfAnotherHostCountsForAMinute) {
  const fs::path out = folder() / "out";
  const fs::path lock = folder() / "out.partial" / "run.lock";
  const auto require = [&] {
    return messageOf([&] { ResultFolder::require(out, OutputKind::kMap, false); });
  };
  const auto touched = [&](int seconds_ago) {
    fs::last_write_time(lock, fs::file_time_type::clock::now() - std::chrono::seconds(seconds_ago));
  };
  writeFile(lock, "map 4711 another-host\n");
  EXPECT_THAT(require(),
              HasSubstr("out: process 4711 on another-host is writing its result there (" +
                        lock.string() + ")"));
  touched(50);
  EXPECT_THAT(require(), HasSubstr("process 4711 on another-host"));
  touched(70);
  EXPECT_EQ(require(), "no error");
  std::array<char, 256> host{};
  gethostname(host.data(), host.size() - 1);
  writeFile(lock, "map 4711 " + std::string(host.data()) + "\n");
  EXPECT_EQ(require(), "no error") << "without its lock it has ended";
  { const ResultFolder result(out, OutputKind::kMap); }
  EXPECT_TRUE(fs::is_empty(folder()));
}

TEST_F(ResultFolderTest, ARunGoesOnWithTheFilesOfAnEarlierOne) {
  const fs::path out = folder() / "out";
  Files stored = resultOf("earlier");
  stored["session.mcap"] = "the session";
  constexpr std::uint64_t kStored = 2;
  const auto inPartial = [&](const fs::path& from) {
    const ResultFolder result(out, OutputKind::kMap, from);
    EXPECT_EQ(readText(result.path() / "session.mcap"), "the session") << from;
    EXPECT_EQ(countKeyframes(result.path()), kStored) << from;
  };
  const std::vector<fs::path> places = ResultFolder::storedIn(out);
  EXPECT_EQ(places,
            (std::vector<fs::path>{out, out.string() + ".partial", out.string() + ".left"}));
  const fs::path& partial = places[1];
  for (const fs::path& place : {partial, places[2], out}) {
    write(place, stored);
    if (place != out) writeFile(place / "run.lock", "map");
    inPartial(place);
    EXPECT_EQ(countKeyframes(partial), kStored) << "a run that ends early keeps them";
    EXPECT_TRUE(fs::exists(partial / "session.mcap"));
    EXPECT_FALSE(fs::exists(places[2]));
    if (place == out) {
      EXPECT_EQ(filesBelow(out), stored) << "the result stays";
    }
    fs::remove_all(partial);
  }
}

TEST_F(ResultFolderTest, FoldersThatAreNotForAResultAreNamed) {
  const fs::path out = folder() / "out";
  const auto message = [&](OutputKind kind, bool force = false) {
    return messageOf([&] { ResultFolder::require(out, kind, force); });
  };
  const std::string kNone = "no error";
  EXPECT_EQ(message(OutputKind::kMap), kNone);
  fs::create_directory(out);
  EXPECT_EQ(message(OutputKind::kMap), kNone);
  write(out, {{"notes.txt", ""}});
  EXPECT_THAT(message(OutputKind::kMap), HasSubstr(out.string() + ": holds other files than"));
  EXPECT_EQ(message(OutputKind::kMap, true), kNone);
  for (const char* foreign : {"", "{}", "[1]", R"({"version": "1", "options": {}})", "text"}) {
    write(out, {{"report.json", foreign}});
    EXPECT_FALSE(ResultFolder::earlierResult(out)) << foreign;
    EXPECT_THAT(message(OutputKind::kMap), HasSubstr(": holds other files than")) << foreign;
  }
  write(out, resultOf("old", 3));
  const auto result = ResultFolder::earlierResult(out);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->keyframes, 3U);
  EXPECT_TRUE(result->isOf({"old"}));
  EXPECT_FALSE(result->isOf({"old", "older"}));
  EXPECT_EQ(message(OutputKind::kMap), kNone) << "the files of others stay";
  EXPECT_THAT(message(OutputKind::kDepth), HasSubstr("holds the result of `map`"));
  EXPECT_EQ(message(OutputKind::kDepth, true), kNone);
  fs::remove_all(out);
  std::ofstream(out) << "a file";
  EXPECT_THAT(message(OutputKind::kMap), HasSubstr(out.string() + ": a file of that name"));
  fs::remove(out);
  fs::create_symlink("nowhere", out);
  EXPECT_THAT(message(OutputKind::kMap), HasSubstr("a link to a folder that does not exist"));
  EXPECT_THAT(messageOf([&] { ResultFolder("", OutputKind::kMap); }),
              HasSubstr("'': expected the name of the folder"));
}

}  // namespace
}  // namespace efm
