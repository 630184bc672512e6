// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "maps/refinement/pose_refinement.h"
#include "maps/refinement/tracker_model.h"

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
  /// Solves the graph, as `solvePoseGraph`.
  bool solve(const PoseGraphOptions& options) { return solvePoseGraph(options, graph_); }

  bool has(std::size_t keyframe) const { return node_[keyframe].has_value(); }
  /// Returns the poses of a keyframe in the graph.
  const Rigid3& T_world_ref(std::size_t keyframe) const {
    return graph_.T_world_node[node_[keyframe].value()];
  }
  const Rigid3& T_world_ref_denoised(std::size_t keyframe) const {
    return graph_.T_world_node[node_[keyframe].value() + 1];
  }
  /// Returns `poseCovariance` of T_world_ref_denoised.
  std::optional<Matrix6d> denoisedCovariance(const PoseGraphOptions& options,
                                             std::size_t keyframe) const {
    return poseCovariance(options, graph_, node_[keyframe].value() + 1);
  }

 private:
  std::size_t refNode(std::size_t keyframe);
  std::size_t denoisedNode(std::size_t keyframe) { return refNode(keyframe) + 1; }

  const std::vector<RefinedKeyframe>& keyframes_;
  std::size_t first_free_;
  std::vector<std::optional<std::size_t>> node_;  // of T_world_ref; the denoised pose is next
  PoseGraph graph_;
};

/// All keyframes, and the factors between them.
struct KeyframeGraph {
  std::vector<RefinedKeyframe> keyframes;
  /// Factors of registrations and loops. Ascending by `to`, except for proposed loops.
  std::vector<RelativePoseFactor> factors;
  TrackerModel tracker;
  /// Failed solves of registrations, windows and loops: the poses stayed.
  std::uint64_t failed_solves = 0;
  /// Earlier keyframes that loops may lead to, ascending.
  std::vector<std::size_t> places = {};

  std::size_t newest() const { return keyframes.size() - 1; }

  /// Returns the candidates with the most points of the newest keyframe in view: at most `count`,
  /// the largest overlap first.
  std::vector<std::size_t> bestOverlaps(const std::vector<std::size_t>& candidates,
                                        double min_overlap, int count) const;
  /// Lets later keyframes find loops to this keyframe. If there are too many places, the place that
  /// is most like an earlier place loses its points: so memory and time are bounded.
  void addPlace(std::size_t keyframe);
  /// Returns the places whose centres of view are nearest to that of the newest keyframe: a bounded
  /// number, the nearest first.
  std::vector<std::size_t> nearestViews() const;

  /// Solves the poses of the keyframes from `first_free` on, except the first keyframe. The poses
  /// stay if the solve fails.
  WindowGraph solveFrom(std::size_t first_free, const PoseGraphOptions& options);

 private:
  std::size_t mostRedundant() const;
};

/// Above this number of free keyframes, loops are solved by `solveCondensed`.
constexpr std::size_t kMaxSolvedTogether = 500;

/// Solves loops over any number of keyframes with at most `kMaxSolvedTogether` free poses: the
/// poses of anchors, which are every n-th keyframe. Two consecutive anchors are connected by their
/// current motion, with the drift of the tracker. A loop connects the anchors before its keyframes;
/// an anchor has at most a few loops. The other keyframes follow the anchors around them. So the
/// cost hardly grows with the number of keyframes, and small errors between anchors stay.
/// @param first_free the keyframes before it are fixed. At least 1, and below the newest keyframe.
/// If the solve fails, nothing moves, and `failed_solves` counts it.
void solveCondensed(KeyframeGraph& graph, std::size_t first_free, const PoseGraphOptions& options);

}  // namespace efm
