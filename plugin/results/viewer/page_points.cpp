// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/viewer/page_points.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <unordered_set>
#include <utility>

namespace efm {
namespace {

constexpr double kMaxCell = 65535;
constexpr std::uint32_t kFree = std::numeric_limits<std::uint32_t>::max();

using GridCell = Eigen::Matrix<std::int64_t, 3, 1>;

GridCell gridCellOf(const Eigen::Vector3d& p_world, const Eigen::Vector3d& origin_m,
                    double cell_m) {
  return ((p_world - origin_m) / cell_m).array().floor().cast<std::int64_t>();
}

/// Mixes the bits of the three indices (the constants are odd and random).
std::uint64_t hashOf(const GridCell& cell) {
  std::uint64_t hash = 0;
  for (const std::int64_t index : {cell.x(), cell.y(), cell.z()}) {
    hash = (hash ^ static_cast<std::uint64_t>(index)) * 0x9E3779B97F4A7C15U;
    hash ^= hash >> 29U;
  }
  return hash;
}

bool isBetter(const MapPoint& a, const MapPoint& b) {
  return std::tie(a.support, a.intensity) > std::tie(b.support, b.intensity);
}

/// A stride near the golden section that visits each of n points once.
std::size_t longStride(std::size_t n) {
  auto stride = static_cast<std::size_t>(0.6180339887 * static_cast<double>(n)) | 1U;
  while (std::gcd(stride, n) > 1) ++stride;
  return stride;
}

std::uint16_t cellOf(double offset_m, double step_m) {
  if (!(step_m > 0)) return 0;
  return static_cast<std::uint16_t>(std::clamp(std::round(offset_m / step_m), 0.0, kMaxCell));
}

}  // namespace

void PagePoint::appendTo(std::vector<std::uint8_t>& bytes) const {
  const auto append = [&](std::uint16_t value) {
    bytes.push_back(static_cast<std::uint8_t>(value & 0xFFU));
    bytes.push_back(static_cast<std::uint8_t>(value >> 8U));
  };
  for (const std::uint16_t coordinate : cell) append(coordinate);
  bytes.push_back(confidence);
  bytes.push_back(support);
  append(keyframe);
}

PagePoints::PagePoints(const MapCloud& cloud, double voxel_size_m, std::size_t limit)
    : cloud_(cloud), limit_(limit) {
  if (cloud.empty()) return;
  Eigen::Vector3d max_m = positionIn(cloud, cloud.front());
  std::uint32_t last_keyframe = 0;
  origin_m_ = max_m;
  for (const MapPoint& point : cloud) {
    const Eigen::Vector3d p_world = positionIn(cloud, point);
    origin_m_ = origin_m_.cwiseMin(p_world);
    max_m = max_m.cwiseMax(p_world);
    last_keyframe = std::max(last_keyframe, point.first_keyframe);
  }
  step_m_ = (max_m - origin_m_) / kMaxCell;
  keyframe_step_ = last_keyframe / 65536 + 1;
  findConfidences();
  if (cloud.size() > limit) {
    double cell_m = voxel_size_m;
    const auto wanted = 0.97 * static_cast<double>(limit);
    constexpr int kMaxTrials = 20;  // four to ten suffice
    for (int trial = 0; trial < kMaxTrials; ++trial) {
      const double ratio = countCells(cell_m) / wanted;
      if (ratio > 0.95 && ratio < 1.01) break;
      // A map is made of surfaces: the number of their cells falls with the square of the edge.
      cell_m *= std::sqrt(ratio);
    }
    while (!thin(cell_m)) cell_m *= 1.03;
    thinned_m_ = cell_m;
  }
  stride_ = longStride(size());
}

/// An estimate of the number of cells that have points, from a fraction of all cells: a hash
/// selects them, some 20,000 of those that are wanted.
double PagePoints::countCells(double cell_m) const {
  const std::uint64_t divisor = limit_ / 20'000 + 1;
  std::unordered_set<std::uint64_t> cells;
  for (const MapPoint& point : cloud_) {
    const std::uint64_t hash = hashOf(gridCellOf(positionIn(cloud_, point), origin_m_, cell_m));
    if ((hash >> 32U) % divisor == 0) cells.insert(hash);
  }
  return static_cast<double>(divisor) * static_cast<double>(cells.size());
}

/// @return false as soon as there are too many cells.
bool PagePoints::thin(double cell_m) {
  std::size_t slots = 16;
  while (slots < 2 * limit_) slots *= 2;
  std::vector<std::uint32_t> table(slots, kFree);  // open addressing
  std::size_t used = 0;
  const auto cellAt = [&](std::uint32_t i) {
    return gridCellOf(positionIn(cloud_, cloud_[i]), origin_m_, cell_m);
  };
  for (std::uint32_t i = 0; i < cloud_.size(); ++i) {
    const GridCell cell = cellAt(i);
    std::size_t slot = hashOf(cell) & (slots - 1);
    while (table[slot] != kFree && cellAt(table[slot]) != cell) {
      slot = (slot + 1) & (slots - 1);
    }
    if (table[slot] == kFree) {
      if (++used > limit_) return false;
      table[slot] = i;
    } else if (isBetter(cloud_[i], cloud_[table[slot]])) {
      table[slot] = i;
    }
  }
  table.erase(std::remove(table.begin(), table.end(), kFree), table.end());
  std::sort(table.begin(), table.end());
  kept_ = std::move(table);
  return true;
}

void PagePoints::findConfidences() {
  std::vector<float> confidences(cloud_.size());
  std::transform(cloud_.begin(), cloud_.end(), confidences.begin(),
                 [](const MapPoint& point) { return point.intensity; });
  const auto percentile = [&](std::size_t percent) {
    const auto at =
        confidences.begin() + static_cast<std::ptrdiff_t>((confidences.size() - 1) * percent / 100);
    std::nth_element(confidences.begin(), at, confidences.end());
    return *at;
  };
  low_confidence_ = percentile(1);
  high_confidence_ = percentile(99);
}

PagePoint PagePoints::at(std::size_t i) const {
  const std::size_t walked = (i * stride_) % size();
  const MapPoint& point = cloud_[kept_.empty() ? walked : kept_[walked]];
  const Eigen::Vector3d p_world = positionIn(cloud_, point);
  PagePoint out;
  for (int axis = 0; axis < 3; ++axis) {
    out.cell[axis] = cellOf(p_world[axis] - origin_m_[axis], step_m_[axis]);
  }
  const float range = std::log(high_confidence_ / low_confidence_);
  const float level = range > 0 ? std::log(point.intensity / low_confidence_) / range : 1.0F;
  out.confidence = static_cast<std::uint8_t>(std::lround(255 * std::clamp(level, 0.0F, 1.0F)));
  out.support = static_cast<std::uint8_t>(std::min<std::uint32_t>(point.support, 255));
  out.keyframe = static_cast<std::uint16_t>(point.first_keyframe / keyframe_step_);
  return out;
}

}  // namespace efm
