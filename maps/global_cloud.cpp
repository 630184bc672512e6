// SPDX-License-Identifier: BSD-3-Clause
#include "maps/global_cloud.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "mapping/option_check.h"
#include "maps/point_text.h"

namespace efm {
namespace {

[[noreturn]] void refusePoint(const CloudPoint& point, const std::string& why) {
  std::ostringstream message;
  message.precision(17);
  message << pointText(point) << " with confidence " << point.confidence << ": " << why;
  throw std::invalid_argument(message.str());
}

}  // namespace

void GlobalCloudOptions::validate() const {
  requireOption(voxel_size_m >= 1e-6 && voxel_size_m <= 1000, "voxel_size_m", voxel_size_m,
                "from 1e-6 to 1000 (metres)");
  requireOption(min_keyframes >= 1, "min_keyframes", min_keyframes, "at least 1");
  outliers.validate();
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

void GlobalCloud::insert(std::uint64_t keyframe, const std::vector<CloudPoint>& points) {
  if (keyframes_.count(keyframe) != 0) {
    throw std::invalid_argument("keyframe " + std::to_string(keyframe) + " is in the map already");
  }
  const std::vector<CloudPoint> inliers = removeOutliers(points, options_.outliers);
  std::vector<PlacedPoint> placed;
  placed.reserve(inliers.size());
  for (const CloudPoint& point : inliers) placed.push_back(place(point));
  // Stable: within a voxel, points are summed in the order in which they came.
  std::stable_sort(placed.begin(), placed.end(),
                   [](const PlacedPoint& a, const PlacedPoint& b) { return a.index < b.index; });

  std::vector<Sums> voxels;
  for (const PlacedPoint& point : placed) {
    if (voxels.empty() || !(voxels.back().index == point.index)) voxels.push_back({point.index});
    voxels.back().add(point);
  }
  voxels.shrink_to_fit();
  keyframes_.emplace(keyframe, std::move(voxels));
}

void GlobalCloud::remove(std::uint64_t keyframe) {
  if (keyframes_.erase(keyframe) == 0) {
    throw std::invalid_argument("keyframe " + std::to_string(keyframe) + " is not in the map");
  }
}

/// Merges the keyframes' sorted voxels: visit(total, support), in the order of voxels. Within a
/// voxel, keyframes are summed in the order of their numbers.
template <typename Visit>
void GlobalCloud::visitVoxels(const Visit& visit) const {
  struct Run {
    const Sums* next;
    const Sums* end;
    std::size_t rank;  // in the order of keyframe numbers
  };
  const auto comes_later = [](const Run& a, const Run& b) {
    if (b.next->index < a.next->index) return true;
    return a.next->index == b.next->index && b.rank < a.rank;
  };
  std::vector<Run> runs;
  for (const auto& [number, voxels] : keyframes_) {
    if (voxels.empty()) continue;
    runs.push_back({voxels.data(), voxels.data() + voxels.size(), runs.size()});
  }
  std::make_heap(runs.begin(), runs.end(), comes_later);

  while (!runs.empty()) {
    Sums total;
    total.index = runs.front().next->index;
    std::uint32_t support = 0;
    while (!runs.empty() && runs.front().next->index == total.index) {
      std::pop_heap(runs.begin(), runs.end(), comes_later);
      total.add(*runs.back().next);
      ++support;
      if (++runs.back().next == runs.back().end) {
        runs.pop_back();
      } else {
        std::push_heap(runs.begin(), runs.end(), comes_later);
      }
    }
    visit(total, support);
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

CloudPoint GlobalCloud::pointOf(const Sums& total, std::uint32_t support) const {
  const Eigen::Vector3d corner =
      Eigen::Vector3d(static_cast<double>(total.index.x), static_cast<double>(total.index.y),
                      static_cast<double>(total.index.z)) *
      options_.voxel_size_m;
  return {corner + total.weighted_offset / total.weight,
          static_cast<float>(total.weight / static_cast<double>(total.count)), support};
}

}  // namespace efm
