// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/config/CLoadableOptions.h>
#include <mrpt/maps/CMultiMetricMap.h>
#include <mrpt/obs/CObservation.h>
#include <mrpt/rtti/CObject.h>
#include <mrpt/slam/CMetricMapBuilder.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "event_fusion/engine.h"
#include "maps/cloud/map_point.h"
#include "plugin/mrpt/CEventFusionMap.h"
#include "plugin/mrpt/pose_observation.h"
#include "plugin/mrpt/rig_from_packets.h"
#include "plugin/options/option_file.h"

namespace efm {

/// The method as an MRPT map builder: makes a map from events and poses (CObservationEvents,
/// CObservationRobotPose). The poses are in the world's frame: the builder does no localisation.
/// The same observations make the same map, bit for bit.
///
/// The builder maps nothing until the rig is complete: see RigFromPackets. A camera that first
/// appears later is an error.
///
/// Automatic options (the default of depth limits, planes and windows) are chosen as the program
/// chooses them: from the whole recording. So nothing is mapped before `finish`, and the map equals
/// the program's map, bit for bit. If the events exceed `[live] max_queue_mb`, or map updating is
/// disabled meanwhile, the options are chosen from the events so far; then the depth limits follow
/// the keyframes. In live operation the options are chosen from the first second that shows a
/// scene. The log and `status().chosen` give each chosen value and its reason.
///
/// If mapping fails (no memory, a sink that throws), each call that feeds the builder throws the
/// error until mapping succeeds. A call that asks for the map returns the map so far.
///
/// A program that knows only MRPT makes the builder by its name, sets the options through
/// CLoadableOptions and uses a CMetricMapBuilder. Asking for the map changes nothing: the map has
/// the keyframes so far. `finish` maps the waiting windows: all windows of a recording under a
/// second whose rig is not declared, and windows that end in the last 10 ms.
///
/// In live operation (`[live] enabled`) the mapping runs in a thread of the builder, and only
/// `finish` waits for this thread: see Mapper and plugin/README.md.
///
/// Thread-safe. In playback a call that needs the map waits while a keyframe is made. It does not
/// wait while a keyframe is delivered or a message is logged, so both callbacks may use the
/// builder. `processObservation` returns after the windows that became complete are mapped. Several
/// threads may feed the builder. Overlapping calls have no order, but observations in the order of
/// time make the same map.
class CEventFusionMapBuilder : public mrpt::slam::CMetricMapBuilder,
                               public mrpt::config::CLoadableOptions,
                               public mrpt::rtti::CObject {
  DEFINE_MRPT_OBJECT(CEventFusionMapBuilder, efm)

 public:
  /// Receives each keyframe once, after its insertion into the map and before the next keyframe is
  /// made. A later refinement may change its pose: see `trajectory`. Runs in the thread that feeds
  /// the builder. One such thread gets keyframes in the order of their windows. The callback may
  /// use the builder, whose map then ends with this keyframe. In live operation this callback may
  /// drop the last reference to the builder; a callback of the log must not do so.
  using KeyframeCallback = std::function<void(const KeyframeDepthMap&)>;
  /// Receives each new snapshot of the map in live operation, in the mapping's thread.
  using MapCallback = std::function<void(const std::shared_ptr<const MapSnapshot>&)>;

  explicit CEventFusionMapBuilder(const EventFusionOptions& builder_options = defaultOptions());
  ~CEventFusionMapBuilder() override;

  /// Starts over with other options.
  /// @throws std::invalid_argument if the options are not valid; std::runtime_error if a file in
  /// the options cannot be read. Nothing changes then.
  void setOptions(const EventFusionOptions& builder_options);
  EventFusionOptions usedOptions() const;
  void setKeyframeCallback(KeyframeCallback callback);
  void setMapCallback(MapCallback callback);
  /// @param sink receives every fused plane of every keyframe. Not owned, may be null. The threads
  /// of the sweep call it while the mutex is held: the sink must not use the builder. In live
  /// operation the keyframe in work uses the former sink, which must live until the next keyframe.
  void setDsiSink(DsiSink* sink);

  /// Feeds events and poses (CObservationRobotPose, CObservationOdometry). Only the poses of one
  /// source are used: see PoseSourceSelector. Other observations are counted and ignored. A
  /// CObservationRobotPose of a sensor on the rig gives T_world_rig = T_world_sensor *
  /// inverse(T_rig_sensor); with a hand-eye transform in the options T_world_rig = T_world_sensor *
  /// T_body_rig.
  /// @throws std::invalid_argument if the observation is null or contradicts its sensor or earlier
  /// observations; std::logic_error after `finish` in playback (in live operation the observation
  /// is counted instead). Complete windows are mapped before an error is thrown; their keyframes
  /// are in the map and delivered. If there are two errors, the first is thrown.
  void processObservation(const mrpt::obs::CObservation::Ptr& observation);
  /// Ends the recording: maps the remaining windows.
  void finish();

  /// Returns the newest snapshot of the map in live operation; null in playback.
  std::shared_ptr<const MapSnapshot> snapshot() const;
  SessionStatus status() const;
  /// Returns the number of observations that were neither events nor poses.
  std::uint64_t ignoredObservations() const;
  /// Returns the exported points of the global cloud.
  MapCloud::ConstPtr points() const;
  /// Returns T_world_ref of all keyframes at t_ref, as in the map or as from the tracker. The two
  /// trajectories differ for refined keyframes.
  std::vector<StampedPose> trajectory() const;
  std::vector<StampedPose> trackerTrajectory() const;

  /// Reads the sections "[<prefix>_dsi]", "[<prefix>_map]" ..., or "[dsi]", "[map]" ... for an
  /// empty prefix, and starts over: see plugin/mrpt/host_options.h. If there are sections
  /// "[event_fusion_dsi]" ..., an empty prefix means these sections, and "[map]" belongs to the
  /// host. Missing keys keep their values.
  /// @throws std::invalid_argument naming the file, section, key and value; std::runtime_error if
  /// the file is missing. Nothing changes then.
  void loadFromConfigFile(const mrpt::config::CConfigFileBase& source,
                          const std::string& prefix) override;
  /// Writes all options to the sections of `loadFromConfigFile`.
  void saveToConfigFile(mrpt::config::CConfigFileBase& target,
                        const std::string& prefix) const override;

  /// Starts over with the same options.
  /// @param initial_map a map of `getCurrentlyBuiltMap`: its keyframes become the first keyframes
  /// of the new map.
  /// @param x0 not used: poses come from observations.
  void initialize(const mrpt::maps::CSimpleMap& initial_map = mrpt::maps::CSimpleMap(),
                  const mrpt::poses::CPosePDF* x0 = nullptr) override;
  /// Returns the newest pose of the rig, the identity before the first pose. Without refinement it
  /// is the tracker's pose with the covariance that the tracker states. With refinement the latest
  /// refinement corrects the pose and gives its covariance (relative to the oldest fixed keyframes
  /// of the last window).
  mrpt::poses::CPose3DPDF::Ptr getCurrentPoseEstimation() const override;
  /// Feeds the pose after the action's movement (see DeadReckoning), then each observation of the
  /// frame.
  void processActionObservation(mrpt::obs::CActionCollection& action,
                                mrpt::obs::CSensoryFrame& observations) override;
  /// Returns one entry per keyframe: the pose of its reference view and a frame with its cloud; see
  /// `insertInto` in plugin/mrpt/CEventFusionMap.h. The builder shares the frames and their clouds:
  /// do not change them.
  void getCurrentlyBuiltMap(mrpt::maps::CSimpleMap& out_map) const override;
  /// Returns the number of keyframes.
  unsigned int getCurrentlyBuiltMapSize() override;
  /// Returns a CEventFusionMap and, for programs that know only MRPT's classes, its exported points
  /// as a CPointsMapXYZI. The builder owns the map, and no lock protects it: the next call of this
  /// function, setOptions, loadFromConfigFile or initialize, in any thread, changes or deletes it.
  /// Other threads use `points` or `getCurrentlyBuiltMap`. If the map has grown, the call costs an
  /// export of the whole map.
  const mrpt::maps::CMultiMetricMap* getCurrentlyBuiltMetricMap() const override;
  /// Writes the picture of the newest keyframe's depth map, in the format of the file's extension.
  /// @throws std::logic_error before the first keyframe; std::runtime_error naming the file.
  void saveCurrentEstimationToImage(const std::string& file, bool format_emf_bmp = true) override;

 private:
  void restart(const EventFusionOptions& builder_options, std::vector<StoredKeyframe> earlier = {});
  void take(const mrpt::obs::CObservation::Ptr& observation);
  std::shared_ptr<MapperDriver> mapper() const;
  std::shared_ptr<RigFromPackets> packets() const;
  template <typename Argument>
  std::function<void(const Argument&)> hosts(
      std::function<void(const Argument&)> CEventFusionMapBuilder::*callback);
  void warnOfRounding(const MapCloud& points) const;
  std::shared_ptr<MapperDriver> mapperOfMade() const;

  std::mutex restart_mutex_;  // held by the thread that starts over
  mutable std::mutex mutex_;  // protects all members below
  EventFusionOptions options_;

  KeyframeCallback callback_;
  MapCallback map_callback_;
  DsiSink* sink_ = nullptr;
  std::uint64_t ignored_observations_ = 0;
  TrackerPoses tracker_poses_;
  DeadReckoning reckoning_;                  // composes the actions
  std::shared_ptr<MapperDriver> mapper_;     // never null; used without the lock
  std::shared_ptr<RigFromPackets> packets_;  // as mapper_
  mutable std::mutex made_mutex_;  // locked before mutex_; protects the results of MRPT's getters:
  mutable std::weak_ptr<MapperDriver> made_of_;
  mutable std::map<std::shared_ptr<const std::vector<ViewPoint>>, mrpt::maps::CPointsMapXYZI::Ptr>
      clouds_;
  mutable std::shared_ptr<mrpt::maps::CMultiMetricMap> metric_map_;
  mutable MapCloud::ConstPtr shown_points_;  // in metric_map_
  mutable CEventFusionMap::Ptr event_map_;   // in metric_map_, in playback
  mutable std::atomic<bool> warned_of_rounding_ = false;
};

}  // namespace efm
