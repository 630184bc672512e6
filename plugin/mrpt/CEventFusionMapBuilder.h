// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/config/CLoadableOptions.h>
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
#include <thread>
#include <vector>

#include "maps/cloud/cloud_point.h"
#include "plugin/mrpt/CEventFusionMap.h"
#include "plugin/mrpt/dead_reckoning.h"
#include "plugin/mrpt/stored_keyframe.h"
#include "plugin/options/option_file.h"
#include "plugin/session/mapping_session.h"

namespace efm {

/// Events and poses in (CObservationEvents, CObservationRobotPose), a map out: the method as an
/// MRPT map builder. Poses come from outside and are in the world's frame already: the builder
/// locates nothing. What goes in by `processObservation` alone decides what comes out: same
/// observations, same map, bit for bit.
///
/// The rig is complete once a packet begins more than a second after the first event: nothing is
/// mapped until then, and a camera that first appears later is an error. Who asks for the map
/// completes the rig after a tenth of a second, so that a short recording becomes a map without
/// `finish`; but not while there is odometry alone, as poses, which are better, may still come.
///
/// Where mapping fails (no memory, a sink that throws), whoever fed the builder gets the error, as
/// does everyone who feeds it until it succeeds; who asks for the map gets what there is.
///
/// A program that has MRPT alone makes the builder by its name, gives it options as a
/// CLoadableOptions and uses it as a CMetricMapBuilder. Asking for the map maps every window that
/// is covered by then; what only `finish` can know, that nothing more will come, matters for a
/// window that ends in the recording's last 10 ms, where its packets do not say what they cover.
///
/// Thread-safe: one mutex, held while a keyframe is made, but neither while it is handed out nor
/// while something is logged: a callback of the log may use the builder as a taker may.
/// `processObservation` returns after mapping what became due. Several threads may feed: calls that
/// overlap have no order, but observations in the order of time make the same map whichever thread
/// maps them.
class CEventFusionMapBuilder : public mrpt::slam::CMetricMapBuilder,
                               public mrpt::config::CLoadableOptions,
                               public mrpt::rtti::CObject {
  DEFINE_MRPT_OBJECT(CEventFusionMapBuilder, efm)

 public:
  /// Receives each keyframe once, right after it went into the map and before the next one is made,
  /// with the pose that is known by then (a refinement may move it later: see `trajectory`),
  /// by the thread that fed the builder or asked it for the map: in the order of their windows
  /// where one thread does that. May use the builder, whose map is that up to this keyframe then.
  using KeyframeTaker = std::function<void(const KeyframeDepthMap&)>;

  /// @throws std::invalid_argument where the options are not valid.
  explicit CEventFusionMapBuilder(const EventFusionOptions& builder_options = {});
  ~CEventFusionMapBuilder() override;

  /// Starts over with other options.
  /// @throws std::invalid_argument where the options are not valid, std::runtime_error where a file
  /// that they name cannot be read; nothing changes then.
  void setOptions(const EventFusionOptions& builder_options);
  EventFusionOptions usedOptions() const;
  void setKeyframeTaker(KeyframeTaker taker);
  /// Receives every fused plane of every keyframe; not owned, may be null. Called while the mutex
  /// is held, by the threads of the sweep: it must not use the builder.
  void setDsiSink(DsiSink* sink);

  /// Takes events and poses (CObservationRobotPose, CObservationOdometry), the latter of one
  /// source: see PoseSourceSelector; other observations are counted and ignored. A
  /// CObservationRobotPose of a sensor on the rig gives T_world_rig = T_world_sensor *
  /// inverse(T_rig_sensor), and with a hand-eye transform in the options T_world_rig =
  /// T_world_sensor * T_body_rig.
  /// @throws std::invalid_argument where the observation is null or contradicts its sensor or those
  /// before it; std::logic_error after `finish`. What became due is mapped all the same; where that
  /// fails too, the first error counts. The keyframes before an error are in the map and were
  /// handed out.
  void processObservation(const mrpt::obs::CObservation::Ptr& observation);
  /// No more observations will come: maps what is left.
  void finish();

  SessionStatus status() const;
  /// Observations that were neither events nor poses.
  std::uint64_t ignoredObservations() const;
  /// The exported points of the global cloud.
  std::vector<CloudPoint> points() const;
  /// T_world_ref at t_ref of all keyframes, as they are in the map; and as the tracker has them,
  /// which is the same but for those that were refined.
  std::vector<StampedPose> trajectory() const;
  std::vector<StampedPose> trackerTrajectory() const;

  /// Reads the sections "[<prefix>_dsi]", "[<prefix>_map]" ..., or "[dsi]", "[map]" ... where the
  /// prefix is empty, and starts over; see plugin/host_options.h. Keys that are not given keep what
  /// they were.
  /// @throws std::invalid_argument naming the file, section, key and value; std::runtime_error
  /// where the file is missing. Nothing changes then.
  void loadFromConfigFile(const mrpt::config::CConfigFileBase& source,
                          const std::string& prefix) override;
  /// Writes all options to the sections that `loadFromConfigFile` reads.
  void saveToConfigFile(mrpt::config::CConfigFileBase& target,
                        const std::string& prefix) const override;

  /// Starts over with the same options. An initial map is one that `getCurrentlyBuiltMap` gave: its
  /// keyframes are the first of the new map. The pose does not matter: poses come from outside.
  /// @throws std::invalid_argument where a frame of the initial map is no keyframe.
  void initialize(const mrpt::maps::CSimpleMap& initial_map = mrpt::maps::CSimpleMap(),
                  const mrpt::poses::CPosePDF* x0 = nullptr) override;
  /// The newest pose of the rig that is used; the identity before the first. Where poses are
  /// refined, corrected by the latest refinement, with the covariance that this gives it (against
  /// the oldest keyframes that its last window left in place); otherwise as it came, without
  /// covariance.
  mrpt::poses::CPose3DPDF::Ptr getCurrentPoseEstimation() const override;
  /// Takes the action's movement for a pose (see DeadReckoning), then each observation of the
  /// frame.
  void processActionObservation(mrpt::obs::CActionCollection& action,
                                mrpt::obs::CSensoryFrame& observations) override;
  /// One entry per keyframe: the pose of its reference view, and a frame that holds its cloud; see
  /// `insertInto` in plugin/stored_keyframe.h. The clouds are the builder's own: not to be changed.
  void getCurrentlyBuiltMap(mrpt::maps::CSimpleMap& out_map) const override;
  /// The number of keyframes.
  unsigned int getCurrentlyBuiltMapSize() override;
  /// Holds a CEventFusionMap and, for programs that know MRPT's classes alone, its exported points
  /// as a CPointsMapXYZI. Belongs to the builder and is for one thread at a time, no lock guards
  /// it: what is returned changes or vanishes with the next call of this function, by any thread,
  /// of setOptions, loadFromConfigFile or initialize. Threads that need the map besides take
  /// `points` or `getCurrentlyBuiltMap`. Cost: that of exporting the whole map where it grew.
  const mrpt::maps::CMultiMetricMap* getCurrentlyBuiltMetricMap() const override;
  /// The picture of the newest keyframe's depth map, in the format of the file's extension.
  /// @throws std::logic_error before the first keyframe; std::runtime_error naming the file.
  void saveCurrentEstimationToImage(const std::string& file, bool format_emf_bmp = true) override;

 private:
  /// A keyframe that is in the map, who receives it, and what the log is to say of it.
  struct MadeKeyframe {
    KeyframeDepthMap keyframe;
    KeyframeTaker taker;
    std::vector<std::string> warnings;
  };

  void restart(const EventFusionOptions& builder_options);
  void followRefinement();
  void settle() const;
  std::vector<StampedPose> keyframePoses() const;
  std::vector<std::string> warningsOfSilence(const KeyframeDepthMap& keyframe);
  /// Feeds the session under the lock, then maps and hands out what became due. The first error
  /// goes to the caller at the end.
  void advance(const std::function<void(MappingSession&)>& feed);
  /// Maps what is due and hands it out, keyframe by keyframe: one alone is held at a time.
  void mapDue();
  std::optional<MadeKeyframe> mapNext();
  void handOut(const MadeKeyframe& made);
  /// Maps what is due for somebody who asks for the map. Const as MRPT has those who ask: what is
  /// asked for is the map of what came in, which mapping it does not change.
  void mapWhenAsked() const;

  mutable std::mutex mutex_;  // of everything below
  EventFusionOptions options_;

  KeyframeTaker taker_;
  DsiSink* sink_ = nullptr;
  std::unique_ptr<MappingSession> session_;
  bool finished_ = false;
  std::uint64_t ignored_observations_ = 0;
  DeadReckoning reckoning_;                // from the actions
  std::vector<StoredKeyframe> keyframes_;  // those of an earlier map first
  cv::Mat1f newest_depth_;                 // of the newest keyframe
  std::set<int> silent_cameras_;           // that were warned of
  bool mapping_failed_ = false;            // the last time
  std::set<std::thread::id> handing_out_;  // within a taker or the log
  mutable mrpt::maps::CMultiMetricMap metric_map_;
  mutable CEventFusionMap::Ptr event_map_;  // in metric_map_
};

}  // namespace efm
