// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/visibility_grid.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "mapping/base/option.h"

namespace efm {
namespace {

/// The maximum of |x| / z and |y| / z in a view.
constexpr double kMaxTangent = 20;  // 87 degrees
/// One of 20 points may be nearer than the depth that sets the tolerance: it may be an outlier.
constexpr std::size_t kOneNearerOf = 20;

struct GridPoint {
  std::int32_t row;
  std::int32_t column;
  double inverse_depth;
};

bool isInFront(const Eigen::Vector3d& p_ref) {
  return p_ref.z() > 0 && std::abs(p_ref.x()) < kMaxTangent * p_ref.z() &&
         std::abs(p_ref.y()) < kMaxTangent * p_ref.z();
}

std::int32_t cellOf(double offset, double cells_per_depth) {
  return static_cast<std::int32_t>(std::floor(offset * cells_per_depth));
}

}  // namespace

VisibilityGrid::VisibilityGrid(const std::vector<CloudPoint>& points, const Rigid3& T_world_ref,
                               const ConsistencyOptions& options)
    : T_ref_world_(T_world_ref.inverse()),
      cells_per_unit_(180 / (kPi * options.consistency_cell_deg)) {
  std::vector<GridPoint> seen;
  seen.reserve(points.size());
  for (const CloudPoint& point : points) {
    const Eigen::Vector3d p_ref = T_ref_world_ * point.p_world;
    if (!isInFront(p_ref)) continue;
    const double inverse_depth = 1 / p_ref.z();
    seen.push_back({cellOf(p_ref.y(), cells_per_unit_ * inverse_depth),
                    cellOf(p_ref.x(), cells_per_unit_ * inverse_depth), inverse_depth});
  }
  if (seen.empty()) return;

  const auto nearest = seen.begin() + static_cast<std::ptrdiff_t>(seen.size() / kOneNearerOf);
  std::nth_element(seen.begin(), nearest, seen.end(), [](const GridPoint& a, const GridPoint& b) {
    return a.inverse_depth > b.inverse_depth;
  });
  tolerance_ = options.consistency_tolerance * nearest->inverse_depth;

  std::sort(seen.begin(), seen.end(), [](const GridPoint& a, const GridPoint& b) {
    if (a.row != b.row) return a.row < b.row;
    if (a.column != b.column) return a.column < b.column;
    return a.inverse_depth < b.inverse_depth;
  });
  first_row_ = seen.front().row;
  for (auto begin = seen.begin(); begin != seen.end();) {
    auto end = begin;
    while (end != seen.end() && end->row == begin->row && end->column == begin->column) ++end;
    const auto row = static_cast<std::size_t>(begin->row - first_row_);
    row_begin_.resize(std::max(row_begin_.size(), row + 1),
                      static_cast<std::uint32_t>(cells_.size()));
    cells_.push_back({begin->column, static_cast<float>(std::prev(end)->inverse_depth),
                      static_cast<float>(begin->inverse_depth)});
    begin = end;
  }
  row_begin_.push_back(static_cast<std::uint32_t>(cells_.size()));
}

Verdict VisibilityGrid::verdictOn(const Eigen::Vector3d& p_world) const {
  const Eigen::Vector3d p_ref = T_ref_world_ * p_world;
  if (row_begin_.empty() || !isInFront(p_ref)) return Verdict::kUnknown;
  const double inverse_depth = 1 / p_ref.z();
  const std::int32_t row = cellOf(p_ref.y(), cells_per_unit_ * inverse_depth) - first_row_;
  const std::int32_t column = cellOf(p_ref.x(), cells_per_unit_ * inverse_depth);

  int cells = 0;
  bool nearer_than_all = true;
  const auto rows = static_cast<std::int32_t>(row_begin_.size()) - 1;
  for (std::int32_t r = std::max(row - 1, 0); r <= std::min(row + 1, rows - 1); ++r) {
    const Cell* const end = cells_.data() + row_begin_[static_cast<std::size_t>(r) + 1];
    const Cell* cell = std::lower_bound(
        cells_.data() + row_begin_[static_cast<std::size_t>(r)], end, column - 1,
        [](const Cell& some, std::int32_t wanted) { return some.column < wanted; });
    for (; cell != end && cell->column <= column + 1; ++cell) {
      const double nearer_by = inverse_depth - static_cast<double>(cell->nearest);
      const double farthest_by = inverse_depth - static_cast<double>(cell->farthest);
      if (std::min(std::abs(nearer_by), std::abs(farthest_by)) <= tolerance_) {
        return Verdict::kSupports;
      }
      nearer_than_all = nearer_than_all && nearer_by > 2 * tolerance_;
      ++cells;
    }
  }
  return cells >= 2 && nearer_than_all ? Verdict::kFreeSpaceViolation : Verdict::kUnknown;
}

}  // namespace efm
