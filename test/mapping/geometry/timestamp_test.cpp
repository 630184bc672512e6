// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/timestamp.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <stdexcept>

namespace efm::timestamp_test {
namespace {

TEST(Timestamp, DecimalTextIsReadToTheNanosecond) {
  const struct {
    const char* text;
    std::int64_t t_ns;
    int exponent = 0;  // of the unit
  } cases[] = {
      {"1700000000.123456789", 1'700'000'000'123'456'789},
      {"0.003811000", 3'811'000},
      {"12", 12'000'000'000},
      {"-0.5", -500'000'000},
      {"+.25", 250'000'000},
      {"7.", 7'000'000'000},
      {"1.5e-3", 1'500'000},
      {"2E1", 20'000'000'000},
      {"1.470419093562843323e+09", 1'470'419'093'562'843'323},
      {"1e-1000", 0},
      {"0e1000", 0},
      {"0.0000000014", 1},
      {"0.0000000015", 2},
      {"-0.0000000015", -2},
      {"0.9999999999", 1'000'000'000},
      {"5e-10", 1},
      {"4e-10", 0},
      {"9e-11", 0},
      {"9223372036.854775807", kMaxTimeNs},
      {"-9223372036.854775807", -kMaxTimeNs},
      {"12.5", 12'500, -6},
      {"-12.5e3", -12'500'000, -6},
      {"7.5", 8, -9},
  };
  for (const auto& c : cases) EXPECT_EQ(parseTimeIn(c.text, c.exponent), c.t_ns) << c.text;
  EXPECT_EQ(parseSeconds("12.5"), 12'500'000'000);
}

TEST(Timestamp, TextThatIsNoNumberOrDoesNotFitIsRefused) {
  for (const char* text : {"",
                           "-",
                           "+",
                           ".",
                           "abc",
                           "1,5",
                           "0x10",
                           "1.5s",
                           "1 ",
                           " 1",
                           "1e",
                           "nan",
                           "inf",
                           "1.2.3",
                           "--1",
                           "1e99999",
                           "0e1001",
                           "1e-1001",
                           "1e+-5",
                           "1e-+5",
                           "1e-2147483648",
                           "1e18",
                           "9223372036.854775808",
                           "9223372036.8547758075"}) {
    EXPECT_EQ(parseSeconds(text), std::nullopt) << "'" << text << "'";
  }
}

TEST(Timestamp, FormattingHasNineDecimals) {
  EXPECT_EQ(formatSeconds(1'700'000'000'123'456'789), "1700000000.123456789");
  EXPECT_EQ(formatSeconds(-1), "-0.000000001");
  EXPECT_EQ(formatSeconds(0), "0.000000000");
  EXPECT_EQ(formatSeconds(kMinTimeNs), "-9223372036.854775808");
}

RC_GTEST_PROP(Timestamp, ParsingUndoesFormatting, (std::int64_t t_ns)) {
  RC_PRE(t_ns != kMinTimeNs);
  RC_ASSERT(parseSeconds(formatSeconds(t_ns)) == t_ns);
}

TEST(Timestamp, DurationsAreRoundedAndMustFit) {
  EXPECT_EQ(durationFromSeconds(0.1), 100'000'000);
  EXPECT_EQ(durationFromSeconds(-1.5), -1'500'000'000);
  EXPECT_EQ(durationFromSeconds(0.6e-9), 1);
  EXPECT_EQ(durationFromSeconds(9.1e9), 9'100'000'000'000'000'000);
  for (const double wrong_s : {9.2e9, -9.2e9, 1e30, std::nan("")}) {
    EXPECT_THROW(durationFromSeconds(wrong_s), std::invalid_argument) << wrong_s;
  }
  EXPECT_EQ(secondsBetween(1'000'000'000, 3'500'000'000), 2.5);
}

}  // namespace
}  // namespace efm::timestamp_test
