// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/faults/pose_latency.h"

#include <gtest/gtest.h>

#include <utility>

#include <stdexcept>

#include "test/tracking_stub/faults/pose_lists.h"

namespace efm {
namespace {

/// Returns a pose once when the test has set it.
class Tracker : public PoseSource {
 public:
  std::optional<StampedPose> pose;
  bool has_ended = false;

  std::optional<StampedPose> next() override { return std::exchange(pose, std::nullopt); }
  bool ended() const override { return has_ended && !pose; }
};

TEST(PoseLatency, ReturnsAPoseWhenAnotherIsNewerByTheLatency) {
  auto tracker = std::make_unique<Tracker>();
  Tracker& now = *tracker;
  PoseLatency late(std::move(tracker), 25);
  for (const std::int64_t t_ns : {0, 10, 20}) {
    now.pose = StampedPose{t_ns, {}};
    EXPECT_FALSE(late.next()) << t_ns;
    EXPECT_FALSE(late.ended());
  }
  now.pose = StampedPose{35, {}};
  EXPECT_EQ(late.next()->t_ns, 0);
  EXPECT_EQ(late.next()->t_ns, 10);
  EXPECT_FALSE(late.next());

  now.has_ended = true;
  EXPECT_FALSE(late.ended()) << "two are still held";
  EXPECT_EQ(late.next()->t_ns, 20);
  EXPECT_EQ(late.next()->t_ns, 35);
  EXPECT_TRUE(late.ended());
  EXPECT_FALSE(late.next());
}

TEST(PoseLatency, RefusesAnInvalidLatency) {
  EXPECT_THROW(PoseLatency(nullptr, 0), std::invalid_argument);
  EXPECT_THROW(PoseLatency(replay({}), -1), std::invalid_argument);
  EXPECT_THROW(PoseLatency(replay({}), 10'000'000'001), std::invalid_argument);
}

}  // namespace
}  // namespace efm
