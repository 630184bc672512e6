// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/timestamp.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>
#include <stdexcept>

namespace efm::timestamp_test {
namespace {

using ::testing::Eq;
using ::testing::Optional;

TEST(Timestamp, SecondsAreParsedToTheNanosecond) {
  EXPECT_THAT(parseSeconds("1700000000.123456789"), Optional(Eq(1'700'000'000'123'456'789)));
  EXPECT_THAT(parseSeconds("0.003811000"), Optional(Eq(3'811'000)));
  EXPECT_THAT(parseSeconds("12"), Optional(Eq(12'000'000'000)));
  EXPECT_THAT(parseSeconds("-0.5"), Optional(Eq(-500'000'000)));
  EXPECT_THAT(parseSeconds("+.25"), Optional(Eq(250'000'000)));
  EXPECT_THAT(parseSeconds("7."), Optional(Eq(7'000'000'000)));
}

TEST(Timestamp, ExponentsMoveThePoint) {
  EXPECT_THAT(parseSeconds("1.5e-3"), Optional(Eq(1'500'000)));
  EXPECT_THAT(parseSeconds("1.470419093562843323e+09"), Optional(Eq(1'470'419'093'562'843'323)));
  EXPECT_THAT(parseSeconds("1e-12"), Optional(Eq(0)));
  EXPECT_THAT(parseSeconds("0e900"), Optional(Eq(0)));
}

TEST(Timestamp, DigitsBelowANanosecondAreRounded) {
  EXPECT_THAT(parseSeconds("0.0000000014"), Optional(Eq(1)));
  EXPECT_THAT(parseSeconds("0.0000000015"), Optional(Eq(2)));
  EXPECT_THAT(parseSeconds("0.9999999999"), Optional(Eq(1'000'000'000)));
}

TEST(Timestamp, TextThatIsNotANumberIsRefused) {
  for (const char* text : {"", "-", ".", "abc", "1,5", "0x10", "1.5s", "1 ", " 1", "1e", "nan",
                           "inf", "1.2.3", "--1", "1e99999", "1e+-5", "1e-+5", "1e-2147483648"}) {
    EXPECT_EQ(parseSeconds(text), std::nullopt) << "'" << text << "'";
  }
}

TEST(Timestamp, NumbersThatDoNotFitAreRefused) {
  EXPECT_THAT(parseSeconds("9223372036.854775807"),
              Optional(Eq(std::numeric_limits<std::int64_t>::max())));
  EXPECT_EQ(parseSeconds("9223372036.854775808"), std::nullopt);
  EXPECT_EQ(parseSeconds("9223372036.8547758075"), std::nullopt);
  EXPECT_EQ(parseSeconds("1e18"), std::nullopt);
}

TEST(Timestamp, FormattingHasNineDecimals) {
  EXPECT_EQ(formatSeconds(1'700'000'000'123'456'789), "1700000000.123456789");
  EXPECT_EQ(formatSeconds(-1), "-0.000000001");
  EXPECT_EQ(formatSeconds(0), "0.000000000");
}

RC_GTEST_PROP(Timestamp, ParsingUndoesFormatting, (std::int64_t t_ns)) {
  RC_PRE(t_ns != std::numeric_limits<std::int64_t>::min());
  RC_ASSERT(parseSeconds(formatSeconds(t_ns)) == t_ns);
}

TEST(Timestamp, DurationsMustFit) {
  EXPECT_EQ(durationFromSeconds(0.1), 100'000'000);
  EXPECT_THROW(durationFromSeconds(1e10), std::invalid_argument);
  EXPECT_THROW(durationFromSeconds(std::numeric_limits<double>::quiet_NaN()),
               std::invalid_argument);
}

}  // namespace
}  // namespace efm::timestamp_test
