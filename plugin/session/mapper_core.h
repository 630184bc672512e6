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

#include "event_fusion/engine.h"
#include "mapping/events/event_checker.h"
#include "maps/cloud/keyframe_cloud.h"
#include "maps/cloud/map_point.h"
#include "plugin/recordings/streams/sample.h"
#include "plugin/session/health_checks.h"
#include "plugin/session/input_queue.h"
#include "plugin/session/mapping_session.h"
#include "plugin/session/pose_intake.h"
#include "plugin/session/recording_statistics.h"

namespace efm {

/// A mutex whose threads take turns: one that locks it again and again does not keep others out.
class TurnMutex {
 public:
  void lock() {
    std::unique_lock<std::mutex> lock(mutex_);
    const std::uint64_t turn = next_++;
    changed_.wait(lock, [&] { return turn == now_; });
  }
  void unlock() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ++now_;
    }
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t next_ = 0, now_ = 0;
};

/// The state of a Mapper. The thread of live operation shares it, so it may outlive the Mapper.
/// Functions without a comment are those of Mapper.
///
/// In playback, if a window cannot be mapped (no memory, a sink that throws), the next call tries
/// it again. If its keyframe cannot be stored, the window is dropped. A query waits while a
/// keyframe is made, but not while it is delivered. If several threads add samples, keyframes may
/// be delivered at the same time. Within a callback `add` and `finish` only take the input: the
/// caller of the callback maps it.
///
/// In live operation errors of the mapping, the refinement and the callbacks are counted and
/// logged; the window is dropped and the next one is tried. The snapshot of the map is renewed
/// after each keyframe, as long as this takes at most a twentieth of the time.
class MapperCore : public std::enable_shared_from_this<MapperCore> {
 public:
  using Callbacks = Mapper::Callbacks;

  explicit MapperCore(const EventFusionOptions& options, Callbacks callbacks,
                      const std::vector<StoredKeyframe>& earlier);
  /// Makes a mapper whose callbacks may drop the last reference to it: it ends after the callback.
  static std::shared_ptr<MapperCore> make(const EventFusionOptions& options, Callbacks callbacks,
                                          const std::vector<StoredKeyframe>& earlier);
  ~MapperCore();
  MapperCore(const MapperCore&) = delete;
  MapperCore& operator=(const MapperCore&) = delete;

  int addCamera(const RigCamera& camera);
  void addCameras(const Rig& rig);
  /// @param complete_until_ns see EventPacket.
  void addEvents(int camera, std::vector<Event> events,
                 std::optional<std::int64_t> complete_until_ns = std::nullopt);
  void add(Sample sample);
  /// Counts events that are not to be mapped. The windows that need them are dropped.
  void skip(int camera, const std::vector<Event>& events);
  void finish();
  void stop();
  /// Returns the options of the map, with the chosen voxel size.
  GlobalCloudOptions cloudOptions() const;
  /// Returns whether the caller is in the mapper's own thread: in a callback of live operation.
  bool runsHere() const { return std::this_thread::get_id() == worker_; }
  /// @param sink receives every fused plane; may be null. Not owned, and must not use the mapper.
  /// The current keyframe may still use the former sink.
  void setSink(DsiSink* sink);
  /// Tells what a first look of the host found.
  void setFacts(QualityFacts facts);
  /// @param clock measures the stages of the mapping; must not use the mapper. Default: the
  /// processor time of the process.
  void setClock(ProcessorClock clock);

  /// Returns the files of the rig that the options name.
  const RigSetup& setup() const { return *setup_; }
  SessionStatus status() const;
  std::vector<Warning> warnings();
  std::shared_ptr<const MapSnapshot> newest(bool with_points);
  std::size_t numKeyframes() const;
  /// Returns the newest keyframe's depth map (empty before the first one), and its depth planes.
  std::pair<cv::Mat1f, DepthPlanesOptions> newestDepth() const;

 private:
  /// Origin of an exception: the mapping, a callback of the host, or a rejected sample.
  enum class Fault { kMapping, kCallback, kEvents, kPose };
  using Batch = InputQueue::Batch;
  using Clock = std::chrono::steady_clock;

  // Functions of the worker: a caller's thread in playback, otherwise the mapper's thread.
  FusionMapperOptions usedOptions() const;
  void noteEnd(std::exception_ptr& error);
  void workHere(Batch batch);
  void fixRig(const Rig& given);
  void noteEvents(const EventPacket& packet, Batch& batch);
  void addRight(std::vector<PoseSample> poses, Batch& batch);
  void run();
  bool runOnce();
  void feed(Batch batch, std::exception_ptr& error);
  bool mapNext(std::exception_ptr& error);
  void endRun(std::exception_ptr error);
  void keep(StoredKeyframe keyframe);
  void forgetOldest();
  std::shared_ptr<MapSnapshot> makeSnapshot(bool with_points);
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

  const EventFusionOptions all_options_;
  const LiveOptions& options_ = all_options_.live;
  const bool checks_;
  const Callbacks callbacks_;
  const std::shared_ptr<const RigSetup> setup_;
  std::unique_ptr<InputQueue> queue_;  // null in playback: a batch is one sample
  std::atomic<bool> stopped_ = false;
  mutable std::mutex cameras_mutex_;       // guards the five members below
  Rig given_rig_;                          // as the host gave it
  std::vector<EventIntake> intakes_;       // one per camera, in playback
  PoseIntake pose_intake_;                 // as intakes_
  std::optional<TimeSpan> pose_times_;     // which confirm events
  bool rig_is_fixed_ = false;              // the session knows the cameras
  mutable std::mutex statistics_mutex_;    // guards statistics_; held for copies only
  RecordingStatistics statistics_;         // of the poses, and in playback of added events
  std::atomic<std::thread::id> worker_{};  // its thread in live operation
  std::mutex join_mutex_;                  // guards thread_

  // Guards the worker and the members below. It is held while a keyframe is made, and locked before
  // mutex_. In live operation only the mapper's thread locks it.
  mutable TurnMutex session_mutex_;
  MappingSession session_;
  MapSnapshot map_so_far_;  // without points
  std::map<int, std::uint64_t> paused_events_;
  std::set<std::thread::id> delivering_;  // threads that are in a callback in playback
  std::set<int> silent_cameras_;          // cameras without events that were logged
  std::uint64_t logged_choices_ = 0;
  bool blur_logged_ = false;
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
  std::shared_ptr<MapperCore> self_;  // set by `make` until the thread ends: the owner may be gone

  mutable std::mutex mutex_;  // guards the members below; held for copies only
  std::condition_variable ended_changed_;
  DsiSink* sink_ = nullptr;
  ProcessorClock clock_ = processSeconds;
  SessionStatus status_;
  PixelSizes pixel_sizes_;            // under mutex_
  FusionMapperOptions used_options_;  // in live operation: with the chosen options
  GlobalCloudOptions used_cloud_;     // as used_options_
  LiveStatus live_;
  std::shared_ptr<const MapSnapshot> map_;
  cv::Mat1f newest_depth_;
  DepthPlanesOptions newest_planes_;
  bool ended_ = false;
  std::exception_ptr end_error_;

  std::thread thread_;  // last member: it uses the others
};

}  // namespace efm
