// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/base/atomic_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class AtomicFileTest : public TemporaryFolder {
 protected:
  static void writeText(const fs::path& path, const std::string& text) {
    writeAtomically(path, [&](const fs::path& temporary) { std::ofstream(temporary) << text; });
  }
  static std::string errorOf(const fs::path& path) {
    return messageOf([&] { writeText(path, "text"); });
  }

  std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder))
      names.push_back(entry.path().filename());
    std::sort(names.begin(), names.end());
    return names;
  }

  const fs::path folder = TemporaryFolder::folder();
};

TEST_F(AtomicFileTest, TheOneBeforeStandsUntilTheNewOneIsWhole) {
  writeText(folder / "a.txt", "one");
  writeAtomically(folder / "a.txt", [&](const fs::path& temporary) {
    std::ofstream(temporary) << "tw";
    EXPECT_EQ(readText(folder / "a.txt"), "one");
    std::ofstream(temporary) << "two";
  });
  EXPECT_EQ(readText(folder / "a.txt"), "two");
  const auto fail_half_way = [](const fs::path& temporary) {
    std::ofstream(temporary) << "th";
    throw std::runtime_error("the pen is empty");
  };
  EXPECT_THAT(messageOf([&] { writeAtomically(folder / "a.txt", fail_half_way); }),
              HasSubstr("a.txt: the pen is empty"));
  EXPECT_EQ(readText(folder / "a.txt"), "two");
  EXPECT_THAT(names(), testing::ElementsAre("a.txt"));
}

TEST_F(AtomicFileTest, AFullDiskIsNamed) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  const auto write_to_full = [](const fs::path&) {
    std::ofstream full("/dev/full");
    full << "text" << std::flush;
    if (!full) throw std::runtime_error("it cannot be written");
  };
  EXPECT_EQ(messageOf([&] { writeAtomically(folder / "a.txt", write_to_full); }),
            "cannot write " + (folder / "a.txt").string() + ": the disk is full");
  EXPECT_TRUE(fs::is_empty(folder));
  EXPECT_THAT(reasonNotWritten(EDQUOT), HasSubstr("quota"));
  EXPECT_THAT(reasonNotWritten(EFBIG), HasSubstr("ulimit -f"));
  EXPECT_EQ(reasonNotWritten(EACCES), "");
}

TEST_F(AtomicFileTest, FilesOfOthersStay) {
  const std::string own = std::to_string(getpid());
  std::vector<std::string> others = {"a.partial-" + own + ".txt", "a.partial-" + own + "-1.txt",
                                     "a.partial.txt"};
  for (const std::string& name : others) std::ofstream(folder / name) << name;
  AtomicFile first(folder / "a.txt");
  EXPECT_EQ(first.temporary(), folder / ("a.partial-" + own + "-2.txt"));
  {
    AtomicFile second(folder / "a.txt");
    EXPECT_EQ(second.temporary(), folder / ("a.partial-" + own + "-3.txt"));
    std::ofstream(second.temporary()) << "second";
    std::ofstream(first.temporary()) << "first";
    second.replace();
    EXPECT_EQ(readText(folder / "a.txt"), "second");
    std::ofstream(folder / ("a.partial-" + own + "-3.txt")) << "of another process, by now";
  }
  first.replace();
  EXPECT_EQ(readText(folder / "a.txt"), "first");
  for (const std::string& name : others) EXPECT_EQ(readText(folder / name), name);
  others.insert(others.end(), {"a.partial-" + own + "-3.txt", "a.txt"});
  EXPECT_THAT(names(), testing::UnorderedElementsAreArray(others));
}

TEST_F(AtomicFileTest, TheLongestNamesThatTheSystemTakesAreWritten) {
  for (const std::size_t length : {234U, 255U}) {
    const std::string name(length - 4, 'n');
    AtomicFile first(folder / (name + ".txt"));  // its temporary name is that of the next, cut
    writeAtomically(folder / (name + ".txt"), [](const auto& file) { std::ofstream(file) << "x"; });
    EXPECT_EQ(readText(folder / (name + ".txt")), "x");
    NewFolder made(folder / std::string(length, 'f'));
    made.finish();
    EXPECT_TRUE(fs::is_directory(folder / std::string(length, 'f')));
  }
  EXPECT_THROW(AtomicFile(folder / std::string(256, 'n')), std::runtime_error);
}

TEST_F(AtomicFileTest, ANewFolderLeavesThoseOfOthers) {
  const std::string unfinished = ".new.unfinished-" + std::to_string(getpid());
  fs::create_directory(folder / unfinished);
  std::ofstream(folder / unfinished / "precious.txt") << "x";
  {
    const NewFolder failing(folder / "new");
    EXPECT_EQ(failing.temporary(), folder / (unfinished + "-1"));
    NewFolder made(folder / "new/");
    EXPECT_EQ(made.temporary(), folder / (unfinished + "-2"));
    std::ofstream(made.temporary() / "a.txt") << "text";
    made.finish();
  }
  EXPECT_THAT(names(), testing::ElementsAre(unfinished, "new"));
  EXPECT_EQ(readText(folder / "new" / "a.txt"), "text");
  EXPECT_EQ(fs::status(folder / "new").permissions(),
            fs::status(folder / unfinished).permissions());
  EXPECT_EQ(readText(folder / unfinished / "precious.txt"), "x");
}

TEST_F(AtomicFileTest, AnErrorNamesTheFolderThatCannotBeMade) {
  fs::create_directories(folder / "desk");
  std::ofstream(folder / "desk/precious.txt") << "x";
  std::ofstream(folder / "file") << "x";
  const std::pair<fs::path, std::string> rows[] = {
      {folder / "desk", (folder / "desk").string()},
      {folder / "file/desk", (folder / "file").string()},
      {"", "'': expected the name of the folder"}};
  for (const auto& [path, expected] : rows) {
    EXPECT_THAT(messageOf([&, &wrong = path] { const NewFolder made(wrong); }),
                HasSubstr(expected));
  }
  EXPECT_THAT(names(), testing::ElementsAre("desk", "file"));
}

TEST_F(AtomicFileTest, FoldersAndDevicesAreNotReplaced) {
  EXPECT_THAT(errorOf(""), HasSubstr("'': expected the name of a file"));
  EXPECT_THAT(errorOf(folder), HasSubstr("'" + folder.string() + "': it is a folder"));
  EXPECT_THAT(errorOf(folder / "new/"), HasSubstr("it is a folder"));
  EXPECT_THAT(errorOf(folder / "no" / "a"), HasSubstr("no/a': No such file or directory"));
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  EXPECT_THAT(errorOf(folder / "pipe"), HasSubstr("not a regular file"));
  EXPECT_THAT(errorOf("/dev/null"), HasSubstr("not a regular file"));
}

TEST_F(AtomicFileTest, TheTargetOfALinkIsReplacedAndTheLinkStays) {
  fs::create_directory(folder / "real");
  fs::create_symlink("real/a.txt", folder / "relative.txt");  // nothing there yet
  fs::create_symlink(folder / "relative.txt", folder / "absolute.txt");
  writeText(folder / "absolute.txt", "text");
  EXPECT_EQ(readText(folder / "real" / "a.txt"), "text");
  EXPECT_TRUE(fs::is_symlink(folder / "relative.txt"));
  EXPECT_TRUE(fs::is_symlink(folder / "absolute.txt"));
}

TEST_F(AtomicFileTest, LinksThatLeadToAFolderOrInACircleAreErrors) {
  fs::create_symlink(folder, folder / "link");
  EXPECT_THAT(errorOf(folder / "link"), HasSubstr("it is a folder"));
  fs::create_symlink("b", folder / "a");
  fs::create_symlink("a", folder / "b");
  EXPECT_THAT(errorOf(folder / "a"), HasSubstr("too many symbolic links"));
  // A chain of 40 links, as Linux has it, and of one more.
  for (int i = 0; i <= 40; ++i) {
    fs::create_symlink(std::to_string(i), folder / std::to_string(i + 1));
  }
  EXPECT_EQ(errorOf(folder / "40"), "no error");
  EXPECT_THAT(errorOf(folder / "41"), HasSubstr("too many symbolic links"));
}

}  // namespace
}  // namespace efm
