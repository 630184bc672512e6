// SPDX-License-Identifier: BSD-3-Clause
#include "test/bench/performance_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "test/bench/performance_ratios.h"

namespace efm::bench {
namespace {

using testing::Eq;
using testing::HasSubstr;
using testing::Optional;

PerformanceRow timed(const char* group, const char* name, const char* kernel, int threads,
                     double cpu_ms, double real_ms) {
  return {group, name, kernel, threads, {{"cpu_ms", cpu_ms}, {"real_ms", real_ms}}};
}

TEST(PerformanceTable, CsvHasAColumnForEveryQuantityAndCondition) {
  const std::vector<PerformanceRow> rows = {{"voting", "2x3", "plain", 1, {{"cpu_ms", 1.5}}},
                                            {"reading", "text", "", 1, {{"events/s", 2e6}}}};
  std::ostringstream csv;
  writeCsv(csv, rows, {{"processor", "fast, \"new\""}});
  EXPECT_EQ(csv.str(),
            "group,case,kernel,threads,cpu_ms,events/s,processor\n"
            "voting,2x3,plain,1,1.5,,\"fast, \"\"new\"\"\"\n"
            "reading,text,,1,,2e+06,\"fast, \"\"new\"\"\"\n");
}

TEST(PerformanceTable, MarkdownHasATablePerGroupWithItsOwnColumns) {
  const std::vector<PerformanceRow> rows = {{"voting", "2x3", "plain", 1, {{"cpu_ms", 1.5}}},
                                            {"reading", "text", "", 2, {{"events/s", 2e6}}}};
  std::ostringstream markdown;
  writeMarkdown(markdown, rows, {{"load", "0.1"}});
  EXPECT_THAT(markdown.str(), HasSubstr("- load: 0.1\n"));
  EXPECT_THAT(markdown.str(), HasSubstr("## voting\n\n| case | kernel | threads | cpu_ms |\n"
                                        "|---|---|---|---|\n| 2x3 | plain | 1 | 1.5 |\n"));
  EXPECT_THAT(markdown.str(), HasSubstr("| text |  | 2 | 2 M |\n"));
}

TEST(PerformanceRatios, AKernelIsComparedWithTheYardstickOfItsSize) {
  std::vector<PerformanceRow> rows = {timed("voting", "small", kYardstick, 1, 12, 50),
                                      timed("voting", "large", kYardstick, 1, 90, 91),
                                      timed("voting", "small", "plain", 1, 4, 60)};
  addRatios(rows);
  EXPECT_THAT(rows[2].find("times_yardstick"), Optional(3.0));
  EXPECT_THAT(rows[0].find("times_yardstick"), Eq(std::nullopt));
}

TEST(PerformanceRatios, ThreadsAreComparedByRealTimeAndKeyframesByCpuTime) {
  std::vector<PerformanceRow> rows = {timed("keyframe", "small", kUnfused, 1, 100, 130),
                                      timed("keyframe", "small", "plain", 1, 50, 60),
                                      timed("keyframe", "small", "plain", 2, 52, 40)};
  addRatios(rows);
  EXPECT_THAT(rows[1].find("times_unfused"), Optional(2.0));
  EXPECT_THAT(rows[1].find("times_one_thread"), Eq(std::nullopt));
  EXPECT_THAT(rows[2].find("times_unfused"), Eq(std::nullopt));
  EXPECT_THAT(rows[2].find("times_one_thread"), Optional(1.5));
}

TEST(PerformanceRatios, SizesOfAGrowthAndKernelGiveAnExponent) {
  std::vector<PerformanceRow> rows;
  for (const double size : {10.0, 20.0, 40.0}) {
    rows.push_back({"growth",
                    "events/" + std::to_string(size),
                    "plain",
                    1,
                    {{"cpu_ms", 3 * size * size}, {"size", size}}});
    rows.push_back({"growth",
                    "planes/" + std::to_string(size),
                    "plain",
                    1,
                    {{"cpu_ms", size}, {"size", size}}});
  }
  addExponents(rows);
  ASSERT_EQ(rows.size(), 8U);
  EXPECT_EQ(rows[6].name, "events");
  EXPECT_NEAR(*rows[6].find("exponent"), 2, 1e-12);
  EXPECT_EQ(rows[7].name, "planes");
  EXPECT_NEAR(*rows[7].find("exponent"), 1, 1e-12);
}

}  // namespace
}  // namespace efm::bench
