// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/refinement/map_truth.h"

#include <cmath>

#include "maps/cloud/keyframe_cloud.h"
#include "maps/metrics/sample_statistics.h"
#include "maps/metrics/trajectory_metrics.h"
#include "tracking_stub/rendering/frame_renderer.h"

namespace efm::studies {

MapTruth::MapTruth(const Simulation& simulation)
    : simulation_(simulation), walls_(wallsOf(simulation.scene)) {}

/// The reference view is the first camera's, without an offset, as in the default options.
Rigid3 MapTruth::T_world_ref(const KeyframeDepthMap& keyframe) const {
  return simulation_.motion->poseAt(keyframe.window.t_ref_ns) *
         simulation_.rig.cameras.front().T_rig_cam;
}

const cv::Mat1f& MapTruth::depthOf(const KeyframeDepthMap& keyframe) {
  cv::Mat1f& depth = depths_[keyframe.window.t_ref_ns];
  if (depth.empty()) {
    depth = renderDepth(simulation_.scene, T_world_ref(keyframe), keyframe.view);
  }
  return depth;
}

double MapTruth::medianOffRays(const std::vector<KeyframeDepthMap>& keyframes,
                               const std::vector<Rigid3>& T_world_estimate) {
  std::vector<double> distances;
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const ReferenceView& view = keyframes[i].view;
    const Rigid3 T_world_truth = T_world_ref(keyframes[i]);
    const cv::Mat1f& truth = depthOf(keyframes[i]);
    for (const ViewPoint& point : viewPoints(keyframes[i])) {
      const Eigen::Vector3d p_ref = point.p_ref.cast<double>();
      const Eigen::Vector2d pixel = view.project(p_ref);
      const double x = std::round(pixel.x());
      const double y = std::round(pixel.y());
      const float depth_m = truth(static_cast<int>(y), static_cast<int>(x));
      if (!(depth_m > 0)) continue;
      const Eigen::Vector3d p_true = T_world_truth * view.pointAt(x, y, depth_m);
      distances.push_back((T_world_estimate[i] * p_ref - p_true).norm());
    }
  }
  return medianOf(std::move(distances));
}

MapErrors MapTruth::errorsOf(const std::vector<KeyframeDepthMap>& keyframes,
                             const std::vector<Rigid3>& T_map_ref, const MapCloud& cloud) {
  std::vector<PosePair> pairs;
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    pairs.push_back({keyframes[i].window.t_ref_ns, T_map_ref[i], T_world_ref(keyframes[i])});
  }
  const Rigid3 T_world_map = alignTrajectories(pairs, TrajectoryAlignment::kSe3);

  MapErrors errors;
  const PoseErrors absolute = absoluteErrors(pairs, T_world_map);
  errors.trajectory_m = statisticsOf(absolute.translation_m).rms;
  errors.trajectory_rad = statisticsOf(absolute.rotation_rad).rms;

  const Rigid3 T_first_last = pairs.front().T_map_rig.inverse() * pairs.back().T_map_rig;
  const Rigid3 T_last_first = pairs.back().T_world_rig.inverse() * pairs.front().T_world_rig;
  const Rigid3 T_last_estimate = T_last_first * T_first_last;
  errors.end_to_end_m = T_last_estimate.translation.norm();
  errors.end_to_end_rad = T_last_estimate.rotation.angularDistance(Eigen::Quaterniond::Identity());

  std::vector<Rigid3> T_world_estimate;
  for (const Rigid3& T_map_one : T_map_ref) T_world_estimate.push_back(T_world_map * T_map_one);
  errors.rays_m = medianOffRays(keyframes, T_world_estimate);

  std::vector<NearPoint> near;
  std::vector<double> distances;
  for (const MapPoint& point : cloud) {
    const Eigen::Vector3d p_world = T_world_map * positionIn(cloud, point);
    near.push_back({p_world, nearestSurface(simulation_.scene, p_world)});
    distances.push_back(near.back().nearest.distance_m);
  }
  errors.map_m = medianOf(std::move(distances));
  errors.thickness_m = meanThickness(walls_, near).thickness_m;
  return errors;
}

}  // namespace efm::studies
