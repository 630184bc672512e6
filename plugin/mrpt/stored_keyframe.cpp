// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/stored_keyframe.h"

#include <fmt/format.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>

#include <memory>
#include <stdexcept>
#include <string>

#include "plugin/mrpt/mrpt_pose.h"
#include "plugin/mrpt/mrpt_time.h"

namespace efm {

using mrpt::maps::CPointsMapXYZI;
using mrpt::obs::CObservationPointCloud;

StoredKeyframe storedKeyframe(const KeyframeDepthMap& keyframe,
                              const std::vector<ViewPoint>& points) {
  auto cloud = CPointsMapXYZI::Create();
  cloud->resize(points.size());
  std::vector<float> sigma(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f& p_ref = points[i].p_ref;
    cloud->setPointFast(i, p_ref.x(), p_ref.y(), p_ref.z());
    cloud->setPointIntensity(i, points[i].confidence);
    sigma[i] = points[i].sigma;
  }
  cloud->mark_as_modified();
  return {keyframe.window.t_ref_ns, keyframe.T_world_ref, std::move(cloud),
          std::make_shared<std::vector<float>>(std::move(sigma))};
}

std::vector<ViewPoint> viewPointsOf(const StoredKeyframe& keyframe) {
  const CPointsMapXYZI& cloud = *keyframe.points;
  const auto& x = cloud.getPointsBufferRef_x();
  const auto& y = cloud.getPointsBufferRef_y();
  const auto& z = cloud.getPointsBufferRef_z();
  const auto& confidence = cloud.getPointsBufferRef_intensity();
  std::vector<ViewPoint> points;
  points.reserve(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (confidence[i] == 0) continue;
    points.push_back({{x[i], y[i], z[i]}, confidence[i]});
    if (keyframe.sigma) points.back().sigma = keyframe.sigma->at(i);
  }
  return points;
}

std::vector<CloudPoint> worldPointsOf(const StoredKeyframe& keyframe) {
  return pointsInWorld(viewPointsOf(keyframe), keyframe.T_world_ref);
}

std::optional<StoredKeyframe> keyframeFrom(const mrpt::obs::CObservation& observation,
                                           const Rigid3& T_world_rig) {
  const auto* seen = dynamic_cast<const CObservationPointCloud*>(&observation);
  if (!seen) return std::nullopt;
  seen->load();  // its points may be in an external file
  const auto cloud = std::dynamic_pointer_cast<CPointsMapXYZI>(seen->pointcloud);
  if (!cloud) return std::nullopt;
  const std::int64_t t_ns =
      seen->timestamp == INVALID_TIMESTAMP ? 0 : nanosecondsFrom(seen->timestamp);
  return StoredKeyframe{t_ns, T_world_rig * rigidFrom(seen->sensorPose), cloud};
}

void insertInto(mrpt::maps::CSimpleMap& map, const StoredKeyframe& keyframe) {
  auto observation = CObservationPointCloud::Create();
  observation->sensorLabel = "keyframe";
  observation->timestamp = mrptTimeFrom(keyframe.t_ref_ns);
  observation->pointcloud = keyframe.points;
  auto frame = mrpt::obs::CSensoryFrame::Create();
  frame->insert(observation);
  auto pose = mrpt::poses::CPose3DPDFGaussian::Create();
  pose->mean = mrptPoseFrom(keyframe.T_world_ref);
  map.insert(pose, frame);
}

std::vector<StoredKeyframe> keyframesOf(const mrpt::maps::CSimpleMap& map) {
  std::vector<StoredKeyframe> keyframes;
  std::size_t index = 0;
  for (const auto& [pose, frame] : map) {
    const Rigid3 T_world_rig = rigidFrom(pose->getMeanVal());
    const std::size_t before = keyframes.size();
    for (const mrpt::obs::CObservation::Ptr& observation : *frame) {
      if (auto keyframe = keyframeFrom(*observation, T_world_rig)) keyframes.push_back(*keyframe);
    }
    if (keyframes.size() == before) {
      throw std::invalid_argument(
          fmt::format("frame {} of the simplemap holds no point cloud with intensities: it is no "
                      "keyframe of a map",
                      index));
    }
    ++index;
  }
  return keyframes;
}

}  // namespace efm
