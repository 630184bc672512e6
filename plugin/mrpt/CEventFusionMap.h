// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/maps/CMetricMap.h>
#include <mrpt/maps/CSimplePointsMap.h>

#include <optional>
#include <string>
#include <vector>

#include "maps/cloud/global_cloud.h"
#include "plugin/mrpt/stored_keyframe.h"

namespace efm {

/// The global cloud as a metric map of MRPT's: made from an .ini by MRPT's map factory, filled from
/// the keyframes' clouds of a simplemap, stored, drawn. Not thread-safe.
///
///     [<section>]
///     eventFusionMap_count = 1
///     [<section>_eventFusionMap_00_insertOpts]
///     ; the keys of [map] in an option file: voxel_size_m, min_keyframes, ...
///     [<section>_eventFusionMap_00_creationOpts]
///     ; the keys that MRPT has for every map: enableSaveAs3DObject, ...
///
/// Takes observations of class CObservationPointCloud whose cloud has intensities
/// (CPointsMapXYZI), each as a keyframe with intensity = confidence; ignores all others.
///
/// It keeps its keyframes beside the cloud: what is stored is them, and reading puts them in again.
/// So a map that was stored is the same bit for bit, and goes on as if it had never been.
class CEventFusionMap : public mrpt::maps::CMetricMap {
  DEFINE_SERIALIZABLE(CEventFusionMap, efm)

 public:
  /// @throws std::invalid_argument where the options are not valid.
  explicit CEventFusionMap(const GlobalCloudOptions& options = {});

  /// @throws std::invalid_argument where a point is not finite or its confidence is below 0, or it
  /// lies outside the range of voxel indices: nothing is inserted then.
  void insertKeyframe(const StoredKeyframe& keyframe);
  /// Moves a keyframe to another pose: takes it out and puts it back.
  /// @param keyframe its place among `keyframes`.
  /// @throws std::invalid_argument as `insertKeyframe` does: the keyframe stays then.
  void moveKeyframe(std::size_t keyframe, const Rigid3& T_world_ref);

  const std::vector<StoredKeyframe>& keyframes() const { return keyframes_; }
  const GlobalCloud& cloud() const { return cloud_; }

  /// Whether there is no point.
  bool isEmpty() const override;
  std::string asString() const override;
  /// The exported points, coloured by their confidence.
  void getVisualizationInto(mrpt::opengl::CSetOfObjects& out) const override;
  /// Writes "<prefix>.pcd".
  /// @throws std::runtime_error naming the file where it cannot be written.
  void saveMetricMapRepresentationToFile(const std::string& prefix) const override;
  /// The exported points; belongs to the map and changes with it.
  const mrpt::maps::CSimplePointsMap* getAsSimplePointsMap() const override;
  using CMetricMap::getAsSimplePointsMap;

 private:
  void internal_clear() override;
  bool internal_insertObservation(
      const mrpt::obs::CObservation& observation,
      const std::optional<const mrpt::poses::CPose3D>& robot_pose) override;
  /// Events say nothing about how likely a pose is by this map.
  bool internal_canComputeObservationLikelihood(
      const mrpt::obs::CObservation& observation) const override;
  double internal_computeObservationLikelihood(
      const mrpt::obs::CObservation& observation,
      const mrpt::poses::CPose3D& taken_from) const override;

  std::vector<StoredKeyframe> keyframes_;
  GlobalCloud cloud_;
  mutable std::optional<mrpt::maps::CSimplePointsMap> simple_points_;  // made when asked for

  MAP_DEFINITION_START(CEventFusionMap)
  GlobalCloudOptions options;
  MAP_DEFINITION_END(CEventFusionMap)
};

}  // namespace efm
