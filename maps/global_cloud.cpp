// SPDX-License-Identifier: BSD-3-Clause
#include "maps/global_cloud.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <tuple>

#include "mapping/option_check.h"

namespace efm {
namespace {

[[noreturn]] void refusePoint(const CloudPoint& point, const std::string& why) {
  std::ostringstream message;
  message.precision(17);
  message << "point (" << point.p_world.x() << ", " << point.p_world.y() << ", "
          << point.p_world.z() << ") with confidence " << point.confidence << ": " << why;
  throw std::invalid_argument(message.str());
}

/// The finaliser of splitmix64: every bit of the result depends on every bit of the value.
std::uint64_t mixed(std::uint64_t value) {
  value += 0x9e3779b97f4a7c15ULL;
  value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9ULL;
  value = (value ^ (value >> 27)) * 0x94d049bb133111ebULL;
  return value ^ (value >> 31);
}

}  // namespace

void GlobalCloudOptions::validate() const {
  requireOption(voxel_size_m >= 1e-6 && voxel_size_m <= 1000, "voxel_size_m", voxel_size_m,
                "from 1e-6 to 1000 (metres)");
  requireOption(min_keyframes >= 1, "min_keyframes", min_keyframes, "at least 1");
}

bool GlobalCloud::VoxelIndex::operator<(const VoxelIndex& o) const {
  return std::tie(x, y, z) < std::tie(o.x, o.y, o.z);
}

std::size_t GlobalCloud::VoxelHash::operator()(const VoxelIndex& index) const {
  std::uint64_t hash = mixed(static_cast<std::uint64_t>(index.x));
  hash = mixed(hash ^ static_cast<std::uint64_t>(index.y));
  return mixed(hash ^ static_cast<std::uint64_t>(index.z));
}

GlobalCloud::GlobalCloud(const GlobalCloudOptions& options) : options_(options) {
  options_.validate();
}

void GlobalCloud::insert(std::uint64_t keyframe, const std::vector<CloudPoint>& points) {
  if (keyframes_.count(keyframe) != 0) {
    throw std::invalid_argument("keyframe " + std::to_string(keyframe) + " is in the map already");
  }
  std::vector<PlacedPoint> placed;
  placed.reserve(points.size());
  for (const CloudPoint& point : points) placed.push_back(place(point));

  keyframes_.insert(keyframe);
  for (const PlacedPoint& point : placed) {
    std::vector<Sums>& voxel = voxels_[point.index];
    const auto at = std::lower_bound(
        voxel.begin(), voxel.end(), keyframe,
        [](const Sums& sums, std::uint64_t number) { return sums.keyframe < number; });
    const bool known = at != voxel.end() && at->keyframe == keyframe;
    Sums& sums = known ? *at : *voxel.insert(at, Sums{keyframe});
    ++sums.count;
    sums.weight += point.weight;
    sums.weighted_offset += point.weight * point.offset;
  }
}

std::vector<CloudPoint> GlobalCloud::points(int min_keyframes) const {
  using Voxel = decltype(voxels_)::value_type;
  std::vector<const Voxel*> kept;
  for (const Voxel& voxel : voxels_) {
    if (static_cast<std::int64_t>(voxel.second.size()) >= min_keyframes) kept.push_back(&voxel);
  }
  std::sort(kept.begin(), kept.end(),
            [](const Voxel* a, const Voxel* b) { return a->first < b->first; });

  std::vector<CloudPoint> points;
  points.reserve(kept.size());
  for (const Voxel* voxel : kept) points.push_back(pointOf(voxel->first, voxel->second));
  return points;
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

CloudPoint GlobalCloud::pointOf(const VoxelIndex& index, const std::vector<Sums>& sums) const {
  Sums total;
  for (const Sums& one : sums) {
    total.count += one.count;
    total.weight += one.weight;
    total.weighted_offset += one.weighted_offset;
  }
  const Eigen::Vector3d corner =
      Eigen::Vector3d(static_cast<double>(index.x), static_cast<double>(index.y),
                      static_cast<double>(index.z)) *
      options_.voxel_size_m;
  return {corner + total.weighted_offset / total.weight,
          static_cast<float>(total.weight / static_cast<double>(total.count)),
          static_cast<std::uint32_t>(sums.size())};
}

}  // namespace efm
