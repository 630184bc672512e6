// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "mapping/keyframes/fusion_mapper.h"
#include "mapping/survey/option_choice.h"
#include "maps/cloud/global_cloud.h"
#include "maps/cloud/keyframe_cloud.h"
#include "plugin/session/event_fusion_options.h"
#include "plugin/session/input.h"
#include "plugin/session/map_quality.h"
#include "plugin/session/map_refinement.h"
#include "plugin/session/map_snapshot.h"
#include "plugin/session/pose_source_selector.h"
#include "plugin/session/session_status.h"

namespace efm {

/// Who chooses automatic options. kSession: the session, as soon as its data show the scene.
/// kCaller: the caller, by NewOptions; until then the session only stores.
enum class ChoiceBy { kSession, kCaller };

/// Turns packets of events and poses, in the order of time, into keyframes and the global cloud:
/// feeds the mapper and inserts its keyframes. Not thread-safe. Knows nothing of MRPT.
///
/// Use: add the cameras, then data, and after each call `next` until it returns std::nullopt. At
/// the end call `finish`, and `next` again.
class MappingSession {
 public:
  /// @param earlier keyframes of an earlier map: they are in the cloud before the first new one.
  /// @param facts what was found about the recording before.
  explicit MappingSession(const EventFusionOptions& options,
                          const std::vector<StoredKeyframe>& earlier = {}, QualityFacts facts = {},
                          ChoiceBy choice_by = ChoiceBy::kSession);

  /// Adds input, in the order of time: first the cameras, all at once, which must be valid for
  /// `requireMappable`. `next` must have returned std::nullopt before input behind a break is
  /// added.
  ///
  /// Poses of one source are used: see PoseSourceSelector. The session waits for a better source
  /// until a packet begins over a second after the first one, or `limitHeld` is called with as many
  /// events as fill half of the queue.
  ///
  /// When the next packet of a camera with missing events arrives, the windows that need them are
  /// dropped. After `kOverload`, automatic options are chosen from the data so far, if these last
  /// at least 0.2 s.
  /// @throws std::invalid_argument if a packet is older than earlier packets of its camera, or a
  /// pose is not valid or over a second older than another one.
  void add(Input input);
  /// Ends the input. @throws the first error of a pose that waited for its source: it is rejected,
  /// the others are used.
  void finish();

  /// Maps the next complete window, if there is one, and inserts it into the cloud. By option, the
  /// pose is refined, and the earlier keyframes that the refinement changes are moved. Data in the
  /// order of time may be added between calls: they change no complete window. After an exception
  /// the map is as before. If the refinement fails, the keyframe keeps the tracker's motion.
  /// Without a background thread, the call that finds no further window throws the error of the
  /// refinement.
  /// @param sink receives every fused plane; may be null.
  /// @return the keyframe with its refined pose so far; std::nullopt if no window is complete.
  std::optional<KeyframeDepthMap> next(DsiSink* sink = nullptr);
  /// Drops the window whose mapping in `next` has thrown.
  /// @return true if a window was dropped; false if the error did not belong to a window.
  bool dropFailedWindow();
  /// Drops the oldest windows until at most this number of events is held, as long as newer events
  /// fill another window. If no window can be mapped, it is too large or waits for poses: then the
  /// windows of the older half of the events are dropped. If a window is larger than the queue of
  /// live operation and was chosen automatically, it is shortened instead.
  /// @throws std::invalid_argument if the user chose a window that is too large: the first time,
  /// and when it is much larger than at the last report.
  void limitHeld(double max_events);
  /// Limits the time that events and poses wait for each other, once `next` finds no window: drops
  /// the windows whose poses are overdue, and treats overdue events as silence.
  void limitWaits();

  /// Returns the map so far, with the refined poses. Never null.
  /// @param with_points whether it has the points of the cloud.
  std::shared_ptr<MapSnapshot> snapshot(bool with_points);
  /// Returns what changes with each input and keyframe. `live` has breaks and losses so far.
  SessionStatus status() const;
  /// Returns the options in use; those that are still to be chosen are `automatic`.
  const EventFusionOptions& options() const { return options_; }
  /// Returns a number that grows when options are chosen, and when the motion of the first keyframe
  /// is corrected.
  std::uint64_t news() const {
    const bool corrects = earlier_counts_.motion.corrected + store_.mapper.correctedKeyframes() > 0;
    return status_.choices + (corrects ? 1 : 0);
  }
  /// Returns the time until which the events of the selected cameras are complete.
  std::int64_t eventsCompleteNs() const { return store_.mapper.eventsCompleteNs(); }

 private:
  /// The poses between two jumps.
  struct Segment {
    std::int64_t begin_ns = kEndOfTimeNs;  // kEndOfTimeNs before the first event
    std::uint64_t keyframes = 0;           // number of keyframes before the segment
    int too_short = 0;  // number of consecutive earlier segments without room for a window
  };
  /// What belongs to one clock. A clock reset replaces it as a whole.
  struct EventStore {
    explicit EventStore(const FusionMapperOptions& options) : mapper(options) {}

    FusionMapper mapper;                          // held events, filters, poses
    std::optional<TimeSpan> events;               // times on the clock of the poses
    std::optional<std::int64_t> newest_begin_ns;  // of packets with events
    std::optional<std::int64_t> newest_pose_ns;   // of the selected source
    // Stated noise of the poses of each source, by the times of the poses.
    std::map<PoseSourceId, std::map<std::int64_t, std::optional<PoseNoise>>> noises;
    std::map<int, Missing> missing;  // by camera
    Segment segment;
    std::optional<std::int64_t> no_scene_since_ns;
    std::size_t events_without_scene = 0;
    std::int64_t look_again_ns = kMinTimeNs;  // the next choice is not before this time
  };

  const DepthPlanesOptions& planes() const {
    return depth_follower_ ? depth_follower_->planes() : options_.mapper.keyframe.planes;
  }
  bool hasCameras() const { return !store_.mapper.rig().cameras.empty(); }
  void addCameras(const Rig& rig);
  void addEvents(EventPacket packet);
  void addPose(const PoseSample& sample);
  void noteMissing(const Missing& missing);
  std::optional<std::int64_t> missingUntil(int camera) const;
  void dropMissing(int camera, std::int64_t next_ns);
  void dropOverdue(std::int64_t newest_begin_ns);
  void feed(EventPacket packet);
  std::string usePoses(const std::vector<StampedPose>& poses);
  void useSelected();
  std::optional<PoseNoise> noiseAt(std::int64_t t_ns);
  // A piece of the input has one clock, and no jump of the tracker.
  bool pieceEnds() const { return break_.has_value(); }
  bool endPiece();
  void restartMapper();
  // Functions that limit the held events.
  std::optional<Window> nextWindow();
  bool dropOldestWindow();
  void dropOlderHalf();
  // Functions in automatic_choice.cpp.
  bool chooseAutomatic();
  void use(NewOptions given);
  bool chooseFromSoFar(double at_least_s);
  Chosen chooseFrom(const std::optional<WindowData>& data, std::optional<double> duration_s) const;
  void useLook(const std::optional<WindowData>& data, Chosen looked);
  void use(OptionChoice choice, const FusionMapperOptions& chosen);
  std::optional<WindowData> dataToChooseFrom();
  bool hasWaitedTooLong();
  bool skipWithoutScene(const WindowData& data);
  bool applyShorterWindow(double former_s);
  bool shortenWindows(double events_per_s);
  void fitIntoSegments(std::int64_t end_ns);
  void lookAgain(const Window& window);

  void insert(KeyframeDepthMap& keyframe);
  void keep(StoredKeyframe keyframe);
  void forgetOldest();
  void leaveOutBad(std::size_t end);
  const MapQuality& mapQuality() const;
  void moveKeyframes(double tolerance_m);

  AutomaticOptions automatic_;  // as the user gave them, without what stays as it is
  EventFusionOptions options_;  // `automatic`: the options that are still to be chosen
  PoseSourceSelector pose_source_;
  EventStore store_;
  MapperCounts earlier_counts_;  // counts of the mappers before clock resets
  bool waits_for_options_;
  std::optional<DepthFollower> depth_follower_;  // set if depth limits are automatic
  std::int64_t look_interval_ns_ = 0;
  RefinedCloud cloud_;
  std::unique_ptr<MapRefinement> refinement_;  // set if poses are refined
  MapSnapshot map_;  // without points; the poses are refined by `snapshot`
  QualityFacts facts_;
  QualityStatistics quality_;
  mutable MapQuality map_quality_;                       // see mapQuality()
  std::set<std::size_t> left_out_;                       // keyframes without points in the cloud
  std::optional<std::variant<Jump, ClockReset>> break_;  // the input goes on behind it
  LiveStatus live_;                                      // breaks, rejected poses
  bool finished_ = false;
  bool keyframe_lost_ = false;  // the last call of `next` made a keyframe and threw
  bool all_refined_ = false;
  std::string waiting_error_;   // why the first pose that waited for its source was rejected
  double reported_needed_ = 0;  // events of a reported window that was too large
  SessionStatus status_;        // incomplete: see status()
};

}  // namespace efm
