// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/keyframe_graph.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <utility>

#include "maps/refinement/loop_closing.h"

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

/// Returns the node of T_world_ref. Creates both nodes of the keyframe if they are missing.
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

namespace {

constexpr std::size_t kMaxNearestViews = 50;
/// Maximum number of places, with up to 0.3 MB of points each.
constexpr std::size_t kMaxPlaces = 1000;

Eigen::Vector3d centreOfView(const RefinedKeyframe& keyframe) {
  const double inverse_depth = keyframe.cloud.middleInverseDepth();
  const double depth = inverse_depth > 0 ? 1 / inverse_depth : 0;
  return keyframe.T_world_ref * Eigen::Vector3d(0, 0, depth);
}

std::vector<std::size_t> numbersOf(const std::vector<std::pair<double, std::size_t>>& ranked,
                                   std::size_t count) {
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < std::min(count, ranked.size()); ++i) {
    numbers.push_back(ranked[i].second);
  }
  return numbers;
}

}  // namespace

std::vector<std::size_t> KeyframeGraph::bestOverlaps(const std::vector<std::size_t>& candidates,
                                                     double min_overlap, int count) const {
  const RefinedKeyframe& of = keyframes.back();
  std::vector<std::pair<double, std::size_t>> ranked;
  for (const std::size_t candidate : candidates) {
    const RefinedKeyframe& in = keyframes[candidate];
    const double overlap =
        viewOverlap(of.cloud, in.cloud, in.T_world_ref.inverse() * of.T_world_ref);
    if (overlap >= min_overlap) ranked.emplace_back(overlap, candidate);
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  return numbersOf(ranked, static_cast<std::size_t>(count));
}

void KeyframeGraph::addPlace(std::size_t keyframe) {
  places.push_back(keyframe);
  if (places.size() <= kMaxPlaces) return;
  const auto redundant = places.begin() + static_cast<std::ptrdiff_t>(mostRedundant());
  keyframes[*redundant].cloud.clear();
  places.erase(redundant);
}

/// Returns the index of the newer of the two places that are nearest to each other, in position and
/// in centre of view.
std::size_t KeyframeGraph::mostRedundant() const {
  using Position = Eigen::Matrix<double, 6, 1>;
  std::vector<Position> positions;
  for (const std::size_t place : places) {
    positions.emplace_back();
    positions.back() << keyframes[place].T_world_ref.translation, centreOfView(keyframes[place]);
  }
  std::size_t redundant = 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < positions.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const double squared = (positions[i] - positions[k]).squaredNorm();
      if (squared >= nearest) continue;
      nearest = squared;
      redundant = i;
    }
  }
  return redundant;
}

std::vector<std::size_t> KeyframeGraph::nearestViews() const {
  const Eigen::Vector3d centre = centreOfView(keyframes.back());
  std::vector<std::pair<double, std::size_t>> ranked;
  for (const std::size_t i : places) {
    ranked.emplace_back((centreOfView(keyframes[i]) - centre).squaredNorm(), i);
  }
  const std::size_t count = std::min(ranked.size(), kMaxNearestViews);
  std::partial_sort(ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(count),
                    ranked.end());
  return numbersOf(ranked, count);
}

WindowGraph KeyframeGraph::solveFrom(std::size_t first_free, const PoseGraphOptions& options) {
  first_free = std::max<std::size_t>(first_free, 1);
  WindowGraph window(keyframes, first_free);
  for (std::size_t f = keyframes[first_free].first_factor; f < factors.size(); ++f) {
    window.add(factors[f]);
  }
  window.addTracker(tracker.inGraph());
  if (!window.solve(options)) {
    ++failed_solves;
    return window;
  }
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    if (!window.has(i)) continue;
    RefinedKeyframe& keyframe = keyframes[i];
    keyframe.T_world_ref_denoised = window.T_world_ref_denoised(i);
    if (i < first_free) continue;
    keyframe.moved = keyframe.moved || !isSame(keyframe.T_world_ref, window.T_world_ref(i));
    keyframe.T_world_ref = window.T_world_ref(i);
  }
  return window;
}

namespace {

/// More loops hardly change the solution, and each costs as much as an anchor.
constexpr std::size_t kMaxLoopsPerAnchor = 2;

/// Returns M with T_b_a * motion(d) = motion(M d) * T_b_a: it takes small motions to frame `b`.
Matrix6d motionToFrame(const Rigid3& T_b_a) {
  const Eigen::Matrix3d R_b_a = T_b_a.rotation.toRotationMatrix();
  Matrix6d motion = Matrix6d::Zero();
  motion.topLeftCorner<3, 3>() = R_b_a;
  motion.topRightCorner<3, 3>() = crossMatrix(T_b_a.translation) * R_b_a;
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
    // Adds the newest loops first.
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

  /// Returns the anchor before a keyframe; for a keyframe before all anchors, a fixed node.
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
