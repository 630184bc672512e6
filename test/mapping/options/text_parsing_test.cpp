// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/options/text_parsing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>

namespace efm::text_parsing_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

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

}  // namespace
}  // namespace efm::text_parsing_test
