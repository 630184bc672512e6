// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/session_status.h"

#include <gtest/gtest.h>

namespace efm {
namespace {

TEST(TimeText, IsExactAndSaysTheDistanceFromTheStart) {
  constexpr std::int64_t kStartNs = 1'468'939'799'145'678'901;
  const std::pair<std::int64_t, const char*> cases[] = {
      {3'200'000'000, "1468939802.345678901 s (+3.2 s)"},
      {3'200'400'000, "1468939802.346078901 s (+3.2 s)"},
      {3'201'000'000, "1468939802.346678901 s (+3.201 s)"},
      {12'345'678'000'000, "1468952144.823678901 s (+12345.678 s)"},
      {0, "1468939799.145678901 s (+0 s)"},
      {-100'000, "1468939799.145578901 s (+0 s)"},
      {-1'500'000'000, "1468939797.645678901 s (-1.5 s)"}};
  for (const auto& [offset_ns, text] : cases) {
    EXPECT_EQ(timeText(kStartNs + offset_ns, kStartNs), text);
  }
  EXPECT_EQ(timeText(kStartNs, std::nullopt), "1468939799.145678901 s");
  EXPECT_EQ(timeText(10'100'000'000, 10'300'000'000, 10'000'000'000),
            "10.100000000 to 10.300000000 s (+0.1 to +0.3 s)");
  EXPECT_EQ(timeText(-500'000'000, 10'300'000'000, std::nullopt), "-0.500000000 to 10.300000000 s");
}

TEST(TimeText, DurationsAreSecondsMinutesOrHours) {
  const std::pair<double, const char*> cases[] = {
      {0, "0 s"},         {-1, "0 s"},       {59.4, "59 s"},
      {59.6, "1:00 min"}, {185, "3:05 min"}, {3599, "59:59 min"},
      {3600, "01:00 h"},  {4980, "01:23 h"}, {360'000, "100:00 h"}};
  for (const auto& [seconds, text] : cases) EXPECT_EQ(durationText(seconds), text);
}

}  // namespace
}  // namespace efm
