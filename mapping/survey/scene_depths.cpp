// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/survey/scene_depths.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

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

/// How far a unit of inverse depth (1/m) moves the view of a camera at `p_view` (metres), in
/// pixels, on average over the view.
double meanParallax(const ReferenceView& view, const Eigen::Vector3d& p_view) {
  constexpr int kGrid = 5;
  double sum = 0;
  for (int row = 0; row < kGrid; ++row) {
    for (int column = 0; column < kGrid; ++column) {
      const Eigen::Vector3d ray =
          view.pointAt((column + 0.5) / kGrid * view.width, (row + 0.5) / kGrid * view.height, 1);
      sum += std::hypot(view.fx * (p_view.x() - ray.x() * p_view.z()),
                        view.fy * (p_view.y() - ray.y() * p_view.z()));
    }
  }
  return sum / (kGrid * kGrid);
}

}  // namespace

std::optional<ViewMotion> motionIn(const WindowData& data, const Rig& rig,
                                   const FusionMapperOptions& options) {
  const std::optional<Rigid3> T_world_rig = data.trajectory->poseAt(data.window.t_ref_ns);
  if (!T_world_rig) return std::nullopt;
  const auto reference = static_cast<std::size_t>(options.keyframe.reference_camera);
  const Rigid3& T_rig_view = rig.cameras.at(reference).T_rig_cam;
  const Rigid3 T_view_world = (*T_world_rig * T_rig_view).inverse();
  const ReferenceView view =
      makeReferenceView(rig.cameras.at(reference).model, options.keyframe.view);
  ViewMotion motion;
  constexpr int kSteps = 16;
  for (int step = 0; step <= kSteps; ++step) {
    const std::int64_t t_ns =
        data.window.t0_ns + (data.window.t1_ns - data.window.t0_ns) / kSteps * step;
    const std::optional<Rigid3> T_world_then = data.trajectory->poseAt(t_ns);
    if (!T_world_then) continue;
    const Rigid3 T_view_rig = T_view_world * *T_world_then;
    for (const int camera : selectedCameras(rig, options.cameras)) {
      const Rigid3& T_rig_cam = rig.cameras.at(static_cast<std::size_t>(camera)).T_rig_cam;
      motion.rig_baseline_m =
          std::max(motion.rig_baseline_m, (T_rig_cam.translation - T_rig_view.translation).norm());
      const double parallax_px_m = meanParallax(view, (T_view_rig * T_rig_cam).translation);
      motion.parallax_px_m = std::max(motion.parallax_px_m, parallax_px_m);
    }
    const Rigid3 T_view_then = T_view_rig * T_rig_view;
    motion.shift_m = std::max(motion.shift_m, T_view_then.translation.norm());
    motion.rotation_rad =
        std::max(motion.rotation_rad, Eigen::AngleAxisd(T_view_then.rotation).angle());
  }
  return motion;
}

CoarseSweep::CoarseSweep(const Rig& rig, const FusionMapperOptions& options,
                         const Coarseness& coarseness)
    : options_(withSmallView(options, rig, coarseness)),
      plane_step_px_(coarseness.plane_step_px),
      mapper_(rig, selectedCameras(rig, options.cameras), options_.keyframe) {}

std::optional<KeyframeDepthMap> CoarseSweep::map(const WindowData& data) {
  const std::optional<ViewMotion> motion = motionIn(data, mapper_.rig(), options_);
  if (!motion || motion->parallax_px_m <= 0) return std::nullopt;
  const double distance_m = std::max(motion->rig_baseline_m, motion->shift_m);
  const double near_m = distance_m * mapper_.view().fx / mapper_.view().width / kNearestMove;
  DepthPlanesOptions planes;
  planes.min_depth_m = std::max(near_m, kMinDepthM);
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
  for (const WindowSample& sample : samples) {
    const std::optional<KeyframeDepthMap> keyframe = sweep.map(middleOf(sample, window_s));
    if (!keyframe) continue;
    for (const float depth_m : keyframe->map.depth) {
      if (depth_m > 0) depths.inverse.push_back(1 / static_cast<double>(depth_m));
    }
    depths.nearest = std::max(depths.nearest, 1 / sweep.planes().depth(0));
  }
  std::sort(depths.inverse.begin(), depths.inverse.end());
  return depths;
}

}  // namespace efm
