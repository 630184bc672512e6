// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "mapping/base/stage_times.h"
#include "mapping/depth/depth_extraction.h"
#include "mapping/depth/peak_fit.h"
#include "mapping/events/window.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/keyframe_depth_map.h"
#include "mapping/motion/motion_correction.h"
#include "mapping/rays/rays.h"
#include "mapping/sweep/space_sweep.h"

namespace efm {

/// The rays of one camera's events of a window, and counts of its events.
struct WindowRays {
  int camera = 0;                         ///< Index in the rig.
  CameraRays rays;                        ///< One bundle per part of `EventGroups`.
  std::uint64_t events = 0;               ///< Events with a ray.
  std::uint64_t without_pose = 0;         ///< Events without a pose.
  std::uint64_t outside_lens = 0;         ///< Events with a pose, without a ray.
  std::uint64_t silent_subintervals = 0;  ///< Sub-intervals (of all slices) without a ray.
};

/// Back-projects one camera's events along a trajectory, part by part (Ghosh and Gallego 2022,
/// Algorithm 2, line 3).
/// @param camera one of the input's cameras.
WindowRays raysOf(const CameraEvents& camera, const WindowInput& input,
                  const Trajectory& trajectory, const EventGroups& groups,
                  const PosePacketsOptions& packets);

struct KeyframeMapperOptions {
  DepthPlanesOptions planes;
  /// The camera of the reference view; it need not be a selected camera.
  int reference_camera = 0;
  ReferenceViewOptions view;
  SubintervalOptions subintervals;
  /// Maximum number of a camera's events that take part, evenly chosen (`EvenChoice`); 0: no limit.
  std::uint32_t max_events_per_camera = 0;
  SplitFusionOptions split;  ///< Groups of events; each group is divided into the sub-intervals.
  /// True: a silent camera (none of its events votes) is excluded from the fusion. Otherwise the
  /// camera makes AND-like rules zero everywhere.
  bool exclude_silent = false;
  PosePacketsOptions packets;
  SpaceSweepOptions sweep;
  DepthExtractionOptions extraction;
  MotionCorrectionOptions motion;  ///< Correction of the motion within a window.
  /// The value of `WhiteLevel::kSequence`, if an earlier pass over the recording found it. If it is
  /// not given, the robust maximum of the keyframes so far is used.
  std::optional<double> sequence_maximum;
  /// Returns the keyframe that an earlier run made of the same data in a window; its pose is the
  /// tracker's. std::nullopt: none, the window is mapped. May be empty.
  std::function<std::optional<KeyframeDepthMap>(const Window&)> made_earlier;
  bool camera_maps = false;   ///< True: also a depth map of each camera alone, in the same view.
  bool event_images = false;  ///< True: also each camera's events as an image.
  bool view_events = false;   ///< True: also the reference camera's events in the view.

  void validate() const;
};

/// The method: it maps the events and poses of one window to one semi-dense depth map (Ghosh and
/// Gallego 2022, Algorithm 2 for any number of cameras; with one sub-interval Algorithm 1). From
/// one window to the next it keeps only the running maximum of confidences, and the blur by poses.
class KeyframeMapper {
 public:
  /// The blur by poses is forgotten after each 64th keyframe: a keyframe depends on the windows of
  /// at most 63 keyframes before it.
  static constexpr std::uint64_t kBlockKeyframes = 64;

  /// @param selected indices of the rig's cameras whose events take part.
  KeyframeMapper(Rig rig, std::vector<int> selected, const KeyframeMapperOptions& options);

  /// @param events of the window, per camera of the rig, in time order, on the trajectory's clock.
  /// They lie inside the sensors.
  /// @return std::nullopt if the reference time has no pose.
  std::optional<KeyframeDepthMap> map(const Window& window, const std::vector<EventSpan>& events,
                                      const Trajectory& trajectory, DsiSink* sink = nullptr,
                                      StageTimes* times = nullptr);

  /// Sets the depth planes of the next keyframes.
  void setPlanes(const DepthPlanesOptions& planes);
  /// Sets the correction of the motion of the next keyframes.
  void setMotion(const MotionCorrectionOptions& motion) { options_.motion = motion; }

  /// Returns T_world_ref of the reference view for a pose of the rig.
  Rigid3 referencePose(const Rigid3& T_world_rig) const;
  const Rig& rig() const { return rig_; }
  const DepthPlanes& planes() const { return planes_; }
  const ReferenceView& view() const { return view_; }

 private:
  const RigCamera& cameraOf(int index) const {
    return rig_.cameras[static_cast<std::size_t>(index)];
  }
  std::vector<CameraEvents> selectedEvents(const std::vector<EventSpan>& events) const;
  KeyframeDepthMap mapBest(const WindowInput& input, const Trajectory& tracked, DsiSink* sink,
                           StageTimes* times);
  KeyframeDepthMap mapSharpest(const WindowInput& input, const Trajectory& tracked,
                               const cv::Mat1f& central_depth, DsiSink* sink, StageTimes* times,
                               double& finest_px) const;
  KeyframeDepthMap mapAlong(const WindowInput& input, const Trajectory& motion, DsiSink* sink,
                            StageTimes* times) const;
  SweepResult fuse(std::vector<WindowRays>& cameras, const DepthPlanes& planes,
                   double parallax_px_m, DsiSink* sink) const;
  FusionOptions pairsOf(std::vector<WindowRays>& cameras) const;
  void extract(const SweepResult& swept, const std::vector<WindowRays>& cameras,
               const DepthPlanes& planes, KeyframeDepthMap& keyframe) const;

  Rig rig_;
  std::vector<int> selected_;
  KeyframeMapperOptions options_;
  DepthPlanes planes_;
  ReferenceView view_;
  EventGroups groups_;
  std::vector<UndistortionTable> undistortion_;  // per selected camera
  RobustMaximum sequence_maximum_;
  BlurWatch blur_;
  std::uint64_t keyframes_ = 0;
};

/// The motion of the selected cameras relative to the reference view within a window: maxima.
struct ViewMotion {
  double rig_baseline_m = 0;  ///< Distance of any camera at the reference time.
  double shift_m = 0;         ///< Distance of the reference camera, at any time.
  double rotation_rad = 0;    ///< Rotation of the reference camera, at any time.
  /// The parallax of inverse depth, for any camera at any time, averaged over the view: pixels per
  /// 1/m.
  double parallax_px_m = 0;
};

/// Measures the motion within a window. @param cameras indices of the selected cameras.
/// @return std::nullopt if the window's reference time has no pose.
std::optional<ViewMotion> motionIn(const WindowData& data, const Rig& rig,
                                   const std::vector<int>& cameras,
                                   const KeyframeMapperOptions& options);

}  // namespace efm
