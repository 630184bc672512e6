// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/maps/CMetricMap.h>
#include <mrpt/maps/CSimpleMap.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "maps/cloud/cloud_points.h"
#include "maps/cloud/global_cloud.h"
#include "maps/cloud/keyframe_cloud.h"
#include "maps/cloud/map_point.h"
#include "plugin/mrpt/mrpt_point_maps.h"
#include "plugin/session/map_snapshot.h"

namespace efm {

/// Converts points to MRPT's form: float32, frame `world`.
mrpt::maps::CPointsMapXYZI::Ptr pointsMapOf(const MapCloud& cloud);

/// Returns a warning if `pointsMapOf` rounds points by more than a tenth of a voxel.
std::optional<std::string> roundingWarning(const MapCloud& cloud, double voxel_size_m);

/// Returns the points of a keyframe in frame `ref`, float, intensity = confidence.
mrpt::maps::CPointsMapXYZI::Ptr cloudOf(const StoredKeyframe& keyframe);
/// Adds the keyframe to a simplemap in MRPT's own classes, for any MRPT program: the view's pose in
/// the world without covariance, and a frame with one CObservationPointCloud. The observation has
/// the label "keyframe", the time t_ref (rounded to MRPT's tick) and the identity as sensor pose.
/// @param cloud see `cloudOf`.
void insertInto(mrpt::maps::CSimpleMap& map, const StoredKeyframe& keyframe,
                const mrpt::maps::CPointsMapXYZI::Ptr& cloud);
/// Returns the keyframes of a simplemap. A frame may have several keyframes.
std::vector<StoredKeyframe> keyframesOf(const mrpt::maps::CSimpleMap& map);
/// Returns T_world_ref of the keyframes in a .simplemap. @throws std::runtime_error naming the
/// file.
std::vector<StampedPose> readSimpleMap(const std::filesystem::path& file);

/// The global cloud as a metric map of MRPT. MRPT's map factory makes the map from an .ini. The map
/// takes the keyframes' clouds of a simplemap, and it can be stored and drawn. Not thread-safe.
///
///     [<section>]
///     eventFusionMap_count = 1
///     [<section>_eventFusionMap_00_insertOpts]
///     ; the keys of [map] in an option file: voxel_size_m, min_keyframes, ...
///     [<section>_eventFusionMap_00_creationOpts]
///     ; MRPT's keys of every map: enableSaveAs3DObject, ...
///
/// A CObservationPointCloud with intensities (CPointsMapXYZI) is inserted as a keyframe with
/// intensity = confidence. Other observations are ignored.
///
/// The map also keeps its keyframes. A stored map contains only the keyframes, and reading inserts
/// them again. So a map that was read is the same, bit for bit, also after further keyframes.
class CEventFusionMap : public mrpt::maps::CMetricMap {
  DEFINE_SERIALIZABLE(CEventFusionMap, efm)

 public:
  explicit CEventFusionMap(const GlobalCloudOptions& options = {});

  /// @throws std::invalid_argument if a point is not finite, has a confidence below 0 or lies
  /// outside the range of voxel indices. Nothing is inserted then.
  void insertKeyframe(const StoredKeyframe& keyframe);
  /// Moves a keyframe to another pose: removes it and inserts it again.
  /// @param keyframe index in `keyframes`.
  /// @throws std::invalid_argument as `insertKeyframe` does. The keyframe does not move then.
  void moveKeyframe(std::size_t keyframe, const Rigid3& T_world_ref);

  const std::vector<StoredKeyframe>& keyframes() const { return keyframes_; }
  const GlobalCloud& cloud() const { return cloud_; }

  bool isEmpty() const override;
  std::string asString() const override;
  /// Draws the exported points, coloured by their confidence.
  void getVisualizationInto(mrpt::opengl::CSetOfObjects& out) const override;
  /// Writes "<prefix>.pcd".
  void saveMetricMapRepresentationToFile(const std::string& prefix) const override;
  /// Returns the exported points. The map owns the result and changes it when the map changes. If
  /// floats are too coarse for the points, MRPT's log has a warning.
  const mrpt::maps::CSimplePointsMap* getAsSimplePointsMap() const override;
  using CMetricMap::getAsSimplePointsMap;

 private:
  void warnOfRounding(const MapCloud& points) const;
  void internal_clear() override;
  bool internal_insertObservation(
      const mrpt::obs::CObservation& observation,
      const std::optional<const mrpt::poses::CPose3D>& robot_pose) override;
  /// Returns false: this map gives no likelihood of a pose.
  bool internal_canComputeObservationLikelihood(
      const mrpt::obs::CObservation& observation) const override;
  double internal_computeObservationLikelihood(
      const mrpt::obs::CObservation& observation,
      const mrpt::poses::CPose3D& taken_from) const override;

  std::vector<StoredKeyframe> keyframes_;
  GlobalCloud cloud_;
  mutable std::optional<mrpt::maps::CSimplePointsMap> simple_points_;  // made on demand
  mutable bool warned_of_rounding_ = false;

  MAP_DEFINITION_START(CEventFusionMap)
  GlobalCloudOptions options;
  MAP_DEFINITION_END(CEventFusionMap)
};

}  // namespace efm
