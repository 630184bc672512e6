// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/global_cloud.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "mapping/options/option_check.h"
#include "maps/cloud/point_text.h"

namespace efm {
namespace {

[[noreturn]] void refusePoint(const CloudPoint& point, const std::string& why) {
  std::ostringstream message;
  message.precision(17);
  message << pointText(point) << " with confidence " << point.confidence << ": " << why;
  throw std::invalid_argument(message.str());
}

constexpr unsigned kReachBits = GlobalCloud::kReach;

/// The bit that stands for a keyframe in what is kept of another's voxels: the numbers below that
/// one's, from the lowest, then those above.
unsigned bitOf(std::uint64_t judge, std::uint64_t judged) {
  return judge < judged ? kReachBits - static_cast<unsigned>(judged - judge)
                        : kReachBits - 1 + static_cast<unsigned>(judge - judged);
}

/// The keyframes that the bits of one's voxel stand for.
void appendNumbers(unsigned bits, std::uint64_t judged, std::vector<std::uint64_t>& numbers) {
  for (unsigned bit = 0; bit < 2 * kReachBits; ++bit) {
    if ((bits >> bit & 1U) == 0) continue;
    numbers.push_back(bit < kReachBits ? judged - (kReachBits - bit)
                                       : judged + (bit - kReachBits + 1));
  }
}

}  // namespace

void GlobalCloudOptions::validate() const {
  requireOption(voxel_size_m >= 1e-6 && voxel_size_m <= 1000, "voxel_size_m", voxel_size_m,
                "from 1e-6 to 1000 (metres)");
  requireOption(min_keyframes >= 1, "min_keyframes", min_keyframes, "at least 1");
  outliers.validate();
  consistency.validate();
}

bool GlobalCloud::VoxelIndex::operator<(const VoxelIndex& o) const {
  return std::tie(x, y, z) < std::tie(o.x, o.y, o.z);
}

void GlobalCloud::Sums::add(const PlacedPoint& point) {
  ++count;
  weight += point.weight;
  weighted_offset += point.weight * point.offset;
}

void GlobalCloud::Sums::add(const Sums& other) {
  count += other.count;
  weight += other.weight;
  weighted_offset += other.weighted_offset;
}

GlobalCloud::GlobalCloud(const GlobalCloudOptions& options) : options_(options) {
  options_.validate();
}

void GlobalCloud::insert(std::uint64_t keyframe, const std::vector<CloudPoint>& points,
                         const std::optional<Rigid3>& T_world_ref) {
  if (keyframes_.count(keyframe) != 0) {
    throw std::invalid_argument("keyframe " + std::to_string(keyframe) + " is in the map already");
  }
  const std::vector<CloudPoint> inliers = removeOutliers(points, options_.outliers);
  Keyframe inserted;
  inserted.voxels = voxelsOf(inliers);
  const bool consistent = options_.consistency.consistency != Consistency::kNone;
  if (consistent) inserted.verdicts.resize(inserted.voxels.size());
  if (consistent && T_world_ref) {
    inserted.sight.emplace(inliers, *T_world_ref, options_.consistency);
  }
  keyframes_.emplace(keyframe, std::move(inserted));
  if (consistent) compareWithOthers(keyframe);
}

void GlobalCloud::requireInsertable(const std::vector<CloudPoint>& points) const {
  for (const CloudPoint& point : points) place(point);
}

/// One sum per voxel, sorted.
std::vector<GlobalCloud::Sums> GlobalCloud::voxelsOf(const std::vector<CloudPoint>& points) const {
  std::vector<PlacedPoint> placed;
  placed.reserve(points.size());
  for (const CloudPoint& point : points) placed.push_back(place(point));
  // Stable: within a voxel, points are summed in the order in which they came.
  std::stable_sort(placed.begin(), placed.end(),
                   [](const PlacedPoint& a, const PlacedPoint& b) { return a.index < b.index; });

  std::vector<Sums> voxels;
  for (const PlacedPoint& point : placed) {
    if (voxels.empty() || !(voxels.back().index == point.index)) voxels.push_back({point.index});
    voxels.back().add(point);
  }
  voxels.shrink_to_fit();
  return voxels;
}

/// visit(number, keyframe) for those that a keyframe of this number is compared with.
template <typename Visit>
void GlobalCloud::visitWithinReach(std::uint64_t number, const Visit& visit) {
  constexpr std::uint64_t kFar = kReach;
  auto other = keyframes_.lower_bound(number < kFar ? 0 : number - kFar);
  for (; other != keyframes_.end(); ++other) {
    if (other->first > number && other->first - number > kFar) break;
    if (other->first != number) visit(other->first, other->second);
  }
}

void GlobalCloud::judge(Keyframe& judged, const Keyframe& by, unsigned bit) const {
  if (!by.sight) return;
  for (std::size_t i = 0; i < judged.voxels.size(); ++i) {
    const Verdict verdict = by.sight->verdictOn(positionOf(judged.voxels[i]));
    if (verdict == Verdict::kUnknown) continue;
    Verdicts& verdicts = judged.verdicts[i];
    std::uint16_t& bits =
        verdict == Verdict::kSupports ? verdicts.supports : verdicts.looks_through;
    bits = static_cast<std::uint16_t>(bits | 1U << bit);
  }
}

void GlobalCloud::compareWithOthers(std::uint64_t number) {
  Keyframe& keyframe = keyframes_.at(number);
  visitWithinReach(number, [&](std::uint64_t other, Keyframe& within_reach) {
    judge(keyframe, within_reach, bitOf(other, number));
    judge(within_reach, keyframe, bitOf(number, other));
  });
}

void GlobalCloud::remove(std::uint64_t keyframe) {
  if (keyframes_.erase(keyframe) == 0) {
    throw std::invalid_argument("keyframe " + std::to_string(keyframe) + " is not in the map");
  }
  visitWithinReach(keyframe, [&](std::uint64_t other, Keyframe& within_reach) {
    const unsigned bits_left = ~(1U << bitOf(keyframe, other));
    for (Verdicts& verdicts : within_reach.verdicts) {
      verdicts.supports = static_cast<std::uint16_t>(verdicts.supports & bits_left);
      verdicts.looks_through = static_cast<std::uint16_t>(verdicts.looks_through & bits_left);
    }
  });
}

bool GlobalCloud::leftOut(const Keyframe& keyframe, std::size_t voxel) const {
  if (options_.consistency.consistency != Consistency::kVisibility) return false;
  const Verdicts& verdicts = keyframe.verdicts[voxel];
  const auto looks_through = std::bitset<16>(verdicts.looks_through).count();
  return verdicts.supports == 0 &&
         looks_through > static_cast<std::size_t>(options_.consistency.max_contradictions);
}

/// Merges the keyframes' sorted voxels: visit(total, support), in the order of voxels. Within a
/// voxel, keyframes are summed in the order of their numbers.
template <typename Visit>
void GlobalCloud::visitVoxels(const Visit& visit) const {
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
    if (!keyframe.voxels.empty()) runs.push_back({&keyframe, number, 0});
  }
  std::make_heap(runs.begin(), runs.end(), comes_later);

  std::vector<std::uint64_t> supporting;  // numbers of keyframes
  while (!runs.empty()) {
    Sums total;
    total.index = runs.front().index();
    supporting.clear();
    while (!runs.empty() && runs.front().index() == total.index) {
      std::pop_heap(runs.begin(), runs.end(), comes_later);
      Run& run = runs.back();
      if (!leftOut(*run.keyframe, run.next)) {
        total.add(run.keyframe->voxels[run.next]);
        supporting.push_back(run.number);
        if (!run.keyframe->verdicts.empty()) {
          appendNumbers(run.keyframe->verdicts[run.next].supports, run.number, supporting);
        }
      }
      if (++run.next == run.keyframe->voxels.size()) {
        runs.pop_back();
      } else {
        std::push_heap(runs.begin(), runs.end(), comes_later);
      }
    }
    if (supporting.empty()) continue;
    std::sort(supporting.begin(), supporting.end());
    const auto end = std::unique(supporting.begin(), supporting.end());
    visit(total, static_cast<std::uint32_t>(end - supporting.begin()));
  }
}

std::vector<CloudPoint> GlobalCloud::points(int min_keyframes) const {
  std::vector<CloudPoint> points;
  visitVoxels([&](const Sums& total, std::uint32_t support) {
    if (std::int64_t{support} >= min_keyframes) points.push_back(pointOf(total, support));
  });
  return points;
}

std::size_t GlobalCloud::voxels() const {
  std::size_t count = 0;
  visitVoxels([&](const Sums&, std::uint32_t) { ++count; });
  return count;
}

GlobalCloud::PlacedPoint GlobalCloud::place(const CloudPoint& point) const {
  if (!point.p_world.allFinite()) refusePoint(point, "the position is not finite");
  if (!(point.confidence > 0) || !std::isfinite(point.confidence)) {
    refusePoint(point, "the confidence must be finite and above 0");
  }
  // 2^63 is a double, the largest 64-bit integer is not.
  constexpr double kIndexLimit = 9223372036854775808.0;
  const Eigen::Vector3d cell = (point.p_world / options_.voxel_size_m).array().floor();
  if (!(cell.minCoeff() >= -kIndexLimit && cell.maxCoeff() < kIndexLimit)) {
    refusePoint(point, "too far from the origin for voxels of " +
                           std::to_string(options_.voxel_size_m) + " m");
  }
  return {{static_cast<std::int64_t>(cell.x()), static_cast<std::int64_t>(cell.y()),
           static_cast<std::int64_t>(cell.z())},
          point.p_world - cell * options_.voxel_size_m,
          static_cast<double>(point.confidence)};
}

Eigen::Vector3d GlobalCloud::positionOf(const Sums& sums) const {
  const Eigen::Vector3d corner =
      Eigen::Vector3d(static_cast<double>(sums.index.x), static_cast<double>(sums.index.y),
                      static_cast<double>(sums.index.z)) *
      options_.voxel_size_m;
  return corner + sums.weighted_offset / sums.weight;
}

CloudPoint GlobalCloud::pointOf(const Sums& total, std::uint32_t support) const {
  return {positionOf(total), static_cast<float>(total.weight / static_cast<double>(total.count)),
          support};
}

}  // namespace efm
