// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/condensed_graph.h"

#include <algorithm>
#include <optional>
#include <vector>

namespace efm {
namespace {

/// More loops hardly change the solution, and each costs as much as an anchor.
constexpr std::size_t kMaxLoopsPerAnchor = 2;

/// Takes small motions d in frame `a` to frame `b`: T_b_a * motion(d) = motion(M d) * T_b_a.
Matrix6d motionToFrame(const Rigid3& T_b_a) {
  const Eigen::Matrix3d R_b_a = T_b_a.rotation.toRotationMatrix();
  const Eigen::Vector3d& t = T_b_a.translation;
  Eigen::Matrix3d cross;
  cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  Matrix6d motion = Matrix6d::Zero();
  motion.topLeftCorner<3, 3>() = R_b_a;
  motion.topRightCorner<3, 3>() = cross * R_b_a;
  motion.bottomRightCorner<3, 3>() = R_b_a;
  return motion;
}

class CondensedGraph {
 public:
  CondensedGraph(const KeyframeGraph& graph, std::size_t first_free)
      : keyframes_(graph.keyframes), begin_(first_free - 1), fixed_(begin_) {
    const std::size_t free = graph.newest() - begin_;
    stride_ = (free + kMaxSolvedTogether - 1) / kMaxSolvedTogether;
    for (std::size_t i = begin_; i < graph.newest(); i += stride_) addAnchor(i);
    addAnchor(graph.newest());
    connectAnchors(graph.tracker.inGraph());
    // The newest loops first.
    for (auto factor = graph.factors.rbegin(); factor != graph.factors.rend(); ++factor) {
      if (factor->robust) addLoop(*factor);
    }
  }

  bool solve(const PoseGraphOptions& options) { return solvePoseGraph(options, graph_); }

  /// Moves keyframes with the anchors around them.
  void moveInto(std::vector<RefinedKeyframe>& keyframes) const {
    std::vector<Rigid3> T_solved_world;  // per anchor
    for (std::size_t k = 0; k < anchors_.size(); ++k) {
      T_solved_world.push_back(graph_.T_world_node[k] * poseOf(anchors_[k]).inverse());
    }
    for (std::size_t k = 0; k + 1 < anchors_.size(); ++k) {
      const double begin_m = keyframes[anchors_[k]].path_length_m;
      const double length_m = keyframes[anchors_[k + 1]].path_length_m - begin_m;
      for (std::size_t i = anchors_[k] + 1; i <= anchors_[k + 1]; ++i) {
        RefinedKeyframe& keyframe = keyframes[i];
        const bool last = i == anchors_[k + 1];
        const double along = length_m > 0 ? (keyframe.path_length_m - begin_m) / length_m : 0;
        const auto moved = [&](const Rigid3& T_world_ref) {
          const Rigid3 to = T_solved_world[k + 1] * T_world_ref;
          if (last) return Rigid3{to.rotation.normalized(), to.translation};
          const Rigid3 from = T_solved_world[k] * T_world_ref;
          return Rigid3{from.rotation.slerp(along, to.rotation).normalized(),
                        from.translation + along * (to.translation - from.translation)};
        };
        keyframe.T_world_ref = moved(keyframe.T_world_ref);
        keyframe.T_world_ref_denoised = moved(keyframe.T_world_ref_denoised);
        keyframe.moved = true;
      }
    }
  }

 private:
  const Rigid3& poseOf(std::size_t keyframe) const {
    return keyframes_[keyframe].T_world_ref_denoised;
  }

  void addAnchor(std::size_t keyframe) {
    anchors_.push_back(keyframe);
    graph_.T_world_node.push_back(poseOf(keyframe));
    graph_.fixed.push_back(keyframe == begin_);
  }

  void connectAnchors(const TrackerErrors& errors) {
    for (std::size_t k = 0; k + 1 < anchors_.size(); ++k) {
      const double path_m =
          keyframes_[anchors_[k + 1]].path_length_m - keyframes_[anchors_[k]].path_length_m;
      graph_.factors.push_back({k, k + 1,
                                graph_.T_world_node[k].inverse() * graph_.T_world_node[k + 1],
                                sqrtInformation(errors.driftCovariance(path_m))});
    }
    loops_.resize(anchors_.size());
  }

  /// The anchor before a keyframe, or a fixed node for an earlier keyframe.
  std::size_t nodeOf(std::size_t keyframe) {
    if (keyframe >= begin_) return (keyframe - begin_) / stride_;
    if (!fixed_[keyframe]) {
      fixed_[keyframe] = graph_.T_world_node.size();
      graph_.T_world_node.push_back(poseOf(keyframe));
      graph_.fixed.push_back(true);
    }
    return *fixed_[keyframe];
  }

  void addLoop(const RelativePoseFactor& loop) {
    const std::size_t newer = std::max(loop.from, loop.to);
    if (newer <= begin_ || loop.sqrt_information.isZero(0)) return;  // fixed, or dropped
    std::size_t& loops = loops_[(newer - begin_) / stride_];
    if (loops >= kMaxLoopsPerAnchor) return;
    RelativePoseFactor factor = loop;
    factor.from = nodeOf(loop.from);
    factor.to = nodeOf(loop.to);
    if (factor.from == factor.to) return;
    const Rigid3 T_anchor_from =
        graph_.T_world_node[factor.from].inverse() * keyframes_[loop.from].T_world_ref;
    const Rigid3 T_to_anchor =
        keyframes_[loop.to].T_world_ref.inverse() * graph_.T_world_node[factor.to];
    factor.T_from_to = T_anchor_from * loop.T_from_to * T_to_anchor;
    factor.sqrt_information = loop.sqrt_information * motionToFrame(T_to_anchor);
    graph_.factors.push_back(factor);
    ++loops;
  }

  const std::vector<RefinedKeyframe>& keyframes_;
  std::size_t begin_;  // the keyframe of the first anchor, which is fixed
  std::size_t stride_ = 1;
  std::vector<std::size_t> anchors_;               // keyframes; their nodes come first
  std::vector<std::optional<std::size_t>> fixed_;  // nodes of keyframes before `begin_`
  std::vector<std::size_t> loops_;                 // per anchor
  PoseGraph graph_;
};

}  // namespace

void solveCondensed(KeyframeGraph& graph, std::size_t first_free, const PoseGraphOptions& options) {
  CondensedGraph condensed(graph, first_free);
  if (!condensed.solve(options)) {
    ++graph.failed_solves;
    return;
  }
  condensed.moveInto(graph.keyframes);
}

}  // namespace efm
