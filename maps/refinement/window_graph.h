// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "maps/refinement/pose_refinement.h"
#include "maps/refinement/refined_keyframe.h"
#include "maps/refinement/tracker_errors.h"

namespace efm {

/// The pose graph of the keyframes from `first_free` on, and of the earlier ones that factors
/// connect with them. Each keyframe has two poses: T_world_ref and T_world_ref_denoised. The motion
/// of the tracker, with its drift, connects consecutive denoised poses. The noise connects the two
/// poses of a keyframe. So noise averages out over the window, and drift follows the points.
class WindowGraph {
 public:
  /// @param first_free the keyframes before it are fixed. At least 1.
  /// @param keyframes must outlive the graph.
  WindowGraph(const std::vector<RefinedKeyframe>& keyframes, std::size_t first_free);

  /// Adds a factor between keyframes, unless both are fixed.
  void add(RelativePoseFactor factor);
  /// Adds the factors of the tracker: its motions and its noise.
  void addTracker(const TrackerErrors& errors);
  /// As `solvePoseGraph`.
  bool solve(const PoseGraphOptions& options) { return solvePoseGraph(options, graph_); }

  bool has(std::size_t keyframe) const { return node_[keyframe].has_value(); }
  /// The poses of a keyframe in the graph.
  const Rigid3& T_world_ref(std::size_t keyframe) const;
  const Rigid3& T_world_ref_denoised(std::size_t keyframe) const;
  /// `poseCovariance` of T_world_ref_denoised.
  std::optional<Matrix6d> denoisedCovariance(const PoseGraphOptions& options,
                                             std::size_t keyframe) const;

 private:
  std::size_t refNode(std::size_t keyframe);
  std::size_t denoisedNode(std::size_t keyframe) { return refNode(keyframe) + 1; }

  const std::vector<RefinedKeyframe>& keyframes_;
  std::size_t first_free_;
  std::vector<std::optional<std::size_t>> node_;  // of T_world_ref; the denoised one is next
  PoseGraph graph_;
};

}  // namespace efm
