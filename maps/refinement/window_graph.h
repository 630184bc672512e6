// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "maps/refinement/pose_refinement.h"
#include "maps/refinement/refined_keyframe.h"
#include "maps/refinement/tracker_errors.h"

namespace efm {

/// The pose graph of the keyframes from one on, and of those before that factors tie them to. Each
/// keyframe has two poses in it: its own, and the one that the tracker would have given without
/// noise. Between each two of the latter lies the tracker's motion, which may drift; beside each
/// stands the former, which noise took from it. So poses that jitter average out over the whole
/// window, and those that drift follow what the points say.
class WindowGraph {
 public:
  /// @param first_free the keyframes before it stay where they are. At least 1.
  /// @param keyframes must outlive the graph.
  WindowGraph(const std::vector<RefinedKeyframe>& keyframes, std::size_t first_free);

  /// A factor between keyframes; left out where both stay.
  void add(RelativePoseFactor factor);
  /// What the tracker says.
  void addTracker(const TrackerErrors& errors);
  void solve(const PoseGraphOptions& options) { solvePoseGraph(options, graph_); }

  /// Whether the keyframe is in the graph.
  bool has(std::size_t keyframe) const { return place_[keyframe].has_value(); }
  /// Its poses, where it is.
  const Rigid3& T_world_ref(std::size_t keyframe) const;
  const Rigid3& T_world_ref_denoised(std::size_t keyframe) const;
  /// See `poseCovariance`: of T_world_ref_denoised.
  std::optional<Matrix6d> trackedCovariance(const PoseGraphOptions& options,
                                            std::size_t keyframe) const;

 private:
  std::size_t ownNode(std::size_t keyframe);
  std::size_t trackedNode(std::size_t keyframe) { return ownNode(keyframe) + 1; }

  const std::vector<RefinedKeyframe>& keyframes_;
  std::size_t first_free_;
  std::vector<std::optional<std::size_t>> place_;  // of each keyframe's first node
  PoseGraph graph_;
};

}  // namespace efm
