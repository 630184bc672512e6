// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mapping/keyframes/fusion_mapper.h"
#include "maps/cloud/global_cloud.h"
#include "maps/cloud/keyframe_cloud.h"
#include "maps/cloud/refined_cloud.h"
#include "plugin/session/event_fusion_options.h"
#include "plugin/session/map_refinement.h"
#include "plugin/session/pose_source_selector.h"
#include "plugin/session/rig_setup.h"
#include "plugin/session/stage_timer.h"

namespace efm {

/// First and last time of what came in, on the trajectory's clock.
struct TimeSpan {
  std::int64_t first_ns = 0;
  std::int64_t last_ns = 0;
};

/// A stretch of one camera's recording.
struct CameraPacket {
  int camera = 0;         ///< Index in the rig.
  RigCamera calibration;  ///< The same in all packets of a camera; the options may replace it.
  std::vector<Event> events;
  /// Everything that the camera saw before this time (its own clock) has been given by now.
  std::optional<std::int64_t> covered_until_ns;
};

/// What a session was given and did so far.
struct SessionStatus {
  MapperCounts counts;   ///< Complete after `finish`.
  StageSeconds seconds;  ///< sweep, depth and map; the rest is the caller's.
  std::optional<TimeSpan> events;
  std::optional<TimeSpan> poses;
  std::optional<PoseOrigin> pose_source;            ///< Whose poses are used.
  std::map<PoseOrigin, std::uint64_t> other_poses;  ///< Of other sources: not used.
  std::vector<std::uint64_t> silent_keyframes;      ///< Per camera: those that it had no event for.
  Rig rig;  ///< The cameras that have appeared, as the options refit them.
  std::optional<RefinementState> refinement;  ///< Where poses are refined.
};

/// From packets of events and poses, in the order of a recording, to keyframes and the global
/// cloud: puts the rig together as its cameras appear, feeds the mapper and collects what it makes.
/// Not thread-safe. Knows nothing of MRPT.
///
/// Use: add, and after each `next` until it gives nothing; at the end `finish`, and `next` again.
class MappingSession {
 public:
  /// @throws std::invalid_argument where the options are not valid; std::runtime_error naming a
  /// file that they name and that cannot be read.
  explicit MappingSession(const EventFusionOptions& options);

  /// The rig is complete once a packet begins more than a second after the recording's first event,
  /// however long packets are.
  /// @throws std::invalid_argument where the packet contradicts its sensor or those before it, or
  /// its camera first appears when the rig is complete, or waits for one of a lower index for more
  /// than a second of events; or where the options name a camera that the rig does not have.
  void addEvents(CameraPacket packet);
  /// Poses of one source are used, see PoseChoice; a better one is waited for until the rig is
  /// complete.
  /// @param noise what the tracker says that the pose errs by.
  /// @throws std::invalid_argument where the pose is not finite.
  void addPose(const StampedPose& pose, const PoseOrigin& origin = {},
               const std::optional<PoseNoise>& noise = std::nullopt);
  /// Puts a keyframe of an earlier map into the cloud, before those to come.
  /// @throws std::invalid_argument as GlobalCloud::insert does.
  void insertEarlier(const std::vector<CloudPoint>& points, const Rigid3& T_world_ref);
  /// Somebody asks for the map: takes the rig to be complete where a packet began more than a tenth
  /// of a second after the first event and the source of poses is chosen, so that a short recording
  /// need not be finished to be mapped. Changes no keyframe; a camera that first appears later is
  /// an error already.
  /// @throws std::invalid_argument where the options name a camera that the rig does not have.
  void completeEarly();
  /// No more will come.
  /// @throws std::invalid_argument where a camera's events came but none of one before it: what can
  /// be mapped without can be mapped all the same.
  void finish();

  /// Maps the next window that is covered, if there is one, and puts it into the cloud; by option
  /// refines its pose, and moves the keyframes that this moves. Data in the order of time may be
  /// added in between: it changes no window that is covered. Where this throws, the keyframes
  /// before it stay as they are.
  /// @param sink receives every fused plane where given.
  /// @return T_world_ref is the refined pose as far as it is known now.
  std::optional<KeyframeDepthMap> next(DsiSink* sink = nullptr);

  /// The points that a keyframe has in the cloud: of its fused map, or by option of its cameras'.
  std::vector<ViewPoint> pointsOf(const KeyframeDepthMap& keyframe) const;

  /// Moves the keyframes in the cloud that the refinement has moved and that are not there yet.
  void settle();

  const GlobalCloud& cloud() const { return cloud_.cloud(); }
  /// Where the keyframes of this session stand in the cloud, by their order; and where the tracker
  /// put them.
  const std::vector<Rigid3>& T_world_ref() const { return cloud_.T_world_ref(); }
  const std::vector<Rigid3>& T_odom_ref() const { return T_odom_ref_; }
  /// What the options say of the rig.
  const RigSetup& setup() const { return setup_; }
  /// Of those that are used, as the tracker has it.
  const std::optional<StampedPose>& newestPose() const { return newest_pose_; }
  SessionStatus status() const;

 private:
  void refit(CameraPacket& packet) const;
  int numCameras() const;
  void refuseOnceComplete(int camera) const;
  [[noreturn]] void refuseWithoutNext(int camera) const;
  void letWait(CameraPacket packet);
  void addCameras(CameraPacket first);
  void addCamera(const RigCamera& camera);
  void feed(CameraPacket packet);
  bool seenFor(std::int64_t duration_ns) const;
  void completeRig();
  void take(const std::vector<StampedPose>& poses);
  std::optional<PoseNoise> noiseAt(std::int64_t t_ns);
  void place(KeyframeDepthMap& keyframe);
  void follow(double tolerance_m);

  EventFusionOptions options_;
  RigSetup setup_;

  FusionMapper mapper_;
  RefinedCloud cloud_;
  std::unique_ptr<MapRefinement> refinement_;  // where poses are refined
  std::vector<Rigid3> T_odom_ref_;
  // That poses of each source may have, by their time.
  std::map<PoseOrigin, std::map<std::int64_t, std::optional<PoseNoise>>> noises_;
  bool finished_ = false;
  bool all_refined_ = false;
  PoseChoice pose_choice_;
  bool rig_complete_ = false;
  // Per camera, for those of a lower index to appear; since their first event.
  std::map<int, std::vector<CameraPacket>> waiting_;
  std::optional<std::int64_t> waiting_since_ns_;
  std::optional<std::int64_t> newest_begin_ns_;  // of packets with events
  std::optional<StampedPose> newest_pose_;
  SessionStatus status_;  // counts: see status()
};

/// Says in a sentence why a session that is finished made no keyframe: no events, no poses, poses
/// and events that miss each other (by how much), nothing but noise, or too little of both for one
/// window.
std::string whyNoKeyframe(const SessionStatus& status, const FusionMapperOptions& options);

}  // namespace efm
