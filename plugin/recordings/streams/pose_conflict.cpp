// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/streams/pose_conflict.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

/// Finds a conflict of the poses of an interval. @param order indices in the order of time.
std::optional<PoseConflict> conflictIn(const std::vector<StampedPose>& poses,
                                       const std::vector<std::size_t>& order, std::int64_t from_ns,
                                       std::int64_t until_ns, bool takes_lost) {
  const auto begin = std::partition_point(order.begin(), order.end(),
                                          [&](std::size_t i) { return poses[i].t_ns < from_ns; });
  TrajectoryCheck check(takes_lost);
  for (auto i = begin; i != order.end() && poses[*i].t_ns <= until_ns; ++i) check.add(poses[*i]);
  const auto found = check.conflict();
  if (!found) return std::nullopt;
  PoseConflict conflict = {*found, {}};
  conflict.first = *(begin + static_cast<std::ptrdiff_t>(found->first));
  conflict.second = *(begin + static_cast<std::ptrdiff_t>(found->second));
  const auto [first, end] = std::minmax(conflict.first, conflict.second);
  for (std::size_t i = first + 1; i <= end && !conflict.back; ++i) {
    if (poses[i].t_ns < poses[i - 1].t_ns) conflict.back = i;
  }
  return conflict;
}

}  // namespace

std::string PoseConflict::text(const std::function<std::string(std::size_t)>& placeOf) const {
  const std::string poses =
      fmt::format("{} and {} are {:.3g} m and {:.3g} degrees apart", placeOf(first),
                  placeOf(second), distance_m, angle_rad / kRadiansPerDegree);
  if (back) {
    return fmt::format(
        "the times go back at {}, and the poses there differ from earlier ones: {}: expected one "
        "trajectory on one clock",
        placeOf(*back), poses);
  }
  return fmt::format("{}: {} of {} {}: {}: expected one trajectory",
                     equal_times ? "several poses of one time" : "poses of two bodies", count, of,
                     equal_times ? "times have poses that differ" : "poses change the place",
                     poses);
}

std::optional<PoseConflict> findPoseConflict(const std::vector<StampedPose>& poses,
                                             bool takes_lost) {
  constexpr int kMaxWaysBack = 16;  // a file in any order has more
  std::vector<std::size_t> order(poses.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return poses[a].t_ns < poses[b].t_ns; });
  std::optional<PoseConflict> conflict =
      conflictIn(poses, order, kMinTimeNs, kMaxTimeNs, takes_lost);
  std::int64_t newest_ns = kMinTimeNs;
  int ways = 0;
  for (std::size_t i = 0; i < poses.size() && !conflict && ways < kMaxWaysBack; ++i) {
    const bool goes_back = i > 0 && poses[i].t_ns < poses[i - 1].t_ns;
    if (goes_back && ++ways > 0)
      conflict = conflictIn(poses, order, poses[i].t_ns, newest_ns, takes_lost);
    newest_ns = std::max(newest_ns, poses[i].t_ns);
  }
  return conflict;
}

void requireOneTrajectory(const std::vector<StampedPose>& poses, const std::string& name,
                          bool takes_lost) {
  const std::optional<PoseConflict> conflict = findPoseConflict(poses, takes_lost);
  if (!conflict) return;
  throw std::runtime_error(fmt::format("{}: {}", name, conflict->text([&](std::size_t i) {
    return formatSeconds(poses[i].t_ns) + " s";
  })));
}

}  // namespace efm
