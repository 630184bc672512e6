// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>

#include "mapping/base/named_choice.h"
#include "mapping/base/text.h"

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
      {"num_pllanes", keys, "num_planes"},  // one too many
      {"nun_planes", keys, "num_planes"},   // another one
      {"num_plnaes", keys, "num_planes"},   // two swapped
      {"Num-Planes", keys, "num_planes"},   // capitals and dashes do not count
      {"min_dept_m", keys, "min_depth_m"},  // not max_depth_m, which has three more
      {"mix", rules, "min"},                // the first of two at the same distance
      {"harmoic", rules, "harmonic"},       //
      {"mpa", commands, "map"},             // a swap is one edit: a third of three letters
      {"dxeth", commands, ""},              // no swap: only one of two letters is the other's
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

TEST(ParseNumber, RefusesValuesThatTheTypeCannotHold) {
  EXPECT_EQ(parseNumber<std::uint32_t>("4294967295"), 4'294'967'295U);
  EXPECT_FALSE(parseNumber<std::uint32_t>("4294967296"));
  EXPECT_FALSE(parseNumber<std::uint32_t>("-1"));
  EXPECT_FALSE(parseNumber<double>("1e999"));
}

TEST(ParseFinite, RefusesInfinityAndNan) {
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

TEST(NamedChoice, GoesBothWaysAndRefusesOthers) {
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

}  // namespace
}  // namespace efm
