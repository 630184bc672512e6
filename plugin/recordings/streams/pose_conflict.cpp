// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/streams/pose_conflict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "mapping/events/event.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/geometry/trajectory.h"

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

/// Returns which poses belong to the longest sequence whose times do not go back.
std::vector<bool> longestInOrder(const std::vector<StampedPose>& poses) {
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> last;  // at k: the last pose of the sequence of k + 1 that ends earliest
  std::vector<std::size_t> before(poses.size(), kNone);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto longer = std::partition_point(
        last.begin(), last.end(), [&](std::size_t k) { return poses[k].t_ns <= poses[i].t_ns; });
    if (longer != last.begin()) before[i] = *std::prev(longer);
    if (longer == last.end()) {
      last.push_back(i);
    } else {
      *longer = i;
    }
  }
  std::vector<bool> in_order(poses.size(), false);
  for (std::size_t i = last.empty() ? kNone : last.back(); i != kNone; i = before[i]) {
    in_order[i] = true;
  }
  return in_order;
}

using Poses = std::vector<StampedPose>::const_iterator;

/// Returns whether the times leap at both ends of a burst, in one direction and back. At one end
/// alone the clock was set anew there.
bool leapsAndReturns(const std::vector<StampedPose>& poses, std::size_t begin, std::size_t end) {
  if (begin == 0 || end == poses.size()) return true;
  const std::int64_t there_ns = poses[begin].t_ns - poses[begin - 1].t_ns;
  const std::int64_t back_ns = poses[end].t_ns - poses[end - 1].t_ns;
  if ((there_ns > 0) == (back_ns > 0)) return false;
  const auto [less_ns, more_ns] = std::minmax({std::abs(there_ns), std::abs(back_ns)});
  return less_ns >= more_ns / 2;
}

/// Returns whether most poses of a burst differ from the motion, or they lie far outside of it.
bool isWrong(Poses begin, Poses end, const Trajectory& motion) {
  constexpr double kSame = 0.001 + 0.1 * kRadiansPerDegree;  // as equal poses of `TrajectoryCheck`
  const std::int64_t first_ns = motion.poses().front().t_ns - kFarAheadNs;
  const std::int64_t last_ns = motion.poses().back().t_ns + kFarAheadNs;
  std::size_t cursor = 0;
  int same = 0;
  int differ = 0;
  for (auto pose = begin; pose != end; ++pose) {
    if (pose->t_ns < first_ns || pose->t_ns > last_ns) ++differ;
    const auto segment = motion.segmentAt(pose->t_ns, cursor);
    if (!segment) continue;
    const double step = distanceBetween(segment->first.T_world_rig, segment->last.T_world_rig);
    const double apart = distanceBetween(segment->poseAt(pose->t_ns), pose->T_world_rig);
    ++(apart > 2 * step + kSame ? differ : same);
  }
  return differ > same;
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

std::vector<std::size_t> findWrongTimes(const std::vector<StampedPose>& poses) {
  constexpr std::size_t kMinRight = 3;  // of them one may be out of order
  const auto earlier = [](const StampedPose& a, const StampedPose& b) { return a.t_ns < b.t_ns; };
  if (std::is_sorted(poses.begin(), poses.end(), earlier)) return {};
  const std::vector<bool> right = longestInOrder(poses);
  Trajectory motion;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (right[i]) motion.add(poses[i]);
  }
  const auto out_of_order = static_cast<std::size_t>(std::count(right.begin(), right.end(), false));
  if (kMinRight * out_of_order > poses.size()) return {};
  std::vector<std::size_t> wrong;
  for (std::size_t begin = 0, end = 0; begin < poses.size(); begin = end) {
    const auto goes_on = [&] {  // a late pose may lie beside a burst
      return right[end] == right[begin] &&
             std::abs(poses[end].t_ns - poses[end - 1].t_ns) < kFarAheadNs;
    };
    for (end = begin + 1; end < poses.size() && goes_on();) ++end;
    if (right[begin]) continue;
    const auto first = poses.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto last = poses.begin() + static_cast<std::ptrdiff_t>(end);
    const auto [oldest, newest] = std::minmax_element(first, last, earlier);
    const bool is_burst =
        newest->t_ns - oldest->t_ns < kFarAheadNs && leapsAndReturns(poses, begin, end);
    if (!is_burst || !isWrong(first, last, motion)) continue;
    for (std::size_t i = begin; i < end; ++i) wrong.push_back(i);
  }
  return wrong;
}

Warning skippedPoses(std::uint64_t count, const std::string& first) {
  return {"skipped-poses",
          fmt::format("{} poses with wrong times were left out, the first one: {}", count, first)};
}

std::vector<std::size_t> takeOneTrajectory(std::vector<StampedPose>& poses, const std::string& name,
                                           std::vector<Warning>& warnings, bool takes_lost) {
  const auto place_of = [&](std::size_t i) { return formatSeconds(poses[i].t_ns) + " s"; };
  std::vector<std::size_t> wrong = findWrongTimes(poses);
  if (!wrong.empty()) {
    warnings.push_back(skippedPoses(wrong.size(), name + ": " + place_of(wrong.front())));
    removeAt(wrong, poses);
  }
  if (const std::optional<PoseConflict> conflict = findPoseConflict(poses, takes_lost)) {
    throw std::runtime_error(fmt::format("{}: {}", name, conflict->text(place_of)));
  }
  return wrong;
}

}  // namespace efm
