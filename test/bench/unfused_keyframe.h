// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "mapping/depth/depth_extraction.h"
#include "mapping/events/event.h"
#include "mapping/events/window.h"
#include "mapping/geometry/lens.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/keyframe_depth_map.h"
#include "mapping/keyframes/keyframe_mapper.h"

namespace efm::bench {

/// A keyframe computed like in the published research code of this method: the reference for the
/// fused sweep. Each camera votes into its own volume with the plain kernel. The fusion copies the
/// volumes and computes their harmonic mean. The peaks are searched in the fused volume. Packets,
/// rays and depth extraction are those of the mapper. It uses one thread and no sub-intervals.
///
/// The volumes are kept from one keyframe to the next, so their memory is allocated once.
class UnfusedKeyframe {
 public:
  /// Uses all cameras of the rig.
  UnfusedKeyframe(const Rig& rig, const KeyframeMapperOptions& options);

  /// @return std::nullopt if the reference time has no pose.
  std::optional<DepthMap> map(const Window& window, const std::vector<EventSpan>& events,
                              const Trajectory& trajectory, StageTimes* times = nullptr);

 private:
  using Volume = std::vector<float>;  // [z][y][x]

  void vote(const RayBundle& rays, Volume& volume) const;
  void fuse();
  DsiPeaks findPeaks() const;

  Rig rig_;
  KeyframeMapperOptions options_;
  DepthPlanes planes_;
  ReferenceView view_;
  std::vector<UndistortionTable> undistortion_;  // per camera
  std::vector<Volume> volumes_;                  // per camera
  std::vector<Volume> copies_;                   // the input of the fusion
  Volume fused_;
};

}  // namespace efm::bench
