// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/global_cloud.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <utility>

#include "mapping/base/option.h"

namespace efm {
namespace {

[[noreturn]] void rejectPoint(const CloudPoint& point, const std::string& why) {
  throw std::invalid_argument("point " + pointText(point) + ": " + why);
}

[[noreturn]] void rejectMissing(std::uint64_t keyframe) {
  throw std::invalid_argument("keyframe " + std::to_string(keyframe) + " is not in the map");
}

/// Number of bits for the keyframes with lower numbers, and for those with higher numbers.
constexpr unsigned kLowerBits = GlobalCloud::kMaxNumberDifference;

void requireNotFinalized(std::uint64_t keyframe, std::uint64_t from) {
  if (keyframe >= from) return;
  throw std::invalid_argument("keyframe " + std::to_string(keyframe) +
                              ": the keyframes around it are merged for good");
}

/// Returns the first number of `FinalizedVoxel::recent`.
std::uint64_t recentFrom(std::uint64_t below) {
  return below < kLowerBits ? 0 : below - kLowerBits;
}

/// Returns the bit of keyframe `by` in the verdicts of keyframe `checked`. It ascends with `by`.
unsigned bitOf(std::uint64_t by, std::uint64_t checked) {
  return by < checked ? kLowerBits - static_cast<unsigned>(checked - by)
                      : kLowerBits - 1 + static_cast<unsigned>(by - checked);
}

/// Appends the numbers of the keyframes whose bits are set in the verdicts of keyframe `checked`.
void appendNumbers(unsigned bits, std::uint64_t checked, std::vector<std::uint64_t>& numbers) {
  for (unsigned bit = 0; bit < 2 * kLowerBits; ++bit) {
    if ((bits >> bit & 1U) == 0) continue;
    numbers.push_back(bit < kLowerBits ? checked - (kLowerBits - bit)
                                       : checked + (bit - kLowerBits + 1));
  }
}

}  // namespace

void GlobalCloud::Sums::add(const VoxelPoint& point) {
  ++count;
  weight += point.weight;
  weighted_offset += point.weight * point.offset;
  weighted_sigma += point.weight * point.sigma;
  weighted_probability += point.weight * point.probability;
}

void GlobalCloud::Sums::add(const Sums& other) {
  count += other.count;
  weight += other.weight;
  weighted_offset += other.weighted_offset;
  weighted_sigma = std::hypot(weighted_sigma, other.weighted_sigma);
  weighted_probability += other.weighted_probability;
}

void GlobalCloud::insert(std::uint64_t keyframe, const std::vector<CloudPoint>& points,
                         const std::optional<Rigid3>& T_world_ref) {
  if (finalized_below_ > 0) requireNotFinalized(keyframe, finalized_below_ + kMaxNumberDifference);
  if (keyframes_.count(keyframe) != 0) {
    throw std::invalid_argument("keyframe " + std::to_string(keyframe) + " is in the map already");
  }
  keyframes_.emplace(keyframe, keyframeOf(points, T_world_ref));
  checkMutually(keyframe);
}

void GlobalCloud::replace(std::uint64_t keyframe, const std::vector<CloudPoint>& points,
                          const std::optional<Rigid3>& T_world_ref) {
  requireNotFinalized(keyframe, finalized_below_);
  const auto replaced = keyframes_.find(keyframe);
  if (replaced == keyframes_.end()) rejectMissing(keyframe);
  Keyframe made = keyframeOf(points, T_world_ref);
  forgetVerdictsOf(keyframe);
  replaced->second = std::move(made);
  checkMutually(keyframe);
}

/// Makes a keyframe of the inliers, not yet checked by other keyframes.
GlobalCloud::Keyframe GlobalCloud::keyframeOf(const std::vector<CloudPoint>& points,
                                              const std::optional<Rigid3>& T_world_ref) const {
  const std::vector<CloudPoint> inliers = removeOutliers(points, options_.outliers);
  Keyframe keyframe;
  keyframe.voxels = voxelsOf(inliers);
  if (options_.consistency.consistency == Consistency::kNone) return keyframe;
  keyframe.verdicts.resize(keyframe.voxels.size());
  if (T_world_ref) keyframe.grid.emplace(inliers, *T_world_ref, options_.consistency);
  return keyframe;
}

/// Returns the sums of each voxel, sorted by voxel.
std::vector<GlobalCloud::Sums> GlobalCloud::voxelsOf(const std::vector<CloudPoint>& points) const {
  std::vector<VoxelPoint> located;
  located.reserve(points.size());
  for (const CloudPoint& point : points) {
    const VoxelPoint voxel = voxelPointOf(point);
    if (voxel.index.x >= slab_begin_ && voxel.index.x < slab_end_) located.push_back(voxel);
  }
  // The sort is stable: the points of a voxel are summed in their given order.
  std::stable_sort(located.begin(), located.end(),
                   [](const VoxelPoint& a, const VoxelPoint& b) { return a.index < b.index; });

  std::vector<Sums> voxels;
  for (const VoxelPoint& point : located) {
    if (voxels.empty() || !(voxels.back().index == point.index)) voxels.push_back({point.index});
    voxels.back().add(point);
  }
  voxels.shrink_to_fit();
  return voxels;
}

/// Calls visit(number, keyframe) for the keyframes with a number near `number`.
template <typename Visit>
void GlobalCloud::visitNeighbors(std::uint64_t number, const Visit& visit) {
  constexpr std::uint64_t kMax = kMaxNumberDifference;
  auto other = keyframes_.lower_bound(number < kMax ? 0 : number - kMax);
  for (; other != keyframes_.end(); ++other) {
    if (other->first > number && other->first - number > kMax) break;
    if (other->first != number) visit(other->first, other->second);
  }
}

/// Sets the bit in the verdicts of `checked` on each voxel that `by` supports or contradicts.
void GlobalCloud::check(Keyframe& checked, const Keyframe& by, unsigned bit) const {
  if (!by.grid) return;
  for (std::size_t i = 0; i < checked.voxels.size(); ++i) {
    const Verdict verdict = by.grid->verdictOn(positionOf(checked.voxels[i]));
    if (verdict == Verdict::kUnknown) continue;
    Verdicts& verdicts = checked.verdicts[i];
    std::uint16_t& bits =
        verdict == Verdict::kSupports ? verdicts.supports : verdicts.free_space_violations;
    bits = static_cast<std::uint16_t>(bits | 1U << bit);
  }
}

void GlobalCloud::checkMutually(std::uint64_t number) {
  if (options_.consistency.consistency == Consistency::kNone) return;
  Keyframe& keyframe = keyframes_.at(number);
  visitNeighbors(number, [&](std::uint64_t other, Keyframe& neighbor) {
    check(keyframe, neighbor, bitOf(other, number));
    check(neighbor, keyframe, bitOf(number, other));
  });
}

void GlobalCloud::remove(std::uint64_t keyframe) {
  requireNotFinalized(keyframe, finalized_below_);
  if (keyframes_.erase(keyframe) == 0) rejectMissing(keyframe);
  forgetVerdictsOf(keyframe);
}

void GlobalCloud::forgetVerdictsOf(std::uint64_t number) {
  visitNeighbors(number, [&](std::uint64_t other, Keyframe& neighbor) {
    const unsigned bits_left = ~(1U << bitOf(number, other));
    for (Verdicts& verdicts : neighbor.verdicts) {
      verdicts.supports = static_cast<std::uint16_t>(verdicts.supports & bits_left);
      verdicts.free_space_violations =
          static_cast<std::uint16_t>(verdicts.free_space_violations & bits_left);
    }
  });
}

bool GlobalCloud::isExcluded(const Keyframe& keyframe, std::size_t voxel) const {
  if (options_.consistency.consistency != Consistency::kVisibility) return false;
  const Verdicts& verdicts = keyframe.verdicts[voxel];
  const auto violations = std::bitset<16>(verdicts.free_space_violations).count();
  return verdicts.supports == 0 &&
         violations > static_cast<std::size_t>(options_.consistency.max_contradictions);
}

/// Merges the sorted voxels of the finalized keyframes and of the keyframes below a number, and
/// calls visit(voxel) for each voxel in order. The keyframes of a voxel are summed in the order of
/// their numbers.
template <typename Visit>
void GlobalCloud::visitVoxels(std::uint64_t below, const Visit& visit) const {
  struct Run {
    const Keyframe* keyframe;
    std::uint64_t number;
    std::size_t next;

    const VoxelIndex& index() const { return keyframe->voxels[next].index; }
  };
  const auto comes_later = [](const Run& a, const Run& b) {
    if (b.index() < a.index()) return true;
    return a.index() == b.index() && b.number < a.number;
  };
  std::vector<Run> runs;
  for (const auto& [number, keyframe] : keyframes_) {
    if (number < below && !keyframe.voxels.empty()) runs.push_back({&keyframe, number, 0});
  }
  std::make_heap(runs.begin(), runs.end(), comes_later);

  MergedVoxel voxel;
  auto finalized = finalized_.begin();
  while (!runs.empty() || finalized != finalized_.end()) {
    const bool starts_finalized = finalized != finalized_.end() &&
                                  (runs.empty() || !(runs.front().index() < finalized->sums.index));
    voxel.sums = starts_finalized ? finalized->sums : Sums{};
    voxel.first = starts_finalized ? finalized->first : std::numeric_limits<std::uint64_t>::max();
    voxel.older = starts_finalized ? finalized->older : 0;
    voxel.supporting.clear();
    if (starts_finalized) {
      for (unsigned bit = 0; bit < 2 * kLowerBits; ++bit) {
        if ((finalized->recent >> bit & 1U) == 0) continue;
        voxel.supporting.push_back(recentFrom(finalized_below_) + bit);
      }
      ++finalized;
    } else {
      voxel.sums.index = runs.front().index();
    }
    while (!runs.empty() && runs.front().index() == voxel.sums.index) {
      std::pop_heap(runs.begin(), runs.end(), comes_later);
      Run& run = runs.back();
      if (!isExcluded(*run.keyframe, run.next)) {
        voxel.sums.add(run.keyframe->voxels[run.next]);
        voxel.supporting.push_back(run.number);
        if (!run.keyframe->verdicts.empty()) {
          appendNumbers(run.keyframe->verdicts[run.next].supports, run.number, voxel.supporting);
        }
      }
      if (++run.next == run.keyframe->voxels.size()) {
        runs.pop_back();
      } else {
        std::push_heap(runs.begin(), runs.end(), comes_later);
      }
    }
    auto& supporting = voxel.supporting;
    std::sort(supporting.begin(), supporting.end());
    supporting.erase(std::unique(supporting.begin(), supporting.end()), supporting.end());
    if (voxel.support() == 0) continue;
    if (!supporting.empty()) voxel.first = std::min(voxel.first, supporting.front());
    visit(voxel);
  }
}

void GlobalCloud::finalize(std::uint64_t below) {
  if (below <= finalized_below_) return;
  const std::uint64_t recent_from = recentFrom(below);
  std::vector<FinalizedVoxel> finalized;
  finalized.reserve(finalized_.size());
  visitVoxels(below, [&](const MergedVoxel& voxel) {
    FinalizedVoxel merged{voxel.sums, voxel.first, voxel.older, 0};
    for (const std::uint64_t number : voxel.supporting) {
      if (number < recent_from) {
        ++merged.older;
      } else {
        merged.recent = static_cast<std::uint16_t>(merged.recent | 1U << (number - recent_from));
      }
    }
    finalized.push_back(merged);
  });
  finalized_ = std::move(finalized);
  const auto end = keyframes_.lower_bound(below);
  finalized_keyframes_ += static_cast<std::size_t>(std::distance(keyframes_.begin(), end));
  keyframes_.erase(keyframes_.begin(), end);
  finalized_below_ = below;
}

void GlobalCloud::keepSlab(std::int64_t begin, std::int64_t end) {
  slab_begin_ = begin;
  slab_end_ = end;
  /// Removes the others from sorted voxels, and from what is known of each.
  const auto cut = [&](auto& voxels, auto& verdicts, const auto& index_of) {
    const auto from = std::partition_point(
        voxels.begin(), voxels.end(), [&](const auto& voxel) { return index_of(voxel).x < begin; });
    const auto to = std::partition_point(
        from, voxels.end(), [&](const auto& voxel) { return index_of(voxel).x < end; });
    if (!verdicts.empty()) {
      verdicts.erase(verdicts.begin() + (to - voxels.begin()), verdicts.end());
      verdicts.erase(verdicts.begin(), verdicts.begin() + (from - voxels.begin()));
    }
    voxels.erase(to, voxels.end());
    voxels.erase(voxels.begin(), from);
  };
  for (auto& [number, keyframe] : keyframes_) {
    cut(keyframe.voxels, keyframe.verdicts, [](const Sums& sums) { return sums.index; });
  }
  std::vector<Verdicts> none;
  cut(finalized_, none, [](const FinalizedVoxel& voxel) { return voxel.sums.index; });
}

std::optional<std::int64_t> GlobalCloud::middleX() const {
  if (finalized_.empty()) return std::nullopt;
  const std::int64_t first = finalized_.front().sums.index.x;
  const std::int64_t middle = finalized_[finalized_.size() / 2].sums.index.x;
  if (middle > first) return middle;
  return finalized_.back().sums.index.x > first ? std::optional(first + 1) : std::nullopt;
}

std::size_t GlobalCloud::unfinalizedVoxels(std::uint64_t below) const {
  constexpr std::size_t kVoxelsPerKeyframe = 10;  // by memory
  std::size_t count = 0;
  for (auto at = keyframes_.begin(); at != keyframes_.end() && at->first < below; ++at) {
    count += kVoxelsPerKeyframe + at->second.voxels.size();
  }
  return count;
}

MapCloud::ConstPtr GlobalCloud::points(int min_keyframes) const {
  return mapCloudOf(pointsInWorld(min_keyframes), options_.voxel_size_m);
}

std::vector<CloudPoint> GlobalCloud::pointsInWorld(int min_keyframes) const {
  std::vector<CloudPoint> points;
  visitVoxels(std::numeric_limits<std::uint64_t>::max(), [&](const MergedVoxel& voxel) {
    if (static_cast<std::int64_t>(voxel.support()) < min_keyframes) return;
    points.push_back(pointOf(voxel));
  });
  return points;
}

GlobalCloud::VoxelPoint GlobalCloud::voxelPointOf(const CloudPoint& point) const {
  if (!point.p_world.allFinite()) rejectPoint(point, "the position is not finite");
  if (!(point.confidence > 0) || !std::isfinite(point.confidence)) {
    rejectPoint(point, "the confidence must be finite and above 0");
  }
  // 2^63 is exact in double, the largest 64-bit integer is not.
  constexpr double kIndexLimit = 9223372036854775808.0;
  const Eigen::Vector3d cell = (point.p_world / options_.voxel_size_m).array().floor();
  if (!(cell.minCoeff() >= -kIndexLimit && cell.maxCoeff() < kIndexLimit)) {
    rejectPoint(point, "too far from the origin for voxels of " +
                           std::to_string(options_.voxel_size_m) + " m");
  }
  return {{static_cast<std::int64_t>(cell.x()), static_cast<std::int64_t>(cell.y()),
           static_cast<std::int64_t>(cell.z())},
          point.p_world - cell * options_.voxel_size_m,
          static_cast<double>(point.confidence),
          static_cast<double>(point.sigma),
          static_cast<double>(point.probability)};
}

Eigen::Vector3d GlobalCloud::positionOf(const Sums& sums) const {
  const Eigen::Vector3d corner =
      Eigen::Vector3d(static_cast<double>(sums.index.x), static_cast<double>(sums.index.y),
                      static_cast<double>(sums.index.z)) *
      options_.voxel_size_m;
  return corner + sums.weighted_offset / sums.weight;
}

CloudPoint GlobalCloud::pointOf(const MergedVoxel& voxel) const {
  const Sums& sums = voxel.sums;
  return {positionOf(sums),
          static_cast<float>(sums.weight / static_cast<double>(sums.count)),
          static_cast<std::uint32_t>(voxel.support()),
          voxel.first,
          static_cast<float>(sums.weighted_sigma / sums.weight),
          static_cast<float>(sums.weighted_probability / sums.weight)};
}

}  // namespace efm
