// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "mapping/depth_extraction.h"
#include "mapping/depth_planes.h"
#include "mapping/event.h"
#include "mapping/keyframe_policy.h"
#include "mapping/pose_packets.h"
#include "mapping/reference_view.h"
#include "mapping/rig.h"
#include "mapping/space_sweep.h"
#include "mapping/stage.h"
#include "mapping/trajectory.h"

namespace efm {

/// What one window of events became.
struct KeyframeDepthMap {
  Window window;
  Rigid3 T_world_ref;  ///< Pose of the reference view.
  ReferenceView view;
  DepthMap map;
  std::vector<std::uint64_t>
      events;                       ///< Events that voted, per camera of the rig (0: not selected).
  std::uint64_t without_pose = 0;   ///< Events of the window that had no pose.
  VoteCounts votes;                 ///< Summed over cameras.
  std::vector<int> silent_cameras;  ///< Selected, but without an event to vote.
};

struct KeyframeMapperOptions {
  DepthPlanesOptions planes;
  int reference_camera = 0;  ///< Whose pinhole view and pose the keyframe takes.
  PosePacketsOptions packets;
  SpaceSweepOptions sweep;
  DepthExtractionOptions extraction;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// The method itself: the events and poses of one window in, one semi-dense depth map out (Ghosh
/// and Gallego 2022, Algorithm 1 for any number of cameras).
class KeyframeMapper {
 public:
  /// @param selected indices of the rig's cameras whose events take part.
  /// @throws std::invalid_argument where the options, a camera or an index is not valid.
  KeyframeMapper(Rig rig, std::vector<int> selected, const KeyframeMapperOptions& options);

  /// @param events per camera of the rig: the window's, in time order, on the trajectory's clock,
  /// inside the sensor (asserted).
  /// @return nothing where the reference time has no pose.
  std::optional<KeyframeDepthMap> map(const Window& window,
                                      const std::vector<std::vector<Event>>& events,
                                      const Trajectory& trajectory, DsiSink* sink = nullptr,
                                      StageHook* stages = nullptr) const;

  const Rig& rig() const { return rig_; }
  const DepthPlanes& planes() const { return planes_; }
  const ReferenceView& view() const { return view_; }

 private:
  Rig rig_;
  std::vector<int> selected_;
  KeyframeMapperOptions options_;
  DepthPlanes planes_;
  ReferenceView view_;
  SpaceSweep sweep_;
  std::vector<UndistortionTable> undistortion_;  // per selected camera
};

}  // namespace efm
