// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <variant>
#include <vector>

#include "mapping/keyframes/fusion_mapper.h"
#include "mapping/survey/option_choice.h"
#include "maps/cloud/global_cloud.h"
#include "maps/cloud/keyframe_cloud.h"
#include "plugin/session/event_fusion_options.h"
#include "plugin/session/first_look.h"
#include "plugin/session/input.h"
#include "plugin/session/map_quality.h"
#include "plugin/session/map_refinement.h"
#include "plugin/session/pose_source_selector.h"
#include "plugin/session/session_status.h"

namespace efm {

/// Turns packets of events and poses, in the order of a recording, into keyframes and the global
/// cloud: feeds the mapper and inserts its keyframes. Not thread-safe. Knows nothing of MRPT.
///
/// In playback, automatic options are chosen from the whole recording, with the same code as in
/// `event-fusion map`, which reads the recording twice. Nothing is mapped before `finish`, and all
/// events are kept in memory. If they need more than `[live] max_queue_mb`, the recording is a
/// stream: the options are chosen from the data so far, and then the depth limits follow the
/// keyframes.
///
/// Use: add the cameras, then data, and after each call `next` until it returns std::nullopt. At
/// the end call `finish`, and `next` again.
class MappingSession {
 public:
  explicit MappingSession(const EventFusionOptions& options);

  /// Adds input, in the order of time: first the cameras, all at once, which must be valid for
  /// `requireMappable`. `next` must have returned std::nullopt before input behind a break is
  /// added.
  ///
  /// Poses of one source are used: see PoseSourceSelector. The session waits for a better source
  /// until a packet begins over a second after the first one; in live operation not longer than the
  /// events fill half of the queue.
  ///
  /// When the next packet of a camera with missing events arrives, the windows that need them are
  /// dropped. If automatic options are not chosen yet, they are chosen from the data so far, in
  /// live operation if these last at least 0.2 s.
  /// @throws std::invalid_argument if a packet is older than earlier packets of its camera, or a
  /// pose is not valid or over a second older than another one.
  void add(Input input);
  /// Inserts a keyframe of an earlier map into the cloud, before the first new one.
  void insertEarlier(const std::vector<CloudPoint>& points, const Rigid3& T_world_ref);
  /// Ends the input.
  void finish();

  /// Receives a keyframe at its pose by the tracker, and its points in the cloud: the points of its
  /// fused map or, by option, of its cameras' maps.
  using KeyframeStore = std::function<void(const KeyframeDepthMap&, const std::vector<ViewPoint>&)>;
  /// Maps the next complete window, if there is one, and inserts it into the cloud. By option, the
  /// pose is refined, and the earlier keyframes that the refinement changes are moved. Data in the
  /// order of time may be added between calls: they change no complete window. After an exception
  /// the earlier keyframes are unchanged. If the refinement fails, the keyframe keeps the tracker's
  /// motion. Without a background thread, the call that finds no further window throws the error of
  /// the refinement.
  /// @param sink receives every fused plane; may be null.
  /// @param clock processor time of the threads that map.
  /// @param store called before the keyframe is inserted. If it throws, or this function throws
  /// after it, the keyframe is not inserted.
  /// @return the keyframe with its refined pose so far; std::nullopt if no window is complete.
  std::optional<KeyframeDepthMap> next(DsiSink* sink = nullptr,
                                       const ProcessorClock& clock = processSeconds,
                                       const KeyframeStore& store = {});

  /// Drops the oldest windows until at most this number of events is held, as long as newer events
  /// fill another window. If no window can be mapped, it is too large or waits for poses: then the
  /// windows of the older half of the events are dropped. If a window is larger than the queue of
  /// live operation and was chosen automatically, it is shortened instead.
  /// @throws std::invalid_argument if the user chose a window that is too large: the first time,
  /// and when it is much larger than at the last report.
  void limitHeld(double max_events);
  /// Drops the window whose mapping in `next` has thrown.
  /// @return true if a window was dropped; false if the error did not belong to a window.
  bool dropFailedWindow();

  /// Tells what was found about the recording before, if another first look was taken.
  void setFacts(QualityFacts facts) { facts_ = std::move(facts); }

  /// Moves all keyframes in the cloud to their refined poses.
  void applyPending();

  /// Returns the keyframes without points in the cloud: `[map] min_keyframe_quality`.
  const std::set<std::size_t>& leftOut() const { return left_out_; }
  const GlobalCloud& cloud() const { return cloud_.cloud(); }
  /// Return the poses of this session's keyframes, in order: in the cloud, and by the tracker.
  const std::vector<Rigid3>& T_world_ref() const { return cloud_.T_world_ref(); }
  const std::vector<Rigid3>& T_odom_ref() const { return T_odom_ref_; }
  /// Returns the depth planes of the newest keyframe, or for the first one if there is none.
  const DepthPlanesOptions& newestPlanes() const {
    return newest_planes_ ? *newest_planes_ : planes();
  }
  /// Returns the number of times that options were chosen.
  std::uint64_t choices() const { return status_.choices; }
  SessionStatus status() const;
  /// Returns the time until which the events of the selected cameras are complete.
  std::int64_t eventsCompleteNs() const { return mapper_.eventsCompleteNs(); }
  /// Returns the number of keyframes whose motion was corrected.
  std::uint64_t correctedKeyframes() const {
    return earlier_counts_.motion.corrected + mapper_.correctedKeyframes();
  }
  /// Returns the options in use; automatic options have their chosen values.
  const FusionMapperOptions& usedOptions() const { return options_.mapper; }
  /// Returns the options of the cloud: the voxel size is chosen at most once, for an empty cloud.
  const GlobalCloudOptions& cloudOptions() const { return options_.cloud; }

 private:
  const DepthPlanesOptions& planes() const {
    return depth_follower_ ? depth_follower_->planes() : options_.mapper.keyframe.planes;
  }
  bool hasCameras() const { return !mapper_.rig().cameras.empty(); }
  void addCameras(const Rig& rig);
  void addEvents(EventPacket packet);
  void addPose(const PoseSample& sample);
  void noteMissing(const Missing& missing);
  std::optional<std::int64_t> missingUntil(int camera) const;
  void dropMissing(int camera, std::int64_t next_ns);
  void dropOverdue(std::int64_t newest_begin_ns);
  void feed(EventPacket packet);
  void usePose(const StampedPose& pose);
  void useSelected();
  std::optional<PoseNoise> noiseAt(std::int64_t t_ns);
  void limitWaits();
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
  bool chooseFromFirstLook();
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

  void insert(KeyframeDepthMap& keyframe, const KeyframeStore& store);
  void leaveOutBad(std::size_t end);
  void moveKeyframes(double tolerance_m);

  AutomaticOptions automatic_;  // as the user gave them, without what stays as it is
  EventFusionOptions options_;  // `automatic`: the options that are still to be chosen
  PoseSourceSelector pose_source_;
  FusionMapper mapper_;
  MapperCounts earlier_counts_;            // counts of the mappers before clock resets
  std::unique_ptr<FirstLook> first_look_;  // set in playback until options are chosen
  bool first_look_ends_ = false;
  std::optional<DepthFollower> depth_follower_;  // set if depth limits are automatic
  std::optional<DepthPlanesOptions> newest_planes_;
  std::optional<std::int64_t> no_scene_since_ns_;
  std::size_t events_without_scene_ = 0;
  std::int64_t look_again_ns_ = kMinTimeNs;  // the next choice is not before this time
  std::int64_t look_interval_ns_ = 0;
  RefinedCloud cloud_;
  std::unique_ptr<MapRefinement> refinement_;  // set if poses are refined
  std::vector<Rigid3> T_odom_ref_;
  QualityFacts facts_;
  QualityStatistics quality_;
  std::size_t num_judged_ = 0;  // keyframes that are left out, or not
  std::set<std::size_t> left_out_;
  // Stated noise of the poses of each source, by the times of the poses.
  std::map<PoseSourceId, std::map<std::int64_t, std::optional<PoseNoise>>> noises_;
  std::optional<std::variant<Jump, ClockReset>> break_;  // the input goes on behind it
  std::map<int, Missing> missing_;                       // by camera
  LiveStatus live_;                                      // its breaks, rejected poses
  std::optional<std::int64_t> newest_pose_ns_;           // of the selected source
  bool finished_ = false;
  bool keyframe_lost_ = false;  // the last call of `next` made a keyframe and threw
  bool all_refined_ = false;
  std::optional<std::int64_t> newest_begin_ns_;  // of packets with events
  /// The poses between two jumps.
  struct Segment {
    std::int64_t begin_ns = kEndOfTimeNs;  // kEndOfTimeNs before the first event
    std::uint64_t keyframes = 0;           // number of keyframes before the segment
    int too_short = 0;  // number of consecutive earlier segments without room for a window
  };
  Segment segment_;
  double reported_needed_ = 0;  // events of a reported window that was too large
  SessionStatus status_;        // incomplete: see status()
};

}  // namespace efm
