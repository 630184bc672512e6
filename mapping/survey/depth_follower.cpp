// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/survey/depth_follower.h"

#include <algorithm>
#include <cmath>

#include "mapping/survey/scene_depths.h"

namespace efm {
namespace {

/// The scene must have moved away from a limit by this factor, so that noise changes nothing.
constexpr double kTolerance = 1.2;
/// The change per keyframe: a single keyframe may see something else than the next one.
constexpr double kMaxChange = 1.25;

double followed(double limit_m, double wanted_m) {
  const double change = wanted_m / limit_m;
  if (change < kTolerance && change > 1 / kTolerance) return limit_m;
  return limit_m * std::clamp(change, 1 / kMaxChange, kMaxChange);
}

double inverseRange(const DepthPlanesOptions& planes) {
  return 1 / planes.min_depth_m - 1 / planes.max_depth_m;
}

}  // namespace

bool DepthFollower::follow(const cv::Mat1f& depth) {
  SceneDepths scene;
  scene.nearest = 1 / planes_.min_depth_m;
  for (const float depth_m : depth) {
    if (depth_m > 0) scene.inverse.push_back(1 / static_cast<double>(depth_m));
  }
  if (scene.inverse.size() < kMinScenePoints) return false;
  std::sort(scene.inverse.begin(), scene.inverse.end());
  const InverseRange range = limitsAround(denseRange(scene));

  const DepthPlanesOptions before = planes_;
  if (automatic_.min_depth_m) {
    planes_.min_depth_m = followed(planes_.min_depth_m, 1 / range.near);
  }
  if (automatic_.max_depth_m) {
    planes_.max_depth_m = followed(planes_.max_depth_m, 1 / range.far);
  }
  if (planes_.max_depth_m < kMaxChange * planes_.min_depth_m) planes_ = before;
  if (automatic_.num_planes) {
    const double planes = before.num_planes * inverseRange(planes_) / inverseRange(before);
    planes_.num_planes = static_cast<int>(
        std::clamp<double>(std::ceil(planes), kMinAutomaticPlanes, kMaxAutomaticPlanes));
  }
  return planes_.min_depth_m != before.min_depth_m || planes_.max_depth_m != before.max_depth_m;
}

}  // namespace efm
