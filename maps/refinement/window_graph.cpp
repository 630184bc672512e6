// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/window_graph.h"

#include <cassert>

namespace efm {

WindowGraph::WindowGraph(const std::vector<RefinedKeyframe>& keyframes, std::size_t first_free)
    : keyframes_(keyframes), first_free_(first_free), node_(keyframes.size()) {
  assert(first_free > 0);
}

void WindowGraph::add(RelativePoseFactor factor) {
  if (factor.from < first_free_ && factor.to < first_free_) return;
  factor.from = refNode(factor.from);
  factor.to = refNode(factor.to);
  graph_.factors.push_back(factor);
}

void WindowGraph::addTracker(const TrackerErrors& errors) {
  for (std::size_t i = first_free_ - 1; i < keyframes_.size(); ++i) {
    const RefinedKeyframe& keyframe = keyframes_[i];
    graph_.factors.push_back({denoisedNode(i), refNode(i), Rigid3{},
                              sqrtInformation(errors.noiseCovariance(keyframe.noise_scale))});
    if (i + 1 == keyframes_.size()) break;
    const RefinedKeyframe& next = keyframes_[i + 1];
    const Matrix6d drift = errors.driftCovariance(next.path_length_m - keyframe.path_length_m);
    graph_.factors.push_back({denoisedNode(i), denoisedNode(i + 1),
                              keyframe.T_odom_ref.inverse() * next.T_odom_ref,
                              sqrtInformation(drift)});
  }
}

const Rigid3& WindowGraph::T_world_ref(std::size_t keyframe) const {
  return graph_.T_world_node[node_[keyframe].value()];
}

const Rigid3& WindowGraph::T_world_ref_denoised(std::size_t keyframe) const {
  return graph_.T_world_node[node_[keyframe].value() + 1];
}

std::optional<Matrix6d> WindowGraph::denoisedCovariance(const PoseGraphOptions& options,
                                                        std::size_t keyframe) const {
  return poseCovariance(options, graph_, node_[keyframe].value() + 1);
}

/// The node of T_world_ref; creates both nodes of the keyframe where they are missing.
std::size_t WindowGraph::refNode(std::size_t keyframe) {
  std::optional<std::size_t>& node = node_[keyframe];
  if (node) return *node;
  node = graph_.T_world_node.size();
  const bool is_fixed = keyframe < first_free_;
  graph_.T_world_node.push_back(keyframes_[keyframe].T_world_ref);
  graph_.fixed.push_back(is_fixed);
  // The first keyframe keeps its pose by the tracker. The noise of that pose is estimated later.
  graph_.T_world_node.push_back(keyframes_[keyframe].T_world_ref_denoised);
  graph_.fixed.push_back(is_fixed && keyframe > 0);
  return *node;
}

}  // namespace efm
