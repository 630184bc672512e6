// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "maps/cloud/keyframe_cloud.h"
#include "maps/cloud/map_point.h"
#include "plugin/session/input_queue.h"
#include "plugin/session/mapping_session.h"
#include "plugin/session/sample.h"

namespace efm {

/// The exception of a step; null if it throws none.
template <typename Step>
std::exception_ptr exceptionOf(const Step& step) {
  try {
    step();
  } catch (...) {
    return std::current_exception();
  }
  return nullptr;
}

/// The points of a keyframe in its reference view, and the pose of the view. 20 bytes a point.
/// Transformed to the world, they are the points of the map again, bit for bit.
struct StoredKeyframe {
  std::int64_t t_ref_ns = 0;
  Rigid3 T_world_ref;
  std::shared_ptr<const std::vector<ViewPoint>> points;  ///< Never null; shared, never changed.
};

/// p_world = T_world_ref * p_ref.
std::vector<CloudPoint> worldPointsOf(const StoredKeyframe& keyframe);

/// The map as it was at one moment.
struct MapSnapshot {
  std::vector<StampedPose> trajectory;    ///< Of all keyframes, those of the initial map first.
  std::vector<Rigid3> T_odom_ref;         ///< Of the others: by the tracker.
  std::vector<StoredKeyframe> keyframes;  ///< In playback all, in live operation the newest.
  MapCloud::ConstPtr points;              ///< The exported points.
};

/// The poses T_world_ref of all keyframes at t_ref, those of the initial map first.
struct KeyframePoses {
  std::vector<StampedPose> in_map;
  std::vector<StampedPose> by_tracker;  ///< They differ for refined keyframes.
};
/// @param T_odom_ref of the last keyframes by the tracker.
KeyframePoses keyframePoses(std::vector<StampedPose> in_map, const std::vector<Rigid3>& T_odom_ref);

/// A mapping session as a program hosts it: in the caller's thread (PlaybackMapping) or in a
/// thread of its own (LiveMapping). Thread-safe.
class HostedMapping {
 public:
  struct Callbacks {
    /// All run without a lock, in the thread that maps.
    std::function<void(const KeyframeDepthMap&)> on_keyframe;
    std::function<void(const std::shared_ptr<const MapSnapshot>&)> on_map;
    std::function<void(const std::string&)> warn;
    std::function<void(const std::string&)> info;
  };

  virtual ~HostedMapping() = default;

  /// @throws std::invalid_argument where the packet is refused.
  virtual void addEvents(EventPacket packet) = 0;
  /// Counts a packet that is not to be mapped, and gives up its windows.
  virtual void skipEvents(const EventPacket& packet) = 0;
  virtual void addPose(const QueuedPose& pose) = 0;
  /// Maps the rest.
  virtual void finish() = 0;
  /// Ends without mapping the rest: input is lost from now on, and no callback comes after the
  /// current one.
  virtual void stop() = 0;
  /// False in a thread of the mapping's own: within a callback. `stop` does not wait there.
  virtual bool mayStopHere() const { return true; }

  /// T_world_rig = T_world_body * T_body_rig, with the options' T_body_rig if they have one.
  void addPose(const PoseSample& pose) {
    addPose({{pose.t_ns, rigPose(pose, T_body_rig())}, pose.source, pose.noise});
  }

  virtual void setSink(DsiSink* sink) = 0;
  virtual void setClock(ProcessorClock clock) = 0;

  /// The pose of the rig on the body, from the options.
  virtual std::optional<Rigid3> T_body_rig() const = 0;
  virtual SessionStatus status() const = 0;
  virtual MapCloud::ConstPtr points() = 0;
  virtual KeyframePoses keyframePoses() = 0;
  /// The keyframes: in live operation the newest ones.
  virtual std::vector<StoredKeyframe> keyframes() = 0;
  virtual std::size_t numKeyframes() const = 0;
  /// Null where the mapping makes none.
  virtual std::shared_ptr<const MapSnapshot> snapshot() const { return nullptr; }
  /// The newest keyframe's depth map, empty before the first one, and its planes.
  virtual std::pair<cv::Mat1f, DepthPlanesOptions> newestDepth() const = 0;
};

/// Hosts a mapping: by option live, or in playback.
/// @param earlier keyframes of an initial map.
/// @throws std::runtime_error if a file in the options cannot be read.
std::shared_ptr<HostedMapping> hostMapping(const EventFusionOptions& options,
                                           std::vector<StoredKeyframe> earlier,
                                           HostedMapping::Callbacks callbacks);

/// Logs the automatic options and why. Where no scene was found, as a warning.
void tellChoice(const SessionStatus& status, const HostedMapping::Callbacks& callbacks);

/// Maps in the thread that adds the input: a call returns after the windows that became complete
/// are mapped. One mutex is held while a keyframe is made, and not while it is delivered.
///
/// If mapping fails (no memory, a sink that throws), the caller who adds input gets the error, and
/// so does each later one until mapping succeeds. Of two errors, the first is thrown.
class PlaybackMapping : public HostedMapping {
 public:
  /// @param earlier keyframes of an initial map.
  PlaybackMapping(const EventFusionOptions& options, std::vector<StoredKeyframe> earlier,
                  Callbacks callbacks);

  void addEvents(EventPacket packet) override;
  void skipEvents(const EventPacket& packet) override;
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
  std::vector<StoredKeyframe> keyframes() override;
  std::size_t numKeyframes() const override;
  std::pair<cv::Mat1f, DepthPlanesOptions> newestDepth() const override;

 private:
  void advance(const std::function<void()>& feed);
  void mapComplete();
  void tellChoice();
  std::optional<KeyframeDepthMap> mapNext();
  void deliver(const KeyframeDepthMap& keyframe);
  void applyPending();
  void followRefinement();

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
};

}  // namespace efm
