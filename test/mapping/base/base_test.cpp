// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "mapping/base/atomic_file.h"
#include "mapping/base/named_choice.h"
#include "mapping/base/option.h"
#include "mapping/base/text.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using Names = std::vector<std::string>;
using testing::ElementsAre;
using testing::IsEmpty;

TEST(NearestName, IsTheNameWithTheFewestWrongLetters) {
  const Names keys = {"min_depth_m", "max_depth_m", "num_planes", "spacing", "width"};
  const Names rules = {"min", "harmonic", "geometric", "arithmetic", "rms", "max"};
  const Names commands = {"map", "depth", "info"};
  const struct {
    const char* typed;
    const Names& known;
    const char* nearest;  ///< "": none.
  } cases[] = {
      {"num_plane", keys, "num_planes"},    // a letter is missing
      {"num_pllanes", keys, "num_planes"},  // an added letter
      {"nun_planes", keys, "num_planes"},   // a wrong letter
      {"num_plnaes", keys, "num_planes"},   // two swapped letters
      {"Num-Planes", keys, "num_planes"},   // capitals and dashes do not count
      {"min_dept_m", keys, "min_depth_m"},  // max_depth_m has three more edits
      {"mix", rules, "min"},                // the first of two equally near names
      {"harmoic", rules, "harmonic"},       //
      {"mpa", commands, "map"},             // a swap is one edit: a third of three letters
      {"dxeth", commands, ""},              // no swap: only one of two letters matches
      {"dpxth", commands, ""},              //
      {"pam", commands, ""},                // two edits are two thirds of three letters
      {"nm_plns", keys, "num_planes"},      // three of ten letters: the limit
      {"planes", keys, ""},                 // four
      {"frobnicate", keys, ""},             //
      {"", commands, ""},                   //
      {"map", {}, ""},                      //
  };
  for (const auto& row : cases) {
    EXPECT_EQ(nearestName(row.typed, row.known).value_or(""), row.nearest) << row.typed;
  }
  EXPECT_FALSE(nearestName(std::string(100'000, 'x'), {std::string(90'000, 'x')})) << "no name";
}

TEST(NearestName, AnErrorAsksForTheNearNameAndListsTheOthersIfTheyAreFew) {
  EXPECT_EQ(expectedName("mxa", {"min", "max"}), "did you mean max? One of: min, max");
  EXPECT_EQ(expectedName("median", {"min", "max"}), "expected one of min, max");
  const Names nine = {"a1", "b22", "c333", "d4444", "e5555", "f6666", "g7777", "h8888", "i9999"};
  EXPECT_EQ(expectedName("c33", nine), "did you mean c333?");
  EXPECT_EQ(expectedName("xyz", nine),
            "expected one of a1, b22, c333, d4444, e5555, f6666, g7777, h8888, i9999");
}

TEST(QuotedText, PlainTextStaysAsItIs) {
  EXPECT_EQ(printable("1.5e-3 m"), "1.5e-3 m");
  EXPECT_EQ(inQuotes("1.5e-3 m"), "'1.5e-3 m'");
  EXPECT_EQ(inQuotes(""), "''");
}

TEST(QuotedText, ControlCharactersAreWrittenInHexadecimal) {
  EXPECT_EQ(inQuotes("a\x1b[2Jb\r\n\t\x7f"), R"('a\x1b[2Jb\x0d\x0a\x09\x7f')");
  EXPECT_EQ(inQuotes("\xc2\x9b"), R"('\xc2\x9b')") << "the control characters beyond ASCII";
  EXPECT_EQ(inQuotes(std::string_view("\0", 1)), R"('\x00')");
}

TEST(QuotedText, LongTextIsCutAfterFortyCharacters) {
  EXPECT_EQ(inQuotes(std::string(40, 'a')), "'" + std::string(40, 'a') + "'");
  EXPECT_EQ(inQuotes(std::string(41, 'a')), "'" + std::string(40, 'a') + "…'");
  EXPECT_LT(inQuotes(std::string(1 << 20, '\x1b')).size(), 200U);
}

TEST(ParseNumber, TakesATextFromEndToEndAlone) {
  EXPECT_EQ(parseNumber<int>("-12"), -12);
  EXPECT_EQ(parseNumber<double>("1.5e-3"), 1.5e-3);
  EXPECT_EQ(parseNumber<double>("inf"), std::numeric_limits<double>::infinity());
  for (const char* text : {"", " 1", "1 ", "+1", "1x", "0x1", "1,5", "-"}) {
    EXPECT_FALSE(parseNumber<int>(text)) << text;
    EXPECT_FALSE(parseNumber<double>(text)) << text;
  }
}

TEST(ParseNumber, RejectsValuesThatTheTypeCannotHold) {
  EXPECT_EQ(parseNumber<std::uint32_t>("4294967295"), 4'294'967'295U);
  EXPECT_FALSE(parseNumber<std::uint32_t>("4294967296"));
  EXPECT_FALSE(parseNumber<std::uint32_t>("-1"));
  EXPECT_FALSE(parseNumber<double>("1e999"));
}

TEST(ParseFinite, RejectsInfinityAndNan) {
  EXPECT_EQ(parseFinite("-2.5"), -2.5);
  for (const char* text : {"inf", "-inf", "nan", "1e999", ""}) EXPECT_FALSE(parseFinite(text));
}

TEST(SplitWords, GivesWhatBlanksSeparate) {
  EXPECT_THAT(splitWords("\t1  two\v3\f4 \r"), ElementsAre("1", "two", "3", "4"));
  EXPECT_THAT(splitWords("a\rb c", " "), ElementsAre("a\rb", "c"));
  EXPECT_THAT(splitWords(" \t\r"), IsEmpty());
}

TEST(Trimmed, HasNoBlankAtEitherEnd) {
  EXPECT_EQ(trimmed(" \t a b\r\n"), "a b");
  EXPECT_EQ(trimmed(" \r\n"), "");
}

TEST(WithoutByteOrderMark, ATextLosesTheMarkAtItsBeginningAlone) {
  EXPECT_EQ(withoutByteOrderMark("\xEF\xBB\xBFkey"), "key");
  EXPECT_EQ(withoutByteOrderMark("key\xEF\xBB\xBF"), "key\xEF\xBB\xBF");
  EXPECT_EQ(withoutByteOrderMark("\xEF\xBB"), "\xEF\xBB");
}

TEST(NamedChoice, GoesBothWaysAndRejectsOthers) {
  constexpr NamedChoice<int> kChoices[] = {{3, "three"}, {5, "five"}};
  for (const auto& choice : kChoices) {
    EXPECT_EQ(nameIn(kChoices, choice.value), choice.name);
    EXPECT_EQ(valueIn(kChoices, choice.name), choice.value);
  }
  EXPECT_THROW(nameIn(kChoices, 4), std::logic_error);
  EXPECT_THAT([&] { valueIn(kChoices, "fife"); },
              testing::ThrowsMessage<std::invalid_argument>(
                  "'fife' is unknown: did you mean five? One of: three, five"));
}

TEST(RequireOption, WritesNumbersAsTheyWereTyped) {
  EXPECT_NO_THROW(requireOption(true, "key", 0.1, "more"));
  EXPECT_THAT([] { requireOption(false, "key", 0.1, "more"); },
              testing::ThrowsMessage<std::invalid_argument>("key = 0.1: must be more"));
}

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
    AtomicFile first(folder / (name + ".txt"));  // the next file has the same temporary name
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
  fs::create_symlink("real/a.txt", folder / "relative.txt");  // the target does not exist yet
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
  // A chain of 40 links (the limit of Linux) and a chain of 41 links.
  for (int i = 0; i <= 40; ++i) {
    fs::create_symlink(std::to_string(i), folder / std::to_string(i + 1));
  }
  EXPECT_EQ(errorOf(folder / "40"), "no error");
  EXPECT_THAT(errorOf(folder / "41"), HasSubstr("too many symbolic links"));
}

}  // namespace

}  // namespace efm
