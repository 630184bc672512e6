// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "mapping/keyframes/fusion_mapper.h"
#include "mapping/survey/option_choice.h"
#include "maps/cloud/global_cloud.h"
#include "maps/cloud/keyframe_cloud.h"
#include "plugin/session/event_fusion_options.h"
#include "plugin/session/map_refinement.h"
#include "plugin/session/pose_source_selector.h"
#include "plugin/session/rig_assembly.h"
#include "plugin/session/session_status.h"

namespace efm {

/// Events of a camera that are not there, until a time on its clock, and why.
struct MissingEvents {
  std::int64_t until_ns = std::numeric_limits<std::int64_t>::min();
  GiveUpReason reason = &WindowsGivenUp::overload;
};

class RecordingSurveyor;

/// Turns packets of events and poses, in the order of a recording, into keyframes and the global
/// cloud: puts the rig together as its cameras appear, feeds the mapper and inserts its keyframes.
/// Not thread-safe. Knows nothing of MRPT.
///
/// In playback, automatic options are chosen from the whole recording, by the code that chooses
/// them for a program that reads it twice: nothing is mapped before `finish`, and all events are
/// held. A recording with more events than `[live] max_queue_mb` holds is a stream: the options are
/// chosen from what is there, and then the depth limits follow the keyframes.
///
/// Use: add data, and after each call `next` until it returns nothing; at the end `finish`, and
/// `next` again.
class MappingSession {
 public:
  explicit MappingSession(const EventFusionOptions& options);
  ~MappingSession();

  /// The rig is complete with the first event if its cameras are known (RigAssembly::isKnown) and
  /// the source of poses is selected; otherwise once a packet begins more than a second after the
  /// recording's first event, whatever the length of packets, and in live operation before half of
  /// the queue is full.
  /// @throws std::invalid_argument where the packet contradicts its sensor or earlier packets;
  /// where its camera first appears in a complete rig, or waits for one of a lower index for more
  /// than a second of events; where the options name a camera that the rig does not have.
  void addEvents(EventPacket packet);
  /// Poses of one source are used: see PoseSourceSelector. The session waits for a better source
  /// until the rig is complete.
  /// @param noise the standard deviations that the tracker states for the pose.
  void addPose(const StampedPose& pose, const PoseSourceId& source = {},
               const std::optional<PoseNoise>& noise = std::nullopt);
  /// Inserts a keyframe of an earlier map into the cloud, before the first new one.
  void insertEarlier(const std::vector<CloudPoint>& points, const Rigid3& T_world_ref);
  /// Chooses automatic options from the data so far.
  void endSurvey() { survey_ends_ = true; }
  /// No more data will come.
  /// @throws std::invalid_argument where a camera's events came, but none of one of a lower index.
  /// The other cameras are mapped all the same.
  void finish();

  using KeyframeStore = std::function<void(const KeyframeDepthMap&)>;
  /// Maps the next window that is covered, if there is one, and inserts it into the cloud. By
  /// option refines its pose, and moves the keyframes that this moves. Data in the order of time
  /// may be added in between: they change no window that is covered. Where this throws, the earlier
  /// keyframes stay as they are. Where a refinement fails, its keyframe is returned with the
  /// tracker's motion. Without the background thread the call that finds no further window throws
  /// the error then.
  /// @param sink receives every fused plane; may be null.
  /// @param clock the processor time of the threads that map.
  /// @param store called with the keyframe, at its pose by the tracker, before it is inserted. If
  /// it throws, the keyframe is not inserted. If this function throws after it, the keyframe is not
  /// inserted either.
  /// @return the keyframe with its refined pose, as known now.
  std::optional<KeyframeDepthMap> next(DsiSink* sink = nullptr,
                                       const ProcessorClock& clock = processSeconds,
                                       const KeyframeStore& store = {});

  /// The points of a keyframe in the cloud: of its fused map, or by option of its cameras' maps.
  std::vector<ViewPoint> pointsOf(const KeyframeDepthMap& keyframe) const;

  /// Instead of `next`, for a first pass over a recording: the data of the next window, which is
  /// not mapped. See FusionMapper::window.
  std::optional<WindowData> window();
  void skipWindow(const Window& window) { mapper_.skipWindow(window); }

  /// Counts a packet that is not to be mapped, and gives up its windows.
  void skipEvents(const EventPacket& packet);
  /// Says that events of a camera are missing: the windows that lack them are given up once the
  /// next data are there, which also tell where a time was wrong.
  void noteMissing(int camera, const MissingEvents& missing);
  /// Gives up the oldest window that could be mapped, if newer events fill another one.
  /// @return whether it did.
  bool giveUpOldestWindow();
  /// Gives up the windows of the older half of the events. Where a window is larger than the queue
  /// of live operation, a chosen one is shortened instead.
  /// @throws std::invalid_argument where a given one is so large: the first time, and where it is
  /// much larger than when it was told last.
  void giveUpOlderHalf();
  /// Where automatic options wait for their first window: chooses them from the data so far, if
  /// these last at least so long.
  /// @return whether it chose.
  bool chooseFromSoFar(double at_least_s);
  /// The next window that is covered, if there is one.
  std::optional<Window> nextWindow();
  /// After `next` has thrown: gives up the window that it was mapping.
  /// @return whether it goes on to another window. Otherwise it was none that failed.
  bool giveUpFailed();
  /// The events that windows may still need.
  std::size_t heldEvents() const { return mapper_.heldEvents() + later_events_; }

  /// Moves all keyframes in the cloud to their refined poses.
  void applyPending();

  const GlobalCloud& cloud() const { return cloud_.cloud(); }
  /// The depth planes of the next keyframe.
  const DepthPlanesOptions& planes() const {
    return depth_follower_ ? depth_follower_->planes() : options_.mapper.keyframe.planes;
  }
  /// The poses of this session's keyframes, in their order: in the cloud, and by the tracker.
  const std::vector<Rigid3>& T_world_ref() const { return cloud_.T_world_ref(); }
  const std::vector<Rigid3>& T_odom_ref() const { return T_odom_ref_; }
  /// The files of the options.
  const RigSetup& setup() const { return rig_.setup(); }
  /// See SessionStatus.
  std::uint64_t choices() const { return status_.choices; }
  SessionStatus status() const;

 private:
  static FusionMapperOptions mapperOptions(const EventFusionOptions& options);
  void feed(EventPacket packet);
  bool seenFor(std::int64_t duration_ns) const;
  bool fillsQueue() const;
  void completeRig();
  void noteOlder(int sensor, std::int64_t t_ns);
  void noteInTime(int sensor, std::int64_t t_ns);
  void startAnew();
  void usePoses(const std::vector<StampedPose>& poses, const std::optional<PoseNoise>& noise);
  void useWaiting(const StampedPose& pose, const std::optional<PoseNoise>& noise);
  bool isJump(const StampedPose& pose, const PoseNoise& noise) const;
  bool stretchEnds() const;
  bool beginStretch();
  bool beginClock();
  void finishMapper();
  /// No more data of the current poses, or of the current clock, will come.
  bool pieceEnds() const { return stretchEnds() || clock_reset_; }
  bool endPiece() { return beginStretch() || beginClock(); }
  std::optional<std::int64_t> missingUntil(int camera) const;
  void giveUpMissing(int camera, std::int64_t next_ns);
  void giveUpOverdue();
  void limitWaits();
  std::optional<PoseNoise> noiseAt(std::int64_t t_ns);
  // In automatic_choice.cpp.
  bool chooseAutomatic();
  bool chooseFromSurvey();
  void useLook(const std::optional<WindowData>& data, OptionChoice choice,
               FusionMapperOptions chosen);
  void use(OptionChoice choice, const FusionMapperOptions& chosen);
  std::optional<WindowData> firstLook();
  bool looksTooLong();
  bool skipWithoutScene(const WindowData& data);
  bool useShorter(double former_s);
  bool shortenWindows(double events_per_s);
  void fitIntoStretches(std::int64_t end_ns);
  void keepOptions();
  void lookAgain(const Window& window);

  void insert(KeyframeDepthMap& keyframe, const KeyframeStore& store);
  void moveKeyframes(double tolerance_m);

  const AutomaticOptions automatic_;  // as they were given
  EventFusionOptions options_;        // automatic: those that are to be chosen now
  RigAssembly rig_;
  PoseSourceSelector pose_source_;
  FusionMapper mapper_;
  MapperCounts earlier_counts_;                  // of mappers before a step of the clock
  std::unique_ptr<RecordingSurveyor> surveyor_;  // in playback, until options are chosen
  bool survey_ends_ = false;
  std::optional<DepthFollower> depth_follower_;  // where depth limits are automatic
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
  std::optional<StampedPose> newest_pose_;       // of the selected source, as the tracker has it
  // Poses after a jump with their stated noise, until those before it are used up.
  std::vector<std::pair<StampedPose, std::optional<PoseNoise>>> next_stretch_;
  /// The poses between two jumps.
  struct Stretch {
    std::int64_t begin_ns = kEndOfTimeNs;  // before the first event: not known
    std::uint64_t keyframes = 0;           // before it
    int too_short = 0;                     // those before it that no window fitted into, in a row
  };
  Stretch stretch_;
  /// A sensor that sends older data than before.
  struct Older {
    std::int64_t since_ns;
    std::map<int, std::int64_t> others_ns;  // cameras that go on, and until when
  };
  std::map<int, Older> older_;            // by camera, or the tracker
  std::map<int, MissingEvents> missing_;  // by camera
  /// A clock went back: what came afterwards waits until the complete windows before are mapped.
  bool clock_reset_ = false;
  std::vector<std::function<void()>> later_;
  std::size_t later_events_ = 0;
  double told_needed_ = 0;  // the events of a window that was too large
  SessionStatus status_;    // incomplete: see status()
};

}  // namespace efm
