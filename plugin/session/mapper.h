// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
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

/// Points of a keyframe in its reference view, and the pose of the view. 20 bytes per point.
/// Transformed to the world, they are again the points of the map, bit for bit.
struct StoredKeyframe {
  std::int64_t t_ref_ns = 0;
  Rigid3 T_world_ref;
  std::shared_ptr<const std::vector<ViewPoint>> points;  ///< Never null; shared, never changed.
};

/// The map at one moment.
struct MapSnapshot {
  /// T_world_ref of all keyframes at t_ref. The keyframes of the initial map come first.
  std::vector<StampedPose> trajectory;
  /// The poses of the same keyframes by the tracker. They differ if keyframes are refined.
  std::vector<StampedPose> tracker_trajectory;
  std::vector<StoredKeyframe> keyframes;  ///< All in playback, the newest in live operation.
  MapCloud::ConstPtr points;              ///< The exported points.
};

/// Turns the samples of a recording or of a sensor into keyframes and one map. Thread-safe.
///
/// In playback the caller's thread maps. `add` returns when all windows that became complete are
/// mapped, so the same samples give the same map, bit for bit. The caller gets the first error. If
/// a window cannot be mapped (no memory, a sink that throws), the next call tries it again. If its
/// keyframe cannot be stored, the window is dropped. A query waits while a keyframe is made, but
/// not while it is delivered. If several threads add samples, keyframes may be delivered at the
/// same time. Within a callback `add` and `finish` only take the input: the caller of the callback
/// maps it.
///
/// In live operation (`[live] enabled`) a thread of the mapper maps. `add` never waits, and queries
/// return the newest published state. If more input waits than the queue may hold, the oldest
/// windows are dropped. Errors of the mapping, the refinement and the callbacks are counted and
/// logged (LiveStatus); the window is dropped and the next one is tried. The snapshot of the map is
/// renewed after each keyframe, as long as this takes at most a twentieth of the time.
class Mapper {
 public:
  /// The callbacks run in the thread that maps, and may use the mapper.
  struct Callbacks {
    std::function<void(const KeyframeDepthMap&)> on_keyframe;
    /// Live operation: receives each new snapshot of the map.
    std::function<void(const std::shared_ptr<const MapSnapshot>&)> on_map;
    std::function<void(const std::string&)> warn;
    std::function<void(const std::string&)> info;
  };

  /// @param earlier keyframes of an initial map.
  /// @throws std::runtime_error if a file that the options name cannot be read.
  explicit Mapper(const EventFusionOptions& options, Callbacks callbacks = {},
                  const std::vector<StoredKeyframe>& earlier = {});
  /// Makes a mapper whose callbacks may drop the last reference to it in live operation.
  static std::shared_ptr<Mapper> make(const EventFusionOptions& options, Callbacks callbacks = {},
                                      const std::vector<StoredKeyframe>& earlier = {});
  /// Ends without mapping the rest.
  ~Mapper();
  Mapper(const Mapper&) = delete;
  Mapper& operator=(const Mapper&) = delete;

  /// Adds a packet of events or a pose; an OtherSample is ignored.
  /// @throws std::invalid_argument if the sample contradicts its sensor or earlier samples;
  /// std::logic_error after `finish` in playback (in live operation it is counted).
  void add(Sample sample);
  /// Counts a packet that is not to be mapped. The windows that need its events are dropped.
  void skip(const EventPacket& packet);
  /// Ends the input, and maps the rest; in live operation it waits for the rest. In playback it may
  /// be called again after an error.
  /// @throws std::logic_error in live operation within a callback; the error of the rig if an
  /// option or a camera does not fit.
  void finish();
  /// Ends without mapping the rest. Later input is lost. It waits for the current keyframe, and no
  /// callback begins after that. Within a callback of live operation it does not wait: the mapper's
  /// thread ends after the callback returns.
  void stop();
  /// Returns whether the caller is in the mapper's own thread: in a callback of live operation.
  bool runsHere() const { return std::this_thread::get_id() == worker_; }

  /// @param sink receives every fused plane; may be null. Not owned, and must not use the mapper.
  /// The current keyframe may still use the former sink.
  void setSink(DsiSink* sink);
  /// @param clock measures the stages of the mapping; must not use the mapper. Default: the
  /// processor time of the process.
  void setClock(ProcessorClock clock);

  /// Returns the pose of the rig on the tracked body, from the options.
  const std::optional<Rigid3>& T_body_rig() const { return setup_->T_body_rig; }
  SessionStatus status() const;
  /// Returns the map so far; in live operation its newest snapshot. Never null.
  std::shared_ptr<const MapSnapshot> snapshot() { return newest(true); }
  MapCloud::ConstPtr points() { return snapshot()->points; }
  /// Returns the snapshot. In playback it has no points, because they cost an export of the map.
  std::shared_ptr<const MapSnapshot> keyframes() { return newest(false); }
  std::size_t numKeyframes() const;
  /// Returns the newest keyframe's depth map (empty before the first one), and its depth planes.
  std::pair<cv::Mat1f, DepthPlanesOptions> newestDepth() const;

 private:
  /// Origin of an exception: the mapping, a callback of the host, or a rejected sample.
  enum class Fault { kMapping, kCallback, kEvents, kPose };
  using Batch = InputQueue::Batch;
  using Clock = std::chrono::steady_clock;

  // Functions of the worker: a caller's thread in playback, otherwise the mapper's thread.
  void workHere(Batch batch);
  void run();
  bool runOnce();
  void feed(Batch batch, std::exception_ptr& error);
  bool mapNext(std::exception_ptr& error);
  void endRun(std::exception_ptr error);
  void keep(StoredKeyframe keyframe);
  void forgetOldest();
  std::shared_ptr<MapSnapshot> makeSnapshot(bool with_points);
  std::shared_ptr<const MapSnapshot> newest(bool with_points);
  void publishState(std::exception_ptr& error);
  void publishMap(bool at_once, std::exception_ptr& error);
  std::vector<std::string> warningsOfSilence(const KeyframeDepthMap& keyframe);
  template <typename Step>
  bool attempt(std::exception_ptr& error, Fault fault, const char* doing, const Step& step);
  template <typename Call>
  void callBack(std::exception_ptr& error, const char* name, const Call& call);
  void warn(const std::string& text, std::exception_ptr& error);
  void noteError(const char* doing, Fault fault) noexcept;
  void warnOfLosses();

  const LiveOptions options_;
  const Callbacks callbacks_;
  const std::shared_ptr<const RigSetup> setup_;
  std::unique_ptr<InputQueue> queue_;  // null in playback: a batch is one sample
  std::atomic<bool> stopped_ = false;
  std::atomic<std::thread::id> worker_{};  // its thread in live operation
  std::mutex join_mutex_;                  // guards thread_

  // Guards the worker and the members below. It is held while a keyframe is made, and locked before
  // mutex_. In live operation only the mapper's thread locks it.
  mutable std::mutex session_mutex_;
  MappingSession session_;
  MapSnapshot map_so_far_;  // without points
  std::map<int, std::uint64_t> paused_events_;
  std::set<std::thread::id> delivering_;  // threads that are in a callback in playback
  std::set<int> silent_cameras_;          // cameras without events that were logged
  std::uint64_t logged_choices_ = 0;
  bool finished_ = false;

  // Members of the mapper's thread.
  bool map_changed_ = false;
  Clock::time_point map_renewed_;
  Clock::duration map_cost_{};
  Clock::time_point warned_;
  Clock::time_point rejection_logged_;
  std::set<std::string> logged_callbacks_;  // callbacks that threw and were logged
  std::uint64_t warned_losses_ = 0;
  std::uint64_t warned_dropped_windows_ = 0;
  std::uint64_t warned_failures_ = 0;
  std::shared_ptr<Mapper> self_;  // set by `make` until the thread ends: the owner may be gone

  mutable std::mutex mutex_;  // guards the members below; held for copies only
  std::condition_variable ended_changed_;
  DsiSink* sink_ = nullptr;
  ProcessorClock clock_ = processSeconds;
  SessionStatus status_;
  LiveStatus live_;
  std::shared_ptr<const MapSnapshot> map_;
  cv::Mat1f newest_depth_;
  DepthPlanesOptions newest_planes_;
  bool ended_ = false;
  std::exception_ptr end_error_;

  std::thread thread_;  // last member: it uses the others
};

/// p_world = T_world_ref * p_ref.
inline std::vector<CloudPoint> worldPointsOf(const StoredKeyframe& keyframe) {
  return pointsInWorld(*keyframe.points, keyframe.T_world_ref);
}

}  // namespace efm
