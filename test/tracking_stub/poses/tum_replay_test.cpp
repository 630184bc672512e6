// SPDX-License-Identifier: BSD-3-Clause
#include "test/tracking_stub/poses/tum_replay.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace efm {
namespace {

TEST(TumReplay, ReturnsPosesInOrderOfTimeAndThenEnds) {
  TumReplay replay({{30, {}}, {10, {}}, {20, {}}});
  EXPECT_FALSE(replay.ended());
  EXPECT_EQ(replay.next()->t_ns, 10);
  EXPECT_EQ(replay.next()->t_ns, 20);
  EXPECT_EQ(replay.next()->t_ns, 30);
  EXPECT_TRUE(replay.ended());
  EXPECT_FALSE(replay.next().has_value());
}

TEST(TumReplay, HasEndedFromTheStartWithoutPoses) {
  EXPECT_TRUE(TumReplay(std::vector<StampedPose>{}).ended());
}

TEST(TumReplay, RefusesAMissingFile) {
  EXPECT_THROW(TumReplay(std::filesystem::path("no/such/file.txt")), std::runtime_error);
}

}  // namespace
}  // namespace efm
