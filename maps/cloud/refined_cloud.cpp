// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/refined_cloud.h"

#include <algorithm>
#include <cassert>
#include <stdexcept>
#include <utility>

namespace efm {
namespace {

double radiusOf(const std::vector<ViewPoint>& points) {
  double radius_m = 0;
  for (const ViewPoint& point : points) {
    radius_m = std::max<double>(radius_m, point.p_ref.norm());
  }
  return radius_m;
}

/// The maximum distance by which a motion moves a point within a radius.
double maxMotion(const Rigid3& from, const Rigid3& to, double radius_m) {
  return (from.translation - to.translation).norm() +
         radius_m * from.rotation.angularDistance(to.rotation);
}

}  // namespace

void RefinedCloud::insertFixed(const std::vector<CloudPoint>& points, const Rigid3& T_world_ref) {
  assert(T_world_ref_.empty());
  cloud_.insert(fixed_, points, T_world_ref);
  ++fixed_;
}

void RefinedCloud::insert(std::vector<ViewPoint> points, const Rigid3& T_world_ref) {
  cloud_.insert(fixed_ + T_world_ref_.size(), pointsInWorld(points, T_world_ref), T_world_ref);
  T_world_ref_.push_back(T_world_ref);
  if (!movable_) return;
  const double radius_m = radiusOf(points);
  kept_.push_back({std::move(points), radius_m});
}

void RefinedCloud::move(std::size_t keyframe, const Rigid3& T_world_ref) {
  assert(movable_ && keyframe < T_world_ref_.size());
  pending_[keyframe] = T_world_ref;
}

void RefinedCloud::applyPending(double tolerance_m, std::size_t max_count) {
  std::size_t moved = 0;
  for (auto next = pending_.begin(); next != pending_.end() && moved < max_count;) {
    const auto [keyframe, T_world_ref] = *next;
    const Rigid3& T_before_ref = T_world_ref_[keyframe];
    const bool stays = isSame(T_before_ref, T_world_ref);
    // A motion of the last digits may have a length of 0.
    if (!stays && tolerance_m > 0 &&
        maxMotion(T_before_ref, T_world_ref, kept_[keyframe].radius_m) <= tolerance_m) {
      ++next;  // it stays pending
      continue;
    }
    next = pending_.erase(next);
    if (stays) continue;
    put(keyframe, T_world_ref);
    ++moved;
  }
}

void RefinedCloud::put(std::size_t keyframe, const Rigid3& T_world_ref) {
  const std::vector<ViewPoint>& points = kept_[keyframe].points;
  const auto insert = [&](const Rigid3& T_in_world) {
    cloud_.insert(fixed_ + keyframe, pointsInWorld(points, T_in_world), T_in_world);
  };
  cloud_.remove(fixed_ + keyframe);
  try {
    insert(T_world_ref);
  } catch (const std::invalid_argument&) {
    insert(T_world_ref_[keyframe]);
    throw;
  }
  T_world_ref_[keyframe] = T_world_ref;
}

}  // namespace efm
