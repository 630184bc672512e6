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

/// Whether many points lie at a limit that may change.
bool areAtLimit(const std::vector<double>& inverse, const DepthPlanesOptions& planes,
                const AutomaticOptions& automatic) {
  // Evenly spread points: 2 %. Around a scene there are at most 2.4 %, and with much of it beyond a
  // limit mostly 7 % and more.
  constexpr double kNear = 0.02;
  constexpr double kMaxFraction = 0.06;
  const double nearest = 1 / planes.min_depth_m;
  const double farthest = 1 / planes.max_depth_m;
  const double margin = kNear * (nearest - farthest);
  const auto most = static_cast<std::ptrdiff_t>(kMaxFraction * static_cast<double>(inverse.size()));
  const auto first_near = std::lower_bound(inverse.begin(), inverse.end(), nearest - margin);
  const auto first_inside = std::upper_bound(inverse.begin(), inverse.end(), farthest + margin);
  return (automatic.min_depth_m && inverse.end() - first_near > most) ||
         (automatic.max_depth_m && first_inside - inverse.begin() > most);
}

}  // namespace

bool DepthFollower::follow(const cv::Mat1f& depth) {
  SceneDepths scene;
  scene.nearest = 1 / planes_.min_depth_m;
  for (const float depth_m : depth) {
    if (depth_m > 0) scene.inverse.push_back(1 / static_cast<double>(depth_m));
  }
  std::sort(scene.inverse.begin(), scene.inverse.end());
  const bool is_empty = scene.inverse.size() < kMinScenePoints;
  misfits_ = is_empty || areAtLimit(scene.inverse, planes_, automatic_) ? misfits_ + 1 : 0;
  if (is_empty) return false;
  const InverseRange range = limitsAround(denseRange(scene));

  const DepthPlanesOptions before = planes_;
  if (automatic_.min_depth_m) {
    planes_.min_depth_m = followed(planes_.min_depth_m, 1 / range.near);
  }
  if (automatic_.max_depth_m) {
    planes_.max_depth_m = followed(planes_.max_depth_m, 1 / range.far);
  }
  if (planes_.max_depth_m < kMaxChange * planes_.min_depth_m) planes_ = before;
  if (automatic_.num_planes) planes_.num_planes = automaticPlanes(planes_, parallax_px_m_);
  return planes_.min_depth_m != before.min_depth_m || planes_.max_depth_m != before.max_depth_m;
}

}  // namespace efm
