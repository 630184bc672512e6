// SPDX-License-Identifier: BSD-3-Clause
#include "maps/metrics/trajectory_metrics.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <optional>
#include <stdexcept>

#include "mapping/base/option.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

bool earlier(const StampedPose& a, const StampedPose& b) { return a.t_ns < b.t_ns; }

/// Returns the pose that is nearest in time. @param poses sorted, at least one.
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

namespace {

/// Positions lie on a line if the ratio of their second to their first singular value is smaller.
constexpr double kMaxLineRatio = 1e-12;
/// Maximum error of a spacing, as a fraction of it.
constexpr double kMaxSpacingError = 0.2;

using Positions = Eigen::Matrix3Xd;

void requireSpread(const Positions& positions, const char* whose) {
  const Positions centred = positions.colwise() - positions.rowwise().mean();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(centred * centred.transpose());
  const Eigen::Vector3d& spreads = svd.singularValues();
  if (spreads[1] > kMaxLineRatio * spreads[0]) return;
  throw std::invalid_argument(std::string("the ") + whose +
                              " positions lie on a line: no rotation of least squares");
}

Rigid3 umeyama(const std::vector<PosePair>& pairs) {
  if (pairs.size() < 3) {
    throw std::invalid_argument(std::to_string(pairs.size()) +
                                " pairs of poses: expected at least 3 to align by");
  }
  const auto count = static_cast<Eigen::Index>(pairs.size());
  Positions estimated(3, count);
  Positions truth(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const PosePair& pair = pairs[static_cast<std::size_t>(i)];
    estimated.col(i) = pair.T_map_rig.translation;
    truth.col(i) = pair.T_world_rig.translation;
  }
  requireSpread(estimated, "estimated");
  requireSpread(truth, "true");
  const Eigen::Matrix4d T_world_map = Eigen::umeyama(estimated, truth, false);
  return {Eigen::Quaterniond(Eigen::Matrix3d(T_world_map.topLeftCorner<3, 3>())).normalized(),
          T_world_map.topRightCorner<3, 1>()};
}

/// Returns the position of each pair along the trajectory, in the spacing's unit; never decreasing.
std::vector<double> positionsAlong(const std::vector<PosePair>& pairs, RelativeSpacing::Unit unit) {
  std::vector<double> positions;
  positions.reserve(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (unit == RelativeSpacing::Unit::kFrames) {
      positions.push_back(static_cast<double>(i));
    } else if (unit == RelativeSpacing::Unit::kSeconds) {
      positions.push_back(secondsBetween(pairs.front().t_ns, pairs[i].t_ns));
    } else if (i == 0) {
      positions.push_back(0);
    } else {
      const Eigen::Vector3d step =
          pairs[i].T_world_rig.translation - pairs[i - 1].T_world_rig.translation;
      positions.push_back(positions.back() + step.norm());
    }
  }
  return positions;
}

/// Returns the index, from `first` on, of the position nearest to `target`, within `limit`.
std::optional<std::size_t> nearestIndex(const std::vector<double>& positions, std::size_t first,
                                        double target, double limit) {
  const auto begin = positions.begin() + static_cast<std::ptrdiff_t>(first);
  auto nearest = std::lower_bound(begin, positions.end(), target);
  if (nearest != begin &&
      (nearest == positions.end() || target - *(nearest - 1) <= *nearest - target)) {
    // The first of equal positions.
    nearest = std::lower_bound(begin, nearest, *(nearest - 1));
  }
  if (nearest == positions.end() || !(std::abs(*nearest - target) < limit)) return std::nullopt;
  return static_cast<std::size_t>(nearest - positions.begin());
}

}  // namespace

Rigid3 alignTrajectories(const std::vector<PosePair>& pairs, TrajectoryAlignment alignment) {
  if (pairs.empty()) throw std::invalid_argument("no pairs of poses to align by");
  switch (alignment) {
    case TrajectoryAlignment::kSe3:
      return umeyama(pairs);
    case TrajectoryAlignment::kOrigin:
      return pairs.front().T_world_rig * pairs.front().T_map_rig.inverse();
    case TrajectoryAlignment::kNone:
      break;
  }
  return {};
}

PoseErrors absoluteErrors(const std::vector<PosePair>& pairs, const Rigid3& T_world_map) {
  PoseErrors errors;
  for (const PosePair& pair : pairs) {
    const Rigid3 T_world_aligned = T_world_map * pair.T_map_rig;
    errors.translation_m.push_back(
        (pair.T_world_rig.translation - T_world_aligned.translation).norm());
    errors.rotation_rad.push_back(
        pair.T_world_rig.rotation.angularDistance(T_world_aligned.rotation));
  }
  return errors;
}

PoseErrors relativeErrors(const std::vector<PosePair>& pairs, const RelativeSpacing& spacing) {
  const bool frames = spacing.unit == RelativeSpacing::Unit::kFrames;
  requireOption(spacing.amount > 0 && std::isfinite(spacing.amount) &&
                    (!frames || std::floor(spacing.amount) == spacing.amount),
                "spacing", spacing.amount, "above 0, of frames a whole number");
  const std::vector<double> positions = positionsAlong(pairs, spacing.unit);
  PoseErrors errors;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto j = nearestIndex(positions, i, positions[i] + spacing.amount,
                                kMaxSpacingError * spacing.amount);
    if (!j || *j == i) continue;
    const Rigid3 T_ti_tj = pairs[i].T_world_rig.inverse() * pairs[*j].T_world_rig;
    const Rigid3 T_ei_ej = pairs[i].T_map_rig.inverse() * pairs[*j].T_map_rig;
    const Rigid3 error = T_ti_tj.inverse() * T_ei_ej;
    errors.translation_m.push_back(error.translation.norm());
    errors.rotation_rad.push_back(error.rotation.angularDistance(Eigen::Quaterniond::Identity()));
  }
  return errors;
}

double trueLength(const std::vector<PosePair>& pairs) {
  return pairs.empty() ? 0 : positionsAlong(pairs, RelativeSpacing::Unit::kMetres).back();
}

}  // namespace efm
