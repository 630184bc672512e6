// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "event_fusion/engine.h"
#include "plugin/checks/health_checks.h"
#include "plugin/checks/recording_statistics.h"
#include "plugin/recordings/streams/sample.h"
#include "plugin/session/mapping_session.h"
#include "plugin/session_file/session_file.h"

namespace efm {

/// What is behind a Mapper: a session, its results so far, and the host's callbacks. PlaybackMapper
/// maps in the caller's thread, LiveMapper in a thread of its own. Functions without a comment are
/// those of Mapper. If a keyframe cannot be added to the map, its window
/// counts as dropped.
class MapperDriver : public std::enable_shared_from_this<MapperDriver> {
 public:
  using Callbacks = Mapper::Callbacks;

  /// Makes the driver for the options. Its callbacks may drop the last reference to it: it ends
  /// after the callback.
  /// @param facts what a first look of the host found.
  static std::shared_ptr<MapperDriver> make(const EventFusionOptions& options, Callbacks callbacks,
                                            const std::vector<StoredKeyframe>& earlier = {},
                                            QualityFacts facts = {});
  /// Makes the driver of a host other than the program: errors of this call and the log have
  /// hostText. The host wraps its other calls in `efm::forHost`, and calls `statusForHost`.
  static std::shared_ptr<MapperDriver> forHost(const EventFusionOptions& options,
                                               Callbacks callbacks,
                                               const std::vector<StoredKeyframe>& earlier);
  virtual ~MapperDriver() = default;
  MapperDriver(const MapperDriver&) = delete;
  MapperDriver& operator=(const MapperDriver&) = delete;

  int addCamera(const RigCamera& camera);
  void addCameras(const Rig& rig);
  /// @param complete_until_ns see EventPacket.
  void addEvents(int camera, std::vector<Event> events,
                 std::optional<std::int64_t> complete_until_ns = std::nullopt);
  void add(Sample sample);
  /// Counts events that are not to be mapped. The windows that need them are dropped.
  virtual void skip(int camera, const std::vector<Event>& events) = 0;
  virtual void finish() = 0;
  virtual void stop() = 0;
  /// In playback: `add` and `finish` only take the input from now on; `next` maps it.
  virtual void pullKeyframes() {}
  /// Maps the next complete window in playback, without callbacks of keyframes. std::nullopt: none.
  virtual std::optional<KeyframeDepthMap> next() { return std::nullopt; }
  /// Returns whether the caller is in the mapper's own thread: in a callback of live operation.
  virtual bool runsHere() const { return false; }
  /// @param sink receives every fused plane; may be null. Not owned, and must not use the mapper.
  /// The current keyframe may still use the former sink.
  void setSink(DsiSink* sink);

  /// Returns the files of the rig that the options name.
  const RigSetup& setup() const { return setup_; }
  virtual SessionStatus status() const = 0;
  SessionStatus statusForHost() const;
  std::vector<Warning> warnings();
  virtual std::shared_ptr<const MapSnapshot> newest(bool with_points) = 0;
  /// Returns the options in use, with the chosen values.
  virtual EventFusionOptions usedOptions() const = 0;
  /// Returns the newest keyframe's depth map (empty before the first one), and its depth planes.
  std::pair<cv::Mat1f, DepthPlanesOptions> newestDepth() const;

 protected:
  MapperDriver(const EventFusionOptions& options, Callbacks callbacks,
               const std::vector<StoredKeyframe>& earlier, QualityFacts facts, ChoiceBy choice_by);

  // Functions of the driver's two kinds.
  /// Gives the cameras to the session, or to the gate before it.
  virtual void useRig(const Rig& rig) = 0;
  virtual void useEvents(int camera, std::vector<Event> events,
                         std::optional<std::int64_t> complete_until_ns) = 0;
  virtual void usePacket(EventPacket packet) = 0;
  virtual void usePose(PoseSample pose) = 0;
  /// Returns what the check of own data has found.
  virtual void describeInput(RecordingCounts& /*counts*/) const {}
  virtual bool hasEnded() const = 0;

  // Functions for the thread that maps. The caller has locked the session.
  /// Adds input to the session.
  void feed(Input input);
  /// Maps the next window. After an exception the map so far is as before.
  std::optional<KeyframeDepthMap> mapWindow();
  /// Adds a keyframe to the session file, if the options name one. After an error it has no more.
  /// @throws std::runtime_error once, naming the file.
  void store(const KeyframeDepthMap& keyframe);
  /// Ends the session file. @throws as `store`.
  void endStored();
  /// Returns at most one warning per camera. The status counts the keyframes without its events.
  std::vector<std::string> warningsOfSilence(const KeyframeDepthMap& keyframe);

  /// What the log says of a new choice of options, and of the first blur.
  struct News {
    std::optional<SessionStatus> choice, blur;
    EventFusionOptions options;
  };
  News takeNews();
  /// Tells the host. @param say calls a callback of the log.
  using Say =
      std::function<void(const std::function<void(const std::string&)>&, const std::string&)>;
  void tell(const News& news, const Say& say) const;
  /// Tells the host of an input that made no keyframe or whose poses blur the events, and how good
  /// the map is.
  void tellOfEnd(const Say& say);

  const EventFusionOptions options_;
  const Callbacks callbacks_;
  const RigSetup setup_;
  MappingSession session_;
  const std::size_t earlier_;         // number of keyframes of the initial map
  mutable std::mutex cameras_mutex_;  // guards given_rig_ and rig_is_fixed_
  Rig given_rig_;                     // as the host gave it
  bool rig_is_fixed_ = false;         // the session knows the cameras
  mutable std::mutex copies_mutex_;   // guards statistics_ and the newest keyframe; for copies only
  RecordingStatistics statistics_;    // of the poses, and in playback of added events

 private:
  void fixRig(const Rig& given);

  template <typename Write>
  void writeStored(const Write& write);

  std::unique_ptr<SessionWriter> stored_;
  bool store_failed_ = false;
  std::set<int> silent_cameras_;  // cameras without events that were logged
  std::uint64_t told_news_ = 0, told_choices_ = 0;
  bool blur_told_ = false;

  // Under copies_mutex_.
  DsiSink* sink_ = nullptr;
  PixelSizes pixel_sizes_;
  cv::Mat1f newest_depth_;
  DepthPlanesOptions newest_planes_;
};

}  // namespace efm
