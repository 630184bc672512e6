// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/streams/time_unit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "mapping/base/text.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::HasSubstr;

/// Times from `first` on; a negative step: they fall.
TimeSample sampleOf(int count, double first, double step) {
  TimeSample sample;
  for (int i = 0; i < count; ++i) sample.add(first + i * step);
  sample.add(NAN);  // is left out
  return sample;
}

TEST(TimeUnit, IsThatOfTheOptionOrOfTheValuesWhereTheyLeaveNoDoubt) {
  constexpr double kYear2000Us = 946'684'800e6;
  constexpr double kYear2050Us = 2'524'608'000e6;
  constexpr double kEndOfTimeUs = 4'611'686'018'427'388;
  const char* const none = ": expected decimal seconds, or --time-unit s, ms, us or ns";
  const struct {
    int count;
    double first;
    double step;
    int exponent;
    const char* error;  // null: none
    bool warned = false;
  } rows[] = {
      {0, 0, 0, 0, nullptr},
      {9, 5, 10, 0, nullptr},
      {10, 5, 10, 0,
       "in e: all times are whole numbers, of an unknown unit: probably us, where 10"},
      {2000, 25'000, -10, 0, "probably us, where 2000 events take 0.02 s: expected --time-unit us"},
      {2000, 5, 100, 0, "probably us"},  // of the usual units the one in the middle
      {2000, 5, 10'000, 0, "probably ns"},
      {2000, 5, 1'000'000'000, 0, none},
      {20, 5, 0, 0, none},
      {2000, 1.7e15, 10, -6, nullptr, true},
      {2000, 1.7e12, 1, 0, "all times are whole numbers"},  // of our years, but too rare
      {2000, kYear2000Us - 19'990, 10, -6, nullptr, true},
      {2000, kYear2000Us - 20'000, 10, 0, "all times are whole numbers"},
      {2000, kYear2050Us - 20'000, 10, -6, nullptr, true},
      {2000, kYear2050Us - 19'990, 10, 0, "all times are whole numbers"},
      {2000, kEndOfTimeUs - 1999, 1, -9, nullptr},
      {2000, kEndOfTimeUs - 2000, 1, 0, "all times are whole numbers"},
      {2000, -1.7e18, 1e4, -9, nullptr},
      {2000, 0.5, 1e-5, 0, nullptr},
      {2000, 0.5, 0, 0, nullptr},
      {1000, 0.5, 33.28 / 999, 0, nullptr},  // 30 events in a second
      {1000, 0.5, 33.32 / 999, 0,
       "in e: 1000 events from 0.5 on take 33.3 of a unit that is not seconds: probably ms"},
      {999, 0.5, 1.0 / 29, 0, nullptr},
      {5, 4.6e9 + 0.5, 1, 0, nullptr},
      {5, 4.7e9 + 0.5, 1, 0, "not seconds"},
      {2000, 16'384.5, 1.0 / 512, 0,
       "in e: the times are float32 numbers, which are 0.00195 s apart at 16388.40"},
      {2000, 16'384.5, 1.0 / 1024, 0, nullptr},
      {2000, 8'192.5, 1.0 / 1024, 0, nullptr},
      {2000, 1.7e9, 0, 0, "are 128 s apart at 1700000000: expected float64"},
      {2000, 1.7e15F, 0, 0, "are 134 s apart at 16999999"},
  };
  for (const auto& row : rows) {
    SCOPED_TRACE(testing::Message() << row.count << " from " << row.first << " by " << row.step);
    const TimeSample sample = sampleOf(row.count, row.first, row.step);
    ASSERT_EQ(sample.count, row.count);
    TimeUnit unit;
    const std::string error =
        errorOf([&] { unit = findTimeUnit({}, sample, kUsualEventRate, "in e"); });
    EXPECT_THAT(error, HasSubstr(row.error != nullptr ? row.error : "no error"));
    EXPECT_EQ(unit.exponent, row.exponent);
    ASSERT_EQ(unit.warning.has_value(), row.warned);
    EXPECT_THAT(unit.warning.value_or(Warning()).text,
                HasSubstr(row.warned ? "(--time-unit us)" : ""));
    for (const int exponent : {0, -3, -6, -9}) {
      const ReaderOptions told{{}, {}, timeUnitOf(exponent)};
      EXPECT_EQ(findTimeUnit(told, sample, kUsualEventRate, "").exponent, exponent);
    }
  }
}

TEST(TimeUnit, OfPosesIsNotConcludedFromTheirValues) {
  EXPECT_THAT(errorOf([] { poseTimeExponent({}, sampleOf(12, 928'218, 1), "p"); }),
              HasSubstr("p: all times are whole numbers, of an unknown unit: probably ms, where 12 "
                        "poses take 0.011 s"));
  EXPECT_THAT(errorOf([] { poseTimeExponent({}, sampleOf(12, 1.7e15, 10'000), "p"); }),
              HasSubstr("p: the times are whole numbers without a unit; as us"));
  EXPECT_EQ(poseTimeExponent({}, sampleOf(12, 1.7e18, 1e7), ""), -9);
}

TEST(TimeUnit, HasNames) {
  const struct {
    int exponent;
    std::int64_t unit_ns;
    const char* names;
  } rows[] = {
      {0, 1'000'000'000, "s sec secs second seconds"},
      {-3, 1'000'000, "ms msec msecs millisecond milliseconds"},
      {-6, 1'000, "us \u00b5s \u03bcs usec usecs microsecond microseconds"},
      {-9, 1, "ns nsec nsecs nanosecond nanoseconds"},
  };
  for (const auto& row : rows) {
    EXPECT_EQ(nanosecondsPer(row.exponent), row.unit_ns);
    for (const std::string_view name : splitWords(row.names)) {
      EXPECT_EQ(timeExponentOf(name), row.exponent) << name;
    }
  }
  EXPECT_EQ(timeExponentOf("m"), std::nullopt);
}

TEST(HeaderWord, HasANameAndAUnit) {
  constexpr int kNone = 1;
  const struct {
    const char* text;
    const char* name;
    const char* unit;
    int exponent;
  } rows[] = {
      {"#timestamp [ns]", "timestamp", "ns", -9},
      {" \"T_us\" ", "t", "us", -6},
      {"microseconds", "t", "microseconds", -6},
      {"x_mm", "x", "mm", kNone},
      {"Time (MS", "time", "ms", -3},
      {"x [px]", "x", "px", kNone},
      {"s", "s", "", kNone},
      {"ns", "t", "ns", -9},
      {"time_stamp", "time_stamp", "", kNone},
      {"pos_x_cm", "pos_x", "cm", kNone},
      {"[s]", "", "s", 0},
      {"'p'", "p", "", kNone},
  };
  for (const auto& row : rows) {
    const HeaderWord word = headerWord(row.text);
    EXPECT_EQ(word.name, row.name) << row.text;
    EXPECT_EQ(word.unit, row.unit) << row.text;
    EXPECT_EQ(word.time_exponent.value_or(kNone), row.exponent) << row.text;
  }
}

}  // namespace
}  // namespace efm
