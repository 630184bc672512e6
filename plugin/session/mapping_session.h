// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "mapping/keyframes/fusion_mapper.h"
#include "mapping/survey/option_choice.h"
#include "maps/cloud/global_cloud.h"
#include "maps/cloud/keyframe_cloud.h"
#include "plugin/session/event_fusion_options.h"
#include "plugin/session/first_look.h"
#include "plugin/session/live_guard.h"
#include "plugin/session/map_refinement.h"
#include "plugin/session/pose_source_selector.h"
#include "plugin/session/rig_assembly.h"
#include "plugin/session/session_status.h"

namespace efm {

/// Turns packets of events and poses, in the order of a recording, into keyframes and the global
/// cloud: puts the rig together as its cameras appear, feeds the mapper and inserts its keyframes.
/// Not thread-safe. Knows nothing of MRPT.
///
/// In playback, automatic options are chosen from the whole recording, with the same code as
/// `event-fusion map`, which reads the recording twice. Nothing is mapped before `finish`, and all
/// events are kept in memory. If they need more than `[live] max_queue_mb`, the recording is a
/// stream: the options are chosen from the data so far, and then the depth limits follow the
/// keyframes.
///
/// Use: add data, and after each call `next` until it returns nothing; at the end `finish`, and
/// `next` again.
class MappingSession {
 public:
  explicit MappingSession(const EventFusionOptions& options);

  /// Nothing is mapped before the rig is complete: see RigAssembly::isReady. In live operation it
  /// is complete before its events fill half of the queue.
  /// @throws std::invalid_argument where the packet contradicts its sensor or earlier packets;
  /// where its camera first appears in a complete rig, or waits for one of a lower index for more
  /// than a second of events; where the options name a camera that the rig does not have.
  void addEvents(EventPacket packet);
  /// Poses of one source are used: see PoseSourceSelector. The session waits for a better source
  /// until the rig is complete.
  void addPose(const PoseSample& sample);
  /// Inserts a keyframe of an earlier map into the cloud, before the first new one.
  void insertEarlier(const std::vector<CloudPoint>& points, const Rigid3& T_world_ref);
  /// No more data will come.
  /// @throws std::invalid_argument where a camera's events came, but none of one of a lower index.
  /// The other cameras are mapped all the same.
  void finish();

  /// Receives a keyframe at its pose by the tracker, and its points in the cloud: those of its
  /// fused map, or by option of its cameras' maps.
  using KeyframeStore = std::function<void(const KeyframeDepthMap&, const std::vector<ViewPoint>&)>;
  /// Maps the next window that is covered, if there is one, and inserts it into the cloud. If an
  /// option says so, the pose is refined, and the earlier keyframes that the refinement changes are
  /// moved. Data in the order of time may be added in between: they change no window that is
  /// covered. After an exception the earlier keyframes are unchanged. If the refinement fails, the
  /// keyframe keeps the tracker's motion; without a background thread, the call that finds no
  /// further window throws that error.
  /// @param sink receives every fused plane; may be null.
  /// @param clock the processor time of the threads that map.
  /// @param store called before the keyframe is inserted. If it throws, the keyframe is not
  /// inserted. If this function throws after it, the keyframe is not inserted either.
  /// @return the keyframe with its refined pose, as known now.
  std::optional<KeyframeDepthMap> next(DsiSink* sink = nullptr,
                                       const ProcessorClock& clock = processSeconds,
                                       const KeyframeStore& store = {});

  /// Reports that events of a camera are missing. When the camera's next packet arrives, the
  /// windows that need the missing events are dropped. If automatic options are not chosen yet,
  /// they are chosen from the data so far, in live operation if these last at least 0.2 s.
  void noteMissing(int camera, const MissingEvents& missing);
  /// Drops the oldest windows until at most so many events are held, as long as newer events fill
  /// another window. If no window can be mapped, it is too large or waits for poses: then the
  /// windows of the older half of the events are dropped. If a window is larger than the queue of
  /// live operation, a chosen one is shortened instead.
  /// @throws std::invalid_argument if a given window is so large: the first time, and if it is much
  /// larger than when this was last reported.
  void limitHeld(double max_events);
  /// After `next` has thrown: drops the window that it was mapping.
  /// @return true if a window was dropped; false if the error did not belong to a window.
  bool dropFailedWindow();

  /// Moves all keyframes in the cloud to their refined poses.
  void applyPending();

  const GlobalCloud& cloud() const { return cloud_.cloud(); }
  /// The poses of this session's keyframes, in their order: in the cloud, and by the tracker.
  const std::vector<Rigid3>& T_world_ref() const { return cloud_.T_world_ref(); }
  const std::vector<Rigid3>& T_odom_ref() const { return T_odom_ref_; }
  /// The depth planes of the newest keyframe (of the first one if there is none), and how often
  /// options were chosen.
  struct Chosen {
    DepthPlanesOptions planes;
    std::uint64_t choices = 0;
  };
  Chosen chosen() const { return {newest_planes_.value_or(planes()), status_.choices}; }
  SessionStatus status() const;

 private:
  const DepthPlanesOptions& planes() const {
    return depth_follower_ ? depth_follower_->planes() : options_.mapper.keyframe.planes;
  }
  std::size_t heldEvents() const { return mapper_.heldEvents() + guard_.heldEvents(); }
  void feed(EventPacket packet);
  void completeRig();
  void usePose(const NoisyPose& pose);
  void useWaiting(const std::vector<NoisyPose>& poses);
  void useSelected();
  void finishMapper();
  std::optional<PoseNoise> noiseAt(std::int64_t t_ns);
  void limitWaits();
  // A piece of the input has one clock, and no jump of the tracker.
  bool segmentEnds() const;
  bool beginSegment();
  bool beginClock();
  void restartMapper();
  bool pieceEnds() const { return segmentEnds() || guard_.clockWentBack(); }
  bool endPiece() { return beginSegment() || beginClock(); }
  // What waits beyond the queue.
  std::optional<Window> nextWindow();
  bool dropOldestWindow();
  void dropOlderHalf();
  // In automatic_choice.cpp.
  bool chooseAutomatic();
  bool chooseFromFirstLook();
  bool chooseFromSoFar(double at_least_s);
  void useLook(const std::optional<WindowData>& data, OptionChoice choice,
               FusionMapperOptions chosen);
  void use(OptionChoice choice, const FusionMapperOptions& chosen);
  std::optional<WindowData> dataToChooseFrom();
  bool hasWaitedTooLong();
  bool skipWithoutScene(const WindowData& data);
  bool applyShorterWindow(double former_s);
  bool shortenWindows(double events_per_s);
  void fitIntoSegments(std::int64_t end_ns);
  void lookAgain(const Window& window);

  void insert(KeyframeDepthMap& keyframe, const KeyframeStore& store);
  void moveKeyframes(double tolerance_m);

  const AutomaticOptions automatic_;  // as they were given
  EventFusionOptions options_;        // automatic: those that are to be chosen now
  RigAssembly rig_;
  PoseSourceSelector pose_source_;
  LiveGuard guard_;
  FusionMapper mapper_;
  MapperCounts earlier_counts_;            // of mappers before a clock reset
  std::unique_ptr<FirstLook> first_look_;  // in playback, until options are chosen
  bool first_look_ends_ = false;
  std::optional<DepthFollower> depth_follower_;  // where depth limits are automatic
  std::optional<DepthPlanesOptions> newest_planes_;
  std::optional<std::int64_t> no_scene_since_ns_;
  std::size_t events_without_scene_ = 0;
  std::int64_t look_again_ns_ = kMinTimeNs;  // not before
  std::int64_t look_interval_ns_ = 0;
  RefinedCloud cloud_;
  std::unique_ptr<MapRefinement> refinement_;  // where poses are refined
  std::vector<Rigid3> T_odom_ref_;
  // The stated noise of the poses of each source, by their times.
  std::map<PoseSourceId, std::map<std::int64_t, std::optional<PoseNoise>>> noises_;
  bool finished_ = false;
  bool keyframe_lost_ = false;  // the last call of `next` made one and threw
  bool all_refined_ = false;
  std::optional<std::int64_t> newest_begin_ns_;  // of packets with events
  /// The poses between two jumps.
  struct Segment {
    std::int64_t begin_ns = kEndOfTimeNs;  // before the first event: not known
    std::uint64_t keyframes = 0;           // before it
    int too_short = 0;                     // earlier ones in a row that no window fitted into
  };
  Segment segment_;
  double reported_needed_ = 0;  // the events of a window that was too large
  SessionStatus status_;        // incomplete: see status()
};

}  // namespace efm
