// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/pose_source_selector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace efm {
namespace {

using Times = std::vector<std::int64_t>;

const PoseSourceId kMocap = {PoseKind::kPose, "mocap"};
const PoseSourceId kSlam = {PoseKind::kPose, "slam"};
const PoseSourceId kWheels = {PoseKind::kOdometry, "wheels"};
const PoseSourceId kActions = {PoseKind::kActions, "actions"};

Times timesOf(const std::vector<StampedPose>& poses) {
  Times times;
  for (const StampedPose& pose : poses) times.push_back(pose.t_ns);
  return times;
}

/// Poses of these sources, at 1, 2, ...; those that `add` returns.
struct Poses {
  std::vector<PoseSourceId> sources;
  Times used;
};

TEST(PoseSourceSelector, TheFirstSourceOfTheBestKindOrOfTheLabelIsUsed) {
  struct Row {
    std::string label;
    Poses before;
    Times waited;  // what `select` returns
    Poses after;
    std::optional<PoseSourceId> selected;
    std::map<PoseSourceId, std::uint64_t> unused;
  };
  const Row rows[] = {
      {"", {{kMocap, kSlam, kMocap}, {1, 3}}, {}, {}, kMocap, {{kSlam, 1}}},
      {"", {{kActions, kWheels, kMocap}, {3}}, {}, {}, kMocap, {{kWheels, 1}, {kActions, 1}}},
      {"",
       {{kActions, kWheels, kWheels}, {}},
       {2, 3},
       {{kWheels, kMocap}, {4}},  // a map has been begun
       kWheels,
       {{kMocap, 1}, {kActions, 1}}},
      {"", {}, {}, {{kActions, kMocap}, {1}}, kActions, {{kMocap, 1}}},
      {"wheels", {{kMocap, kWheels}, {2}}, {}, {}, kWheels, {{kMocap, 1}}},
      {"gps", {{kMocap, kMocap}, {}}, {}, {}, std::nullopt, {{kMocap, 2}}},
  };
  for (const Row& row : rows) {
    PoseSourceSelector selector(row.label);
    std::int64_t t_ns = 0;
    const auto add = [&](const std::vector<PoseSourceId>& sources) {
      Times used;
      for (const PoseSourceId& source : sources) {
        for (const std::int64_t time : timesOf(selector.add(source, {++t_ns, {}}))) {
          used.push_back(time);
        }
      }
      return used;
    };
    const std::string what = "label " + row.label + ", " + testing::PrintToString(row.waited);
    EXPECT_EQ(add(row.before.sources), row.before.used) << what;
    EXPECT_EQ(timesOf(selector.select()), row.waited) << what;
    EXPECT_EQ(add(row.after.sources), row.after.used) << what;
    EXPECT_EQ(selector.selected(), row.selected) << what;
    EXPECT_EQ(selector.unused(), row.unused) << what;
  }
}

TEST(PoseSourceSelector, ForgetsWaitingPosesFarFromTheLast) {
  PoseSourceSelector selector("");
  EXPECT_EQ(selector.waitingNs(), std::nullopt);
  for (const std::int64_t t_ns : {900, 100, 150, 198, 200}) selector.add(kWheels, {t_ns, {}});
  selector.limitWaiting(50);
  EXPECT_EQ(selector.waitingNs(), 200);
  EXPECT_EQ(timesOf(selector.select()), (Times{150, 198, 200}))
      << "the first ones, far on any side";
}

}  // namespace
}  // namespace efm
