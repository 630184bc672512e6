// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "maps/refinement/keyframe_graph.h"
#include "maps/refinement/loop_closing.h"
#include "maps/refinement/refinement_options.h"

namespace efm {

struct LoopCounts {
  std::uint64_t checked = 0;   ///< Candidates that were registered.
  std::uint64_t verified = 0;  ///< Candidates that became factors.
  std::uint64_t dropped = 0;   ///< Of these, the ones that other factors contradicted.
};

/// Finds loops, verifies them, and solves the keyframes since the oldest new loop.
class LoopCloser {
 public:
  explicit LoopCloser(const RefinementOptions& options) : options_(options) {}

  /// Checks the earlier keyframes with the largest overlap with the newest one.
  void search(KeyframeGraph& graph);
  /// Registers the keyframes of a candidate with each other, and adds a factor where they agree.
  /// @return whether they agree.
  bool check(KeyframeGraph& graph, const LoopCandidate& candidate);
  /// Solves new loops where the path has grown enough since the last time.
  /// @return the solved graph, or nothing.
  std::optional<WindowGraph> solveWhenDue(KeyframeGraph& graph);
  /// Solves all keyframes.
  /// @param graph at least two keyframes.
  WindowGraph solveAll(KeyframeGraph& graph);

  const LoopCounts& counts() const { return counts_; }

 private:
  WindowGraph solve(KeyframeGraph& graph, std::size_t first_free);

  RefinementOptions options_;
  LoopCounts counts_;
  std::optional<std::size_t> oldest_unsolved_;  // the oldest keyframe of the new loops
  std::size_t solved_at_ = 0;                   // the newest keyframe of that time
};

}  // namespace efm
