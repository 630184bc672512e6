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

std::string asText(const FrameTree::Way& way) { return fmt::format("{}", fmt::join(way, kArrow)); }

/// @throws std::runtime_error naming the frames and the time of wrong numbers.
Rigid3 rigidAt(const FrameTransform& transform) {
  try {
    return rigidOf(transform.numbers);
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

/// Interpolates one transform of a chain at increasing times.
class MotionAt {
 public:
  /// @param motion moves.
  explicit MotionAt(FrameMotion& motion) : poses_(motion.moves) {
    constexpr std::int64_t kUsualGapNs = 250'000'000;
    std::stable_sort(poses_.begin(), poses_.end(), isEarlier);
    std::vector<std::int64_t> steps_ns;
    for (std::size_t i = 1; i < poses_.size(); ++i) {
      steps_ns.push_back(poses_[i].t_ns - poses_[i - 1].t_ns);
    }
    if (steps_ns.empty()) return;
    const auto middle = steps_ns.begin() + static_cast<std::ptrdiff_t>(steps_ns.size() / 2);
    std::nth_element(steps_ns.begin(), middle, steps_ns.end());
    max_gap_ns_ = std::max(kUsualGapNs, 3 * *middle);  // a slow transform has long steps
  }
  std::optional<Rigid3> at(std::int64_t t_ns) {
    while (next_ < poses_.size() && poses_[next_].t_ns < t_ns) ++next_;
    if (next_ == poses_.size()) return std::nullopt;
    const StampedPose& after = poses_[next_];
    if (after.t_ns == t_ns) return after.T_world_rig;
    if (next_ == 0 || after.t_ns - poses_[next_ - 1].t_ns > max_gap_ns_) return std::nullopt;
    return TrajectorySegment{poses_[next_ - 1], after}.poseAt(t_ns);
  }
  static bool isEarlier(const StampedPose& a, const StampedPose& b) { return a.t_ns < b.t_ns; }

 private:
  std::vector<StampedPose>& poses_;
  std::int64_t max_gap_ns_ = 0;
  std::size_t next_ = 0;
};

}  // namespace

std::vector<StampedPose> productOf(std::vector<FrameMotion> chain, std::uint64_t& left_out) {
  const auto most = std::max_element(chain.begin(), chain.end(), [](const auto& a, const auto& b) {
    return a.moves.size() < b.moves.size();
  });
  std::vector<StampedPose> poses = most->moves;
  std::map<const FrameMotion*, MotionAt> others;
  for (FrameMotion& motion : chain) {
    if (&motion != &*most && !motion.moves.empty()) others.emplace(&motion, motion);
  }
  if (!others.empty()) std::stable_sort(poses.begin(), poses.end(), MotionAt::isEarlier);
  std::vector<StampedPose> product;
  for (const StampedPose& pose : poses) {
    std::optional<Rigid3> T_a_z = Rigid3();
    for (const FrameMotion& motion : chain) {
      std::optional<Rigid3> T_a_b = motion.T_a_b;
      if (&motion == &*most) {
        T_a_b = pose.T_world_rig;
      } else if (!motion.moves.empty()) {
        T_a_b = others.at(&motion).at(pose.t_ns);
      }
      T_a_z = T_a_z && T_a_b ? std::optional(*T_a_z * *T_a_b) : std::nullopt;
    }
    if (T_a_z) product.push_back({pose.t_ns, *T_a_z});
  }
  left_out = poses.size() - product.size();
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

std::vector<RecordedTransform> FrameTree::transforms() const {
  std::vector<RecordedTransform> all;
  for (const auto& [pair, transform] : transforms_) {
    all.push_back({pair.first, pair.second, transform.moves, transform.count});
  }
  return all;
}

std::string FrameTree::names() const {
  constexpr std::size_t kMost = 20;
  std::string names;
  std::size_t count = 0;
  for (const auto& [pair, transform] : transforms_) {
    if (++count > kMost) continue;
    names += fmt::format("{}{}->{}{}", names.empty() ? "" : ", ", pair.first, pair.second,
                         transform.moves ? "" : " (constant)");
  }
  if (count > kMost) names += fmt::format(" and {} more", count - kMost);
  return names.empty() ? "none" : names;
}

std::vector<std::string> FrameTree::neighbours(const std::string& frame) const {
  std::set<std::string> all;
  for (const auto& [pair, transform] : transforms_) {
    if (pair.first == frame) all.insert(pair.second);
    if (pair.second == frame) all.insert(pair.first);
  }
  return {all.begin(), all.end()};
}

/// Finds the ways from the end of a way. A frame has usually one parent, so there are few.
void FrameTree::extend(Way& way, const std::string& to, std::vector<Way>& found, int& steps) const {
  constexpr std::size_t kMostWays = 4;
  if (way.back() == to) {
    found.push_back(way);
    return;
  }
  for (const std::string& next : neighbours(way.back())) {
    if (found.size() == kMostWays || --steps < 0) return;
    if (std::find(way.begin(), way.end(), next) != way.end()) continue;
    way.push_back(next);
    extend(way, to, found, steps);
    way.pop_back();
  }
}

FrameTree::Way FrameTree::way(const std::string& from, const std::string& to) const {
  if (transforms_.count({from, to}) + transforms_.count({to, from}) > 0) return {from, to};
  std::vector<Way> found;
  Way way = {from};
  int steps = 10'000;
  extend(way, to, found, steps);
  if (found.empty()) return {};
  if (found.size() == 1) return found.front();
  std::string ways;
  for (const Way& each : found) ways += (ways.empty() ? "" : ", ") + asText(each);
  throw std::runtime_error(
      fmt::format("several ways from {} to {}: expected one of {}", from, to, ways));
}

FrameTree::Way FrameTree::wayThrough(const std::string& frames) const {
  Way all;
  for (std::size_t begin = 0; begin <= frames.size();) {
    const std::size_t end = std::min(frames.find(kArrow, begin), frames.size());
    if (frames.compare(begin, 1, "/") == 0) ++begin;  // as the frames of messages
    const std::string frame = frames.substr(begin, end - begin);
    begin = end + 2;
    const Way next = all.empty() ? Way{frame} : way(all.back(), frame);
    if (next.empty()) break;
    all.insert(all.end(), next.begin() + (all.empty() ? 0 : 1), next.end());
    if (begin > frames.size() && all.size() > 1) return all;
  }
  throw std::runtime_error(fmt::format(
      "no transforms between the frames '{}': expected PARENT->CHILD, of {}", frames, names()));
}

std::vector<FrameMotion> FrameTree::along(const Way& way) const {
  std::map<Pair, std::vector<StampedPose>> moving;
  const auto pairAt = [&](std::size_t i) {
    const Pair forward = {way[i], way[i + 1]};
    return transforms_.count(forward) > 0 ? forward : Pair(way[i + 1], way[i]);
  };
  for (std::size_t i = 0; i + 1 < way.size(); ++i) {
    const Transform& transform = transforms_.at(pairAt(i));
    if (transform.moves) moving[pairAt(i)];
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
  for (const auto& [pair, poses] : moving) {
    requireOneTrajectory(poses, fmt::format("the transform {}->{}", pair.first, pair.second));
  }
  std::vector<FrameMotion> motions;
  for (std::size_t i = 0; i + 1 < way.size(); ++i) {
    const Pair pair = pairAt(i);
    FrameMotion motion;
    if (transforms_.at(pair).moves) {
      motion.moves = moving.at(pair);
    } else {
      motion.T_a_b = rigidAt(transforms_.at(pair).first);
    }
    if (pair.first != way[i]) {
      motion.T_a_b = motion.T_a_b.inverse();
      for (StampedPose& pose : motion.moves) pose.T_world_rig = pose.T_world_rig.inverse();
    }
    motions.push_back(std::move(motion));
  }
  return motions;
}

/// Returns the frames above a frame that move against the frame below them. Constant transforms
/// may be published in both directions.
std::vector<std::string> FrameTree::above(const std::string& frame) const {
  std::vector<std::string> found;
  std::vector<std::string> all = {frame};
  const auto visit = [&](const std::string& next, bool moves) {
    if (std::count(all.begin(), all.end(), next) > 0) return;
    all.push_back(next);
    if (moves) found.push_back(next);
  };
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (const auto& [pair, transform] : transforms_) {
      if (pair.second == all[i]) visit(pair.first, transform.moves);
      if (pair.first == all[i] && !transform.moves) visit(pair.second, false);
    }
  }
  return found;
}

std::vector<std::string> FrameTree::choices(const std::string& camera) const {
  constexpr std::size_t kMost = 8;
  std::vector<std::string> choices;
  const auto add = [&](const std::string& world, const std::string& frame) {
    const std::string choice = world + kArrow + frame;
    if (choices.size() < kMost && std::count(choices.begin(), choices.end(), choice) == 0) {
      choices.push_back(choice);
    }
  };
  const bool knows_camera = !neighbours(camera).empty();
  for (const std::string& world : above(camera)) add(world, camera);
  for (const auto& [pair, transform] : transforms_) {
    if (knows_camera && choices.empty() && transform.moves) add(pair.second, camera);  // above all
    const bool has_child = std::any_of(
        transforms_.begin(), transforms_.end(),
        [&, child = pair.second](const auto& other) { return other.first.first == child; });
    if (knows_camera || has_child) continue;
    for (const std::string& world : above(pair.second)) add(world, pair.second);
  }
  return choices;
}

}  // namespace efm
