// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/bags/frame_tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/streams/pose_conflict.h"

namespace efm {
namespace {

constexpr const char* kArrow = "->";

/// @throws std::runtime_error naming the frames and the time of wrong numbers.
Rigid3 rigidAt(const FrameTransform& transform) {
  try {
    return transformOf(transform.numbers);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("{}->{} of {}: {}", transform.parent, transform.child,
                                         formatSeconds(transform.t_ns), error.what()));
  }
}

/// Returns whether two transforms are over 1 mm or 0.1 degrees apart.
bool areApart(const PoseNumbers& a, const PoseNumbers& b) {
  constexpr double kSameM = 1e-3;
  constexpr double kSameCosine = 1 - 3.8e-7;  // of half the angle
  using Vector7d = Eigen::Matrix<double, 7, 1>;
  const Eigen::Map<const Vector7d> first(a.data());
  const Eigen::Map<const Vector7d> second(b.data());
  return (first - second).head<3>().norm() > kSameM ||
         std::abs(first.tail<4>().dot(second.tail<4>())) < kSameCosine;
}

}  // namespace

std::vector<StampedPose> productOf(const FrameChain& chain, std::uint64_t& left_out) {
  constexpr double kUsualGapS = 0.25;
  const auto most = std::max_element(
      chain.begin(), chain.end(), [](const auto& a, const auto& b) { return a.size() < b.size(); });
  std::vector<Trajectory> trajectories;
  for (const std::vector<StampedPose>& poses : chain) {
    const auto [first, last] = std::minmax_element(
        poses.begin(), poses.end(), [](const auto& a, const auto& b) { return a.t_ns < b.t_ns; });
    const double step_s =
        secondsBetween(first->t_ns, last->t_ns) / static_cast<double>(poses.size());
    trajectories.emplace_back(TrajectoryOptions{std::max(kUsualGapS, 3 * step_s)});  // or slow ones
    if (poses.size() == 1 || &poses == &*most) continue;
    for (const StampedPose& pose : poses) trajectories.back().add(pose);
  }
  std::vector<StampedPose> product;
  for (const StampedPose& pose : *most) {
    std::optional<Rigid3> T_a_z = Rigid3();
    for (std::size_t i = 0; i < chain.size() && T_a_z; ++i) {
      const bool given = chain[i].size() == 1 || &chain[i] == &*most;
      const auto T_y_z = given ? (chain[i].size() == 1 ? chain[i][0] : pose).T_world_rig
                               : trajectories[i].poseAt(pose.t_ns);
      T_a_z = T_y_z ? std::optional(*T_a_z * *T_y_z) : std::nullopt;
    }
    if (T_a_z) product.push_back({pose.t_ns, *T_a_z});
  }
  left_out = most->size() - product.size();
  return product;
}

FrameTree::FrameTree(Read read) : read_(std::move(read)) {
  damage_ = read_([&](const FrameTransform& transform, bool latched) {
    auto entry = transforms_.find({transform.parent, transform.child});
    if (entry == transforms_.end()) {
      entry = transforms_.insert({{transform.parent, transform.child}, {transform}}).first;
    }
    Transform& all = entry->second;
    ++all.count;
    all.latched = all.latched || latched;
    if (transform.numbers == all.first.numbers) return;
    all.moves = true;
    if (!all.other && areApart(transform.numbers, all.first.numbers)) all.other = transform;
  });
  for (auto& [pair, transform] : transforms_) {
    transform.moves = transform.moves && !transform.latched;
    if (!transform.latched) transform.other.reset();
  }
}

std::vector<RecordedTransform> FrameTree::transforms(const std::string& camera) const {
  std::vector<RecordedTransform> all;
  for (const auto& [pair, transform] : transforms_) {
    all.push_back({pair.first, pair.second, transform.moves, transform.count});
  }
  const auto chain = above(camera);  // its frames are those nearest to the camera first
  const auto rankOf = [&](const RecordedTransform& transform) {
    const auto found = std::find_if(chain.begin(), chain.end(), [&](const auto& frame) {
      return frame.first == transform.child;
    });
    return std::pair(found == chain.end(), chain.end() - found);
  };
  std::stable_sort(all.begin(), all.end(),
                   [&](const auto& a, const auto& b) { return rankOf(a) < rankOf(b); });
  return all;
}

/// Finds the ways from the end of a way. A frame has usually one parent, so there are few.
void FrameTree::extend(Way& way, const std::string& to, std::vector<Way>& found, int& steps) const {
  constexpr std::size_t kMostWays = 4;
  if (way.back() == to) {
    found.push_back(way);
    return;
  }
  const std::string frame = way.back();
  for (const auto& [pair, transform] : transforms_) {
    if (found.size() == kMostWays || --steps < 0) return;
    const std::string& next = pair.first == frame ? pair.second : pair.first;
    if (pair.first != frame && pair.second != frame) continue;
    if (std::find(way.begin(), way.end(), next) != way.end()) continue;
    way.push_back(next);
    extend(way, to, found, steps);
    way.pop_back();
  }
}

FrameTree::Way FrameTree::way(const std::string& from, const std::string& to) const {
  std::vector<Way> found;
  Way way = {from};
  int steps = 100'000;
  extend(way, to, found, steps);
  if (found.size() < 2) return found.empty() ? Way() : found.front();
  std::vector<std::string> ways;
  for (const Way& each : found) ways.push_back(fmt::format("\"/tf:{}\"", fmt::join(each, kArrow)));
  throw std::runtime_error(fmt::format("several ways from {} to {}: expected one of {}", from, to,
                                       fmt::join(ways, ", ")));
}

FrameTree::Way FrameTree::wayThrough(const std::string& frames) const {
  constexpr std::size_t kMostNames = 20;
  Way all;
  for (std::size_t begin = 0; begin <= frames.size();) {
    const std::size_t end = std::min(frames.find(kArrow, begin), frames.size());
    if (frames.compare(begin, 1, "/") == 0) ++begin;  // as the frames of messages
    const std::string frame = frames.substr(begin, end - begin);
    begin = end + 2;
    const bool direct =
        !all.empty() &&
        transforms_.count({all.back(), frame}) + transforms_.count({frame, all.back()}) > 0;
    const Way next = all.empty() ? Way{frame}
                     : direct    ? Way{all.back(), frame}  // the named one comes first
                                 : way(all.back(), frame);
    if (next.empty()) break;
    all.insert(all.end(), next.begin() + (all.empty() ? 0 : 1), next.end());
    if (begin > frames.size() && all.size() > 1) return all;
  }
  std::vector<std::string> names;
  for (const auto& [pair, transform] : transforms_) {
    names.push_back(pair.first + kArrow + pair.second + (transform.moves ? "" : " (constant)"));
  }
  if (names.size() > kMostNames) names.resize(kMostNames, "…");
  throw std::runtime_error(
      fmt::format("no transforms between the frames '{}': expected PARENT->CHILD, of {}", frames,
                  fmt::join(names, ", ")));
}

FrameChain FrameTree::along(const Way& way, std::vector<Warning>& warnings) const {
  std::map<Pair, std::vector<StampedPose>> moving;
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i + 1 < way.size(); ++i) {
    const bool forward = transforms_.count({way[i], way[i + 1]}) > 0;
    pairs.push_back(forward ? Pair(way[i], way[i + 1]) : Pair(way[i + 1], way[i]));
    const Transform& transform = transforms_.at(pairs.back());
    if (transform.moves) moving[pairs.back()];
    if (!transform.other) continue;
    throw std::runtime_error(fmt::format(
        "{}->{} is constant, but has another value at {}: expected one publisher "
        "(--hand-eye FILE replaces constant transforms behind the poses)",
        transform.first.parent, transform.first.child, formatSeconds(transform.other->t_ns)));
  }
  const auto take = [&](const FrameTransform& transform, bool) {
    const auto found = moving.find({transform.parent, transform.child});
    if (found != moving.end()) found->second.push_back({transform.t_ns, rigidAt(transform)});
  };
  if (!moving.empty()) read_(take);
  for (auto& [pair, poses] : moving) {
    takeOneTrajectory(poses, fmt::format("the transform {}->{}", pair.first, pair.second), warnings,
                      true);
  }
  FrameChain chain;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto found = moving.find(pairs[i]);
    if (found != moving.end()) {
      chain.push_back(found->second);
    } else {
      chain.push_back({{0, rigidAt(transforms_.at(pairs[i]).first)}});
    }
    if (pairs[i].first == way[i]) continue;
    for (StampedPose& pose : chain.back()) pose.T_world_rig = pose.T_world_rig.inverse();
  }
  return chain;
}

/// Returns a frame and the frames above it, the nearest first, and whether each moves against the
/// frame below it. Constant transforms may be published in both directions.
std::vector<std::pair<std::string, bool>> FrameTree::above(const std::string& frame) const {
  std::vector<std::pair<std::string, bool>> all = {{frame, false}};
  const auto visit = [&](const std::string& next, bool moves) {
    const auto same = [&](const auto& other) { return other.first == next; };
    if (std::none_of(all.begin(), all.end(), same)) all.emplace_back(next, moves);
  };
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::string below = all[i].first;
    for (const auto& [pair, transform] : transforms_) {
      if (pair.second == below) visit(pair.first, transform.moves);
      if (pair.first == below && !transform.moves) visit(pair.second, false);
    }
  }
  return all;
}

std::vector<std::string> FrameTree::choices(const std::string& camera) const {
  constexpr std::size_t kMost = 8;
  std::set<std::string> parents, bodies;
  for (const auto& [pair, transform] : transforms_) {
    parents.insert(pair.first);
    bodies.insert(pair.second);
  }
  const bool has_camera = parents.count(camera) + bodies.count(camera) > 0;
  for (const std::string& parent : parents) bodies.erase(parent);
  if (has_camera) bodies = {camera};
  std::vector<std::string> choices;
  for (const std::string& body : bodies) {
    for (const auto& [world, moves] : above(body)) {
      if (moves) choices.push_back(world + kArrow + body);
    }
  }
  for (const auto& [pair, transform] : transforms_) {  // a camera that is above all others
    if (has_camera && choices.empty() && transform.moves) {
      choices.push_back(pair.second + kArrow + camera);
    }
  }
  if (choices.size() > kMost) choices.resize(kMost);
  return choices;
}

}  // namespace efm
