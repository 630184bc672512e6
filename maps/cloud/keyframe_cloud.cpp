// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/keyframe_cloud.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace efm {
namespace {

/// Returns the sigma of a depth; NaN if the peak has no curvature or the map has no variances.
float sigmaOf(const DepthMap& map, int x, int y) {
  const float variance = map.variance.empty() ? INFINITY : map.variance(y, x);
  if (!std::isfinite(variance)) return std::numeric_limits<float>::quiet_NaN();
  const float depth_m = map.depth(y, x);
  return depth_m * depth_m * std::sqrt(variance);
}

void appendPoints(const DepthMap& map, const ReferenceView& view, std::vector<ViewPoint>& points) {
  const cv::Size size(view.width, view.height);
  if (map.depth.size() != size || map.confidence.size() != size ||
      (!map.variance.empty() && map.variance.size() != size) ||
      (!map.probability.empty() && map.probability.size() != size)) {
    throw std::invalid_argument("the keyframe's images are not of its view's size");
  }
  for (int y = 0; y < view.height; ++y) {
    const float* depth_row = map.depth[y];
    const float* confidence_row = map.confidence[y];
    for (int x = 0; x < view.width; ++x) {
      if (!(depth_row[x] > 0) || !(confidence_row[x] > 0)) continue;
      points.push_back(
          {view.pointAt(x, y, depth_row[x]).cast<float>(), confidence_row[x], sigmaOf(map, x, y)});
      if (!map.probability.empty()) points.back().probability = map.probability(y, x);
    }
  }
}

}  // namespace

std::vector<ViewPoint> viewPoints(const KeyframeDepthMap& keyframe) {
  std::vector<ViewPoint> points;
  appendPoints(keyframe.map, keyframe.view, points);
  return points;
}

std::vector<ViewPoint> lateFusionPoints(const KeyframeDepthMap& keyframe) {
  std::vector<ViewPoint> points;
  for (const CameraDepthMap& camera : keyframe.camera_maps) {
    appendPoints(camera.map, keyframe.view, points);
  }
  return points;
}

std::vector<CloudPoint> pointsInWorld(const std::vector<ViewPoint>& points,
                                      const Rigid3& T_world_ref) {
  std::vector<CloudPoint> in_world;
  in_world.reserve(points.size());
  for (const ViewPoint& point : points) {
    in_world.push_back({T_world_ref * point.p_ref.cast<double>(), point.confidence, 1, 0,
                        point.sigma, point.probability});
  }
  return in_world;
}

MapCloud::ConstPtr keyframeCloud(const KeyframeDepthMap& keyframe, double resolution_m) {
  return mapCloudOf(pointsInWorld(viewPoints(keyframe), keyframe.T_world_ref), resolution_m);
}

namespace {

/// Returns the maximum distance by which a motion moves a point within a radius.
double maxMotion(const Rigid3& from, const Rigid3& to, double radius_m) {
  return (from.translation - to.translation).norm() +
         radius_m * from.rotation.angularDistance(to.rotation);
}

}  // namespace

void RefinedCloud::insertFixed(const std::vector<CloudPoint>& points, const Rigid3& T_world_ref) {
  if (!T_world_ref_.empty()) {
    throw std::invalid_argument("a keyframe of an earlier map must come before new ones");
  }
  cloud_.insert(fixed_, points, T_world_ref);
  ++fixed_;
}

void RefinedCloud::insert(std::vector<ViewPoint> points, const Rigid3& T_world_ref) {
  const std::vector<CloudPoint> in_world = pointsInWorld(points, T_world_ref);
  const std::size_t keyframe = T_world_ref_.size();
  T_world_ref_.push_back(T_world_ref);
  try {
    if (movable_ > 0) {
      double radius_m = 0;
      for (const ViewPoint& point : points) {
        radius_m = std::max<double>(radius_m, point.p_ref.norm());
      }
      kept_.push_back({std::move(points), radius_m});
    }
    cloud_.insert(fixed_ + keyframe, in_world, T_world_ref);
  } catch (...) {
    forgetNewest();
    throw;
  }
  finalize();
}

/// Finalizes the keyframes that cannot change any more, if there are enough voxels: neither they
/// nor the keyframes that check them may move from now on.
void RefinedCloud::finalize() {
  constexpr std::size_t kMinVoxels = 200'000;  // about 15 MB
  constexpr std::uint64_t kCheckers = GlobalCloud::kMaxNumberDifference;
  const std::uint64_t newest = fixed_ + T_world_ref_.size() - 1;
  // The points of the keyframe before the newest one may be removed.
  if (newest < movable_ || newest - movable_ < kCheckers + 1) return;
  const std::uint64_t below = newest - movable_ - kCheckers - 1;
  if (below < next_look_) return;
  if (cloud_.unfinalizedVoxels(below) < std::max(kMinVoxels, cloud_.finalizedVoxels() / 2)) {
    // The cost of a look grows with the keyframes.
    next_look_ = below + std::min<std::uint64_t>((below - cloud_.finalizedBelow()) / 20, 20) + 1;
    return;
  }
  const std::uint64_t first_movable = below + kCheckers;
  if (movable_ > 0 && first_movable > fixed_) freeze(first_movable - fixed_);
  cloud_.finalize(below);
}

/// Moves the keyframes below a number for the last time, and forgets their points.
void RefinedCloud::freeze(std::size_t below) {
  while (!pending_.empty() && pending_.begin()->first < below) {
    const auto [keyframe, T_world_ref] = *pending_.begin();
    pending_.erase(pending_.begin());
    put(keyframe, T_world_ref);
  }
  for (; frozen_ < below; ++frozen_) kept_[frozen_] = {};
}

void RefinedCloud::removePoints(std::size_t keyframe) {
  cloud_.replace(fixed_ + keyframe, {}, std::nullopt);
  if (keyframe < kept_.size()) kept_[keyframe].points.clear();
}

void RefinedCloud::removeNewest() {
  if (T_world_ref_.empty()) return;
  cloud_.remove(fixed_ + T_world_ref_.size() - 1);
  pending_.erase(T_world_ref_.size() - 1);
  forgetNewest();
}

void RefinedCloud::forgetNewest() {
  T_world_ref_.pop_back();
  if (kept_.size() > T_world_ref_.size()) kept_.pop_back();
}

void RefinedCloud::move(std::map<std::size_t, Rigid3> T_world_ref) {
  if (T_world_ref.empty()) return;
  const std::size_t last = T_world_ref.rbegin()->first;
  if (movable_ == 0 || last >= T_world_ref_.size()) {
    throw std::invalid_argument("keyframe " + std::to_string(last) + " cannot be moved: " +
                                (movable_ > 0 ? "it is not in the cloud" : "keyframes are fixed"));
  }
  T_world_ref.erase(T_world_ref.begin(), T_world_ref.lower_bound(frozen_));
  T_world_ref.merge(pending_);  // a new request replaces an earlier request
  pending_ = std::move(T_world_ref);
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
    if (!stays) {
      try {
        put(keyframe, T_world_ref);
      } catch (const std::invalid_argument&) {
        pending_.erase(next);  // it would be rejected again
        throw;
      }
      ++moved;
    }
    next = pending_.erase(next);
  }
}

void RefinedCloud::put(std::size_t keyframe, const Rigid3& T_world_ref) {
  cloud_.replace(fixed_ + keyframe, pointsInWorld(kept_[keyframe].points, T_world_ref),
                 T_world_ref);
  T_world_ref_[keyframe] = T_world_ref;
}

}  // namespace efm
