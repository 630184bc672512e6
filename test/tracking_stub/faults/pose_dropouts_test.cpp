// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/faults/pose_dropouts.h"

#include <gtest/gtest.h>

#include <set>
#include <stdexcept>

#include "test/tracking_stub/faults/tum_replay.h"

namespace efm {
namespace {

constexpr std::int64_t kMillisecondNs = 1'000'000;

/// 100 Hz, 100 s.
std::unique_ptr<PoseSource> tracker() {
  std::vector<StampedPose> poses;
  poses.reserve(10'000);
  for (int i = 0; i < 10'000; ++i) poses.push_back({i * 10 * kMillisecondNs, {}});
  return std::make_unique<TumReplay>(std::move(poses));
}

std::set<std::int64_t> timesFrom(PoseSource& source) {
  std::set<std::int64_t> times;
  while (const auto pose = source.next()) times.insert(pose->t_ns);
  EXPECT_TRUE(source.ended());
  return times;
}

TEST(PoseDropouts, LoseSinglePosesWithTheirProbability) {
  PoseDropoutOptions options;
  options.drop_probability = 0.2;
  options.seed = 4;
  PoseDropouts source(tracker(), options);
  const auto times = timesFrom(source);
  // Binomial: 2000 expected, stddev 40.
  EXPECT_NEAR(static_cast<double>(source.dropped()), 2'000, 160);
  EXPECT_EQ(times.size() + source.dropped(), 10'000U);
  PoseDropouts again(tracker(), options);
  EXPECT_EQ(timesFrom(again), times);
  options.seed = 5;
  PoseDropouts other(tracker(), options);
  EXPECT_NE(timesFrom(other), times);
}

TEST(PoseDropouts, LoseAllPosesOfAGapWithItsBeginAndWithoutItsEnd) {
  PoseDropoutOptions options;
  options.gaps = {{500 * kMillisecondNs, 700 * kMillisecondNs}, {0, 10 * kMillisecondNs}};
  PoseDropouts source(tracker(), options);
  const auto times = timesFrom(source);
  EXPECT_EQ(source.dropped(), 21U);
  EXPECT_EQ(times.count(0), 0U);
  EXPECT_EQ(times.count(490 * kMillisecondNs), 1U);
  EXPECT_EQ(times.count(500 * kMillisecondNs), 0U);
  EXPECT_EQ(times.count(690 * kMillisecondNs), 0U);
  EXPECT_EQ(times.count(700 * kMillisecondNs), 1U);
}

TEST(PoseDropouts, RandomGapsHaveTheirLengthAndRate) {
  PoseDropoutOptions options;
  options.random_gaps_hz = 0.5;
  options.random_gap_s = 0.3;
  PoseDropouts source(tracker(), options);
  const auto times = timesFrom(source);
  int gaps = 0;
  for (auto later = std::next(times.begin()); later != times.end(); ++later) {
    const std::int64_t apart_ns = *later - *std::prev(later);
    if (apart_ns == 10 * kMillisecondNs) continue;
    EXPECT_GE(apart_ns, 300 * kMillisecondNs);  // two gaps may touch
    ++gaps;
  }
  // One every 2.3 s: 43 in 100 s, with a stddev of 7.
  EXPECT_NEAR(gaps, 43, 20);
}

TEST(PoseDropouts, RefuseInvalidOptions) {
  EXPECT_THROW(PoseDropouts(nullptr, {}), std::invalid_argument);
  const PoseDropoutOptions mistakes[] = {
      {1.1, {}, 0, 0.5, 0}, {0, {{5, 5}}, 0, 0.5, 0}, {0, {}, -1, 0.5, 0}, {0, {}, 0, 0, 0}};
  for (const PoseDropoutOptions& options : mistakes) {
    EXPECT_THROW(PoseDropouts(tracker(), options), std::invalid_argument);
  }
}

}  // namespace
}  // namespace efm
