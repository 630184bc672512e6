// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/streams/pose_conflict.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

using Kind = PoseConflict::Kind;

/// Checks the poses of an interval of time.
class OrderedPoses {
 public:
  explicit OrderedPoses(const std::vector<StampedPose>& poses)
      : poses_(poses), order_(poses.size()) {
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::stable_sort(order_.begin(), order_.end(),
                     [&](std::size_t a, std::size_t b) { return poses[a].t_ns < poses[b].t_ns; });
  }
  std::optional<PoseConflict> conflictIn(std::int64_t from_ns, std::int64_t until_ns) const {
    const auto begin = std::partition_point(
        order_.begin(), order_.end(), [&](std::size_t i) { return poses_[i].t_ns < from_ns; });
    TrajectoryCheck check;
    for (auto i = begin; i != order_.end() && poses_[*i].t_ns <= until_ns; ++i) {
      check.add(poses_[*i]);
    }
    const auto found = check.conflict();
    if (!found) return std::nullopt;
    PoseConflict conflict;
    conflict.kind = found->equal_times ? Kind::kEqualTimes : Kind::kTwoPlaces;
    conflict.first = *(begin + static_cast<std::ptrdiff_t>(found->first));
    conflict.second = *(begin + static_cast<std::ptrdiff_t>(found->second));
    conflict.distance_m = found->distance_m;
    conflict.angle_rad = found->angle_rad;
    conflict.counts = fmt::format("{} of {}", found->count, found->of);
    return conflict;
  }

 private:
  const std::vector<StampedPose>& poses_;
  std::vector<std::size_t> order_;  // indices of the poses in the order of time
};

/// Finds the place where the times go back between two poses.
void noteWayBack(const std::vector<StampedPose>& poses, PoseConflict& conflict) {
  const std::size_t end = std::max(conflict.first, conflict.second);
  std::int64_t newest_ns = kMinTimeNs;
  for (std::size_t i = std::min(conflict.first, conflict.second); i <= end; ++i) {
    if (poses[i].t_ns < newest_ns) {
      conflict.kind = Kind::kBackward;
      conflict.back = i;
      return;
    }
    newest_ns = poses[i].t_ns;
  }
}

}  // namespace

std::string PoseConflict::text(const std::function<std::string(std::size_t)>& placeOf) const {
  const std::string apart =
      fmt::format("{:.3g} m and {:.3g} degrees apart", distance_m, angle_rad / kRadiansPerDegree);
  switch (kind) {
    case Kind::kOneTime:
      return fmt::format("all {} poses have one time, {}: expected a time of its own for each",
                         counts, placeOf(first));
    case Kind::kEqualTimes:
      return fmt::format(
          "{} times have poses that differ, first {} and {}, which are {}: expected one trajectory",
          counts, placeOf(first), placeOf(second), apart);
    case Kind::kTwoPlaces:
      return fmt::format(
          "the poses of two bodies: {} poses change the place and back, first {} and {}, which are "
          "{}: expected one trajectory",
          counts, placeOf(first), placeOf(second), apart);
    case Kind::kBackward:
      break;
  }
  return fmt::format(
      "the times go back at {}, and the poses there differ from earlier ones ({} and {} are {}): "
      "expected one trajectory on one clock",
      placeOf(back), placeOf(first), placeOf(second), apart);
}

std::optional<PoseConflict> findPoseConflict(const std::vector<StampedPose>& poses) {
  constexpr int kMaxWaysBack = 16;  // a file in any order has more
  if (poses.size() < 2) return std::nullopt;
  const auto [first, last] = std::minmax_element(
      poses.begin(), poses.end(), [](const auto& a, const auto& b) { return a.t_ns < b.t_ns; });
  if (first->t_ns == last->t_ns) {
    PoseConflict conflict;
    conflict.counts = std::to_string(poses.size());
    return conflict;
  }
  const OrderedPoses ordered(poses);
  std::optional<PoseConflict> conflict = ordered.conflictIn(first->t_ns, last->t_ns);
  std::int64_t newest_ns = poses.front().t_ns;
  for (std::size_t i = 1, ways = 0; i < poses.size() && !conflict && ways < kMaxWaysBack; ++i) {
    if (poses[i].t_ns < newest_ns) {
      conflict = ordered.conflictIn(poses[i].t_ns, newest_ns);
      while (i < poses.size() && poses[i].t_ns < newest_ns) ++i;
      ++ways;
    }
    if (i < poses.size()) newest_ns = std::max(newest_ns, poses[i].t_ns);
  }
  if (conflict) noteWayBack(poses, *conflict);
  return conflict;
}

void requireOneTrajectory(const std::vector<StampedPose>& poses, const std::string& name) {
  const std::optional<PoseConflict> conflict = findPoseConflict(poses);
  if (!conflict) return;
  throw std::runtime_error(fmt::format("{}: {}", name, conflict->text([&](std::size_t i) {
    return formatSeconds(poses[i].t_ns) + " s";
  })));
}

}  // namespace efm
