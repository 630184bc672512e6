// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "maps/cloud/cloud_point.h"
#include "maps/cloud/keyframe_consistency.h"

namespace efm {

/// What a keyframe says of a point of another one.
enum class Verdict {
  kUnknown,   ///< It saw nothing there, or something nearer that hides the point.
  kSupports,  ///< It has a point there too.
  kFreeSpaceViolation,
};

/// What a keyframe saw, kept so that points of other keyframes can be compared with it: the
/// nearest and the farthest of its points in each cell of its view (in x / z and y / z of frame
/// `ref`). It is made of the keyframe's points and pose alone, so that a stored keyframe gives the
/// same; which is why the tolerance comes from the depths, not from a variance of each. 12 bytes a
/// cell.
class VisibilityGrid {
 public:
  /// @param points in the world; those that are not before the view's plane are passed over.
  VisibilityGrid(const std::vector<CloudPoint>& points, const Rigid3& T_world_ref,
                 const ConsistencyOptions& options);

  /// Compares a point with its cell and the eight around it, in inverse depth: any depth within the
  /// tolerance supports it; where at least two cells were seen and the point is nearer than all of
  /// them by more than twice the tolerance, the keyframe looks through it.
  Verdict verdictOn(const Eigen::Vector3d& p_world) const;

 private:
  struct Cell {
    std::int32_t column = 0;
    float nearest = 0;   // inverse depth, 1/m
    float farthest = 0;  // inverse depth, 1/m
  };

  Rigid3 T_ref_world_;
  double cells_per_unit_ = 1;
  double tolerance_ = 0;  // 1/m
  std::int32_t first_row_ = 0;
  std::vector<std::uint32_t> row_begin_;  // one more than rows; none where nothing was seen
  std::vector<Cell> cells_;               // by row, then column
};

}  // namespace efm
