// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "maps/refinement/pose_refinement.h"
#include "maps/refinement/refined_keyframe.h"
#include "maps/refinement/tracker_model.h"
#include "maps/refinement/window_graph.h"

namespace efm {

/// All keyframes, and the factors between them.
struct KeyframeGraph {
  std::vector<RefinedKeyframe> keyframes;
  /// From registrations and loops. Ascending by `to`, except for proposed loops.
  std::vector<RelativePoseFactor> factors;
  TrackerModel tracker;
  /// Minima that could not be computed; poses stayed there. Of registrations, windows and loops.
  std::uint64_t failed_solves = 0;
  /// Earlier keyframes that loops may lead to, ascending.
  std::vector<std::size_t> places = {};

  std::size_t newest() const { return keyframes.size() - 1; }

  /// The given keyframes with the most points of the newest keyframe in view: at most `count`, the
  /// largest overlap first.
  std::vector<std::size_t> bestOverlaps(const std::vector<std::size_t>& candidates,
                                        double min_overlap, int count) const;
  /// Lets later keyframes find loops to this one. Of too many such places, the one that is most
  /// like an earlier one loses its points: so memory and time are bounded.
  void addPlace(std::size_t keyframe);
  /// The places whose centres of view are nearest to that of the newest keyframe: a bounded number,
  /// the nearest first.
  std::vector<std::size_t> nearestViews() const;

  /// Solves the poses of the keyframes from `first_free` on, except the first keyframe. They stay
  /// where the minimum cannot be computed.
  WindowGraph solveFrom(std::size_t first_free, const PoseGraphOptions& options);

 private:
  std::size_t mostRedundant() const;
};

}  // namespace efm
