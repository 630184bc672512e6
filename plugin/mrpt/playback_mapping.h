// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

#include "plugin/mrpt/CEventFusionMap.h"
#include "plugin/mrpt/hosted_mapping.h"
#include "plugin/mrpt/stored_keyframe.h"

namespace efm {

/// Maps in the thread that adds the input: a call returns after the windows that became complete
/// are mapped. One mutex is held while a keyframe is made, and not while it is delivered.
///
/// If mapping fails (no memory, a sink that throws), the caller who adds input gets the error, and
/// so does each later one until mapping succeeds. Of two errors, the first is thrown.
class PlaybackMapping : public HostedMapping {
 public:
  /// @param earlier keyframes of an initial map.
  /// @throws std::runtime_error naming a file of the options that cannot be read.
  PlaybackMapping(const EventFusionOptions& options, std::vector<StoredKeyframe> earlier,
                  Callbacks callbacks);

  void addEvents(CameraPacket packet) override;
  void skipEvents(const CameraPacket& packet) override;
  void addPose(const QueuedPose& pose) override;
  /// Input afterwards is an error (std::logic_error).
  void finish() override;
  void stop() override;

  void setSink(DsiSink* sink) override;
  void setClock(ProcessorClock clock) override;

  std::optional<Rigid3> T_body_rig() const override { return session_.setup().T_body_rig; }
  SessionStatus status() const override;
  MapCloud::ConstPtr points() override;
  KeyframePoses keyframePoses() override;
  std::size_t simpleMapSize() const override;
  void copyTo(mrpt::maps::CSimpleMap& map) override;
  /// A CEventFusionMap, and its exported points as a CPointsMapXYZI.
  const mrpt::maps::CMultiMetricMap* metricMap() override;
  std::pair<cv::Mat1f, DepthPlanesOptions> newestDepth() const override;

 private:
  void advance(const std::function<void()>& feed);
  void mapComplete();
  void tellChoice();
  std::optional<KeyframeDepthMap> mapNext();
  void deliver(const KeyframeDepthMap& keyframe);
  void applyPending();
  void updateMetricMap(std::optional<std::string>& warning);
  void followRefinement();

  const GlobalCloudOptions cloud_options_;
  const Callbacks callbacks_;

  mutable std::mutex mutex_;  // protects all members below
  MappingSession session_;
  DsiSink* sink_ = nullptr;
  ProcessorClock clock_ = processSeconds;
  bool finished_ = false;
  bool stopped_ = false;
  std::uint64_t told_choices_ = 0;
  std::vector<StoredKeyframe> keyframes_;  // the initial map's first
  cv::Mat1f newest_depth_;
  std::set<std::thread::id> delivering_;  // threads within a callback
  mrpt::maps::CMultiMetricMap metric_map_;
  CEventFusionMap::Ptr event_map_;  // in metric_map_
  bool warned_of_rounding_ = false;
};

}  // namespace efm
