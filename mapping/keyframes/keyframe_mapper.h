// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "mapping/depth/depth_extraction.h"
#include "mapping/depth/robust_maximum.h"
#include "mapping/events/event.h"
#include "mapping/events/event_groups.h"
#include "mapping/events/subintervals.h"
#include "mapping/geometry/depth_planes.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/geometry/undistortion.h"
#include "mapping/keyframes/keyframe_depth_map.h"
#include "mapping/keyframes/stage.h"
#include "mapping/motion/motion_correction.h"
#include "mapping/rays/pose_packets.h"
#include "mapping/sweep/space_sweep.h"

namespace efm {

struct KeyframeMapperOptions {
  DepthPlanesOptions planes;
  /// Whose pinhole view and pose the keyframe takes; it need not be among the selected ones.
  int reference_camera = 0;
  ReferenceViewOptions view;
  SubintervalOptions subintervals;
  SplitFusionOptions split;  ///< Into groups of events, each with its own sub-intervals.
  /// Leave cameras without an event to vote out of the fusion: with the AND-like rules a silent
  /// camera makes everything zero.
  bool exclude_silent = false;
  PosePacketsOptions packets;
  SpaceSweepOptions sweep;
  DepthExtractionOptions extraction;
  MotionCorrectionOptions motion;  ///< Of the poses within a window.
  /// What `WhiteLevel::kSequence` stands for, where an earlier pass over the recording found it;
  /// the robust maximum of the keyframes so far where not given.
  std::optional<double> sequence_maximum;
  bool camera_maps = false;   ///< Also a depth map of each camera alone, in the same view.
  bool event_images = false;  ///< Also each camera's events as an image.

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// The method itself: the events and poses of one window in, one semi-dense depth map out (Ghosh
/// and Gallego 2022, Algorithm 2 for any number of cameras; with one sub-interval Algorithm 1).
/// Keeps nothing from one window to the next but the confidences' running maximum.
class KeyframeMapper {
 public:
  /// @param selected indices of the rig's cameras whose events take part.
  /// @throws std::invalid_argument where the options, a camera or an index is not valid.
  KeyframeMapper(Rig rig, std::vector<int> selected, const KeyframeMapperOptions& options);

  /// @param events per camera of the rig: the window's, in time order, on the trajectory's clock,
  /// inside the sensor (asserted).
  /// @return nothing where the reference time has no pose.
  std::optional<KeyframeDepthMap> map(const Window& window, const std::vector<EventSpan>& events,
                                      const Trajectory& trajectory, DsiSink* sink = nullptr,
                                      StageHook* stages = nullptr);

  /// T_world_ref where the rig is there.
  Rigid3 referencePose(const Rigid3& T_world_rig) const;
  const Rig& rig() const { return rig_; }
  const DepthPlanes& planes() const { return planes_; }
  const ReferenceView& view() const { return view_; }

 private:
  /// One camera's events on their way to the sweep.
  struct CameraInput {
    int camera = 0;
    CameraRays rays;  // by part of `EventGroups`
    std::uint64_t events = 0;
    std::uint64_t without_pose = 0;
    std::uint64_t silent_subintervals = 0;
  };

  /// What is mapped: the events of a window, along a motion, seen from a place.
  struct Scene {
    const Window& window;
    const std::vector<EventSpan>& events;
    Rigid3 T_world_ref;
  };

  KeyframeDepthMap mapAlong(const Trajectory& trajectory, const Scene& scene, DsiSink* sink,
                            StageHook* stages) const;
  void correctMotion(const Trajectory& trajectory, const Scene& scene, DsiSink* sink,
                     StageHook* stages, KeyframeDepthMap& keyframe) const;
  VelocityCorrection sharpestAlong(const Trajectory& motion, const Scene& scene, StageHook* stages,
                                   const KeyframeDepthMap& keyframe) const;
  std::vector<std::vector<WarpedEvent>> warpAlong(const Trajectory& motion, const Scene& scene,
                                                  const KeyframeDepthMap& keyframe) const;
  CameraInput backProjectCamera(std::size_t selected, EventSpan events, const Window& window,
                                const Trajectory& trajectory, const PacketGeometry& geometry) const;
  static void count(const CameraInput& input, KeyframeDepthMap& keyframe);
  void fuse(std::vector<CameraInput> inputs, DsiSink* sink, StageHook* stages,
            KeyframeDepthMap& keyframe) const;

  Rig rig_;
  std::vector<int> selected_;
  KeyframeMapperOptions options_;
  DepthPlanes planes_;
  ReferenceView view_;
  EventGroups groups_;
  std::vector<UndistortionTable> undistortion_;  // per selected camera
  RobustMaximum sequence_maximum_;
};

}  // namespace efm
