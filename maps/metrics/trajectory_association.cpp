// SPDX-License-Identifier: BSD-3-Clause
#include "maps/metrics/trajectory_association.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "mapping/base/named_choice.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

bool earlier(const StampedPose& a, const StampedPose& b) { return a.t_ns < b.t_ns; }

/// @param poses sorted, at least one.
const StampedPose& nearestInTime(const std::vector<StampedPose>& poses, const StampedPose& to) {
  const auto after = std::lower_bound(poses.begin(), poses.end(), to, earlier);
  if (after == poses.begin()) return *after;
  const auto before = after - 1;
  if (after == poses.end()) return *before;
  return to.t_ns - before->t_ns <= after->t_ns - to.t_ns ? *before : *after;
}

}  // namespace

std::vector<PosePair> associatePoses(std::vector<StampedPose> estimate,
                                     std::vector<StampedPose> truth, double max_difference_s) {
  requireOption(max_difference_s >= 0 && max_difference_s <= 1e6, "max_difference_s",
                max_difference_s, "from 0 to 1e6 (seconds)");
  const std::int64_t max_difference_ns = durationFromSeconds(max_difference_s);
  std::stable_sort(estimate.begin(), estimate.end(), earlier);
  std::stable_sort(truth.begin(), truth.end(), earlier);
  const bool estimate_is_short = estimate.size() <= truth.size();
  const std::vector<StampedPose>& few = estimate_is_short ? estimate : truth;
  const std::vector<StampedPose>& many = estimate_is_short ? truth : estimate;

  std::vector<PosePair> pairs;
  if (few.empty()) return pairs;
  for (const StampedPose& pose : few) {
    const StampedPose& other = nearestInTime(many, pose);
    if (std::abs(other.t_ns - pose.t_ns) > max_difference_ns) continue;
    const StampedPose& estimated = estimate_is_short ? pose : other;
    const StampedPose& true_pose = estimate_is_short ? other : pose;
    pairs.push_back({true_pose.t_ns, estimated.T_world_rig, true_pose.T_world_rig});
  }
  return pairs;
}

}  // namespace efm
