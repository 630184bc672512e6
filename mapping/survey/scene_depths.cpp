// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/survey/scene_depths.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "mapping/depth/median.h"

namespace efm {
namespace {

/// Surer points than a map needs: a wrong depth would widen the range.
constexpr double kCoarseQuality = 0.1;
/// At the nearest plane, the distance of the cameras moves the view by this fraction of its width.
/// Nearer things are hardly seen twice.
constexpr double kNearestMove = 0.5;
constexpr double kFarthestParallaxPx = 0.5;  // beyond it, depth cannot be told from infinity
constexpr int kMaxCoarsePlanes = 400;

FusionMapperOptions withSmallView(FusionMapperOptions options, const Rig& rig,
                                  const Coarseness& coarseness) {
  KeyframeMapperOptions& coarse = options.keyframe;
  const auto reference = static_cast<std::size_t>(coarse.reference_camera);
  const int width = coarse.view.width.value_or(
      reference < rig.cameras.size() ? rig.cameras[reference].model.width : coarseness.width);
  coarse.view.width = std::min(width, coarseness.width);
  coarse.view.height.reset();
  coarse.max_events_per_camera = coarseness.events;
  coarse.extraction = {};
  coarse.extraction.extraction = coarseness.extraction;
  coarse.extraction.min_quality = kCoarseQuality;
  coarse.motion = {};
  coarse.camera_maps = false;
  coarse.event_images = false;
  coarse.view_events = false;
  coarse.exclude_silent = true;
  return options;
}

}  // namespace

CoarseSweep::CoarseSweep(const Rig& rig, const FusionMapperOptions& options,
                         const Coarseness& coarseness)
    : options_(withSmallView(options, rig, coarseness)),
      plane_step_px_(coarseness.plane_step_px),
      nearest_m_(coarseness.nearest_m),
      mapper_(rig, selectedCameras(rig, options.cameras), options_.keyframe) {}

std::optional<KeyframeDepthMap> CoarseSweep::map(const WindowData& data) {
  const std::optional<ViewMotion> motion = motionIn(data, mapper_.rig(), options_);
  if (!motion || motion->parallax_px_m <= 0) return std::nullopt;
  const double distance_m = std::max(motion->rig_baseline_m, motion->shift_m);
  const double near_m = distance_m * mapper_.view().fx / mapper_.view().width / kNearestMove;
  DepthPlanesOptions planes;
  planes.min_depth_m = std::max(near_m, nearest_m_);
  planes.max_depth_m =
      std::max(2 * planes.min_depth_m, motion->parallax_px_m / kFarthestParallaxPx);
  planes.num_planes =
      1 + std::min(kMaxCoarsePlanes,
                   static_cast<int>(
                       std::ceil(motion->parallax_px_m / planes.min_depth_m / plane_step_px_)));
  mapper_.setPlanes(planes);
  return mapper_.map(data.window, data.events, *data.trajectory);
}

InverseRange denseRange(const SceneDepths& depths) {
  constexpr double kClutter = 0.5;
  constexpr int kBins = 400;
  std::vector<double> gain(kBins, -kClutter / kBins);
  for (const double inverse : depths.inverse) {
    const int bin = std::min(kBins - 1, static_cast<int>(inverse / depths.nearest * kBins));
    gain[static_cast<std::size_t>(bin)] += 1 / static_cast<double>(depths.inverse.size());
  }
  double sum = 0;
  double best_sum = 0;
  int begin = 0;
  std::pair<int, int> best{0, kBins};
  for (int bin = 0; bin < kBins; ++bin) {
    sum += gain[static_cast<std::size_t>(bin)];
    if (sum > best_sum) {
      best_sum = sum;
      best = {begin, bin + 1};
    }
    if (sum < 0) {
      sum = 0;
      begin = bin + 1;
    }
  }
  const double first = depths.nearest * best.first / kBins;
  const double last = depths.nearest * best.second / kBins;
  const auto& inverse = depths.inverse;
  const auto far = std::lower_bound(inverse.begin(), inverse.end(), first);
  const auto near = std::prev(std::upper_bound(inverse.begin(), inverse.end(), last));
  return {*far, *near};
}

InverseRange limitsAround(const InverseRange& scene) {
  constexpr double kMinMargin = 1.25;
  constexpr double kMinRatio = 10;
  // Room in front of the scene shows ambiguous peaks; room behind it has the wrong points of weak
  // parallax, too.
  constexpr double kFarExponent = 0.75;
  const double margin = std::sqrt(kMinRatio * scene.far / scene.near);
  return {scene.far / std::max(kMinMargin, std::pow(margin, kFarExponent)),
          scene.near * std::max(kMinMargin, margin)};
}

SceneDepths sceneDepths(CoarseSweep& sweep, const std::vector<WindowSample>& samples,
                        double window_s) {
  SceneDepths depths;
  std::vector<double> parallaxes_px;
  for (const WindowSample& sample : samples) {
    const std::optional<KeyframeDepthMap> keyframe = sweep.map(middleOf(sample, window_s));
    if (!keyframe) continue;
    for (const float depth_m : keyframe->map.depth) {
      if (!(depth_m > 0)) continue;
      depths.inverse.push_back(1 / static_cast<double>(depth_m));
      parallaxes_px.push_back(keyframe->parallax_px_m * depths.inverse.back());
    }
    const std::uint64_t at_farthest = keyframe->map.pixels.at_farthest;
    parallaxes_px.insert(parallaxes_px.end(), at_farthest, 0);
    depths.farthest.insert(depths.farthest.end(), at_farthest,
                           1 / sweep.planes().depth(sweep.planes().size() - 1));
    depths.nearest = std::max(depths.nearest, 1 / sweep.planes().depth(0));
  }
  std::sort(depths.inverse.begin(), depths.inverse.end());
  if (!parallaxes_px.empty()) depths.parallax_px = upperMedian(parallaxes_px);
  return depths;
}

}  // namespace efm
