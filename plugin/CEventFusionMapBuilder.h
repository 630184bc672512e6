// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation.h>
#include <mrpt/rtti/CObject.h>
#include <mrpt/slam/CMetricMapBuilder.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "maps/cloud_point.h"
#include "plugin/mapping_session.h"
#include "plugin/option_file.h"

namespace efm {

/// Events and poses in (CObservationEvents, CObservationRobotPose), a map out: the method as an
/// MRPT map builder. Poses come from outside and are in the world's frame already: the builder
/// locates nothing. What goes in by `processObservation` alone decides what comes out: same
/// observations, same map, bit for bit.
///
/// The rig is complete once a second of events has been seen: nothing is mapped until then, and a
/// camera that first appears later is an error.
///
/// Thread-safe: one mutex. `processObservation` returns after mapping what became due.
class CEventFusionMapBuilder : public mrpt::slam::CMetricMapBuilder, public mrpt::rtti::CObject {
  DEFINE_MRPT_OBJECT(CEventFusionMapBuilder, efm)

 public:
  /// Receives each keyframe once, after it went into the map, by the thread that fed the builder,
  /// which may use the builder. In the order of their windows where one thread feeds.
  using KeyframeTaker = std::function<void(const KeyframeDepthMap&)>;

  /// @throws std::invalid_argument where the options are not valid.
  explicit CEventFusionMapBuilder(const EventFusionOptions& builder_options = {});
  ~CEventFusionMapBuilder() override;

  /// Starts over with other options.
  /// @throws std::invalid_argument where the options are not valid; nothing changes then.
  void setOptions(const EventFusionOptions& builder_options);
  void setKeyframeTaker(KeyframeTaker taker);
  /// Receives every fused plane of every keyframe; not owned, may be null.
  void setDsiSink(DsiSink* sink);

  /// Takes events and poses; other observations are counted and ignored. A CObservationRobotPose of
  /// a sensor on the rig gives T_world_rig = T_world_sensor * inverse(T_rig_sensor).
  /// @throws std::invalid_argument where the observation contradicts its sensor or those before it;
  /// std::logic_error after `finish`.
  void processObservation(const mrpt::obs::CObservation::Ptr& observation);
  /// No more observations will come: maps what is left.
  void finish();

  SessionStatus status() const;
  /// Observations that were neither events nor poses.
  std::uint64_t ignoredObservations() const;
  /// The exported points of the global cloud.
  std::vector<CloudPoint> points() const;

  /// Starts over with the same options. The pose does not matter: poses come from outside.
  /// @throws std::invalid_argument where the initial map is not empty, which cannot be continued.
  void initialize(const mrpt::maps::CSimpleMap& initial_map = mrpt::maps::CSimpleMap(),
                  const mrpt::poses::CPosePDF* x0 = nullptr) override;
  /// The newest pose of the rig that came in, without covariance; the identity before the first.
  mrpt::poses::CPose3DPDF::Ptr getCurrentPoseEstimation() const override;
  /// Processes each observation of the frame; the action says nothing that is used.
  void processActionObservation(mrpt::obs::CActionCollection& action,
                                mrpt::obs::CSensoryFrame& observations) override;
  /// One entry per keyframe: the pose of its reference view, and a frame that says its time.
  void getCurrentlyBuiltMap(mrpt::maps::CSimpleMap& out_map) const override;
  /// The number of keyframes.
  unsigned int getCurrentlyBuiltMapSize() override;
  /// Holds one CPointsMapXYZI: the exported points. Belongs to the builder and changes with the
  /// next call of this function; cost: that of the whole map where it grew.
  const mrpt::maps::CMultiMetricMap* getCurrentlyBuiltMetricMap() const override;
  /// The picture of the newest keyframe's depth map, in the format of the file's extension.
  /// @throws std::logic_error before the first keyframe; std::runtime_error naming the file.
  void saveCurrentEstimationToImage(const std::string& file, bool format_emf_bmp = true) override;

 private:
  void restart();
  void warnOfSilence(const KeyframeDepthMap& keyframe);
  /// Feeds the session under the lock, then hands out the keyframes that became due. What `feed`
  /// throws goes to the caller at the end.
  void advance(const std::function<void(MappingSession&)>& feed);

  mutable std::mutex mutex_;  // of everything below
  EventFusionOptions options_;

  KeyframeTaker taker_;
  DsiSink* sink_ = nullptr;
  std::unique_ptr<MappingSession> session_;
  bool finished_ = false;
  std::uint64_t ignored_observations_ = 0;
  std::optional<StampedPose> newest_pose_;
  std::vector<StampedPose> keyframe_poses_;  // T_world_ref
  cv::Mat1f newest_depth_;                   // of the newest keyframe
  std::set<int> silent_cameras_;             // that were warned of
  mutable mrpt::maps::CMultiMetricMap metric_map_;
  mutable std::size_t keyframes_in_metric_map_ = 0;
};

}  // namespace efm
