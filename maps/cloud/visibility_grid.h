// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mapping/base/named_choice.h"
#include "mapping/base/option.h"
#include "mapping/geometry/rigid3.h"
#include "maps/cloud/cloud_points.h"

namespace efm {

/// The way in which keyframes check each other's points.
enum class Consistency {
  kNone,        ///< No check: only points in the same voxel support each other.
  kSupport,     ///< A keyframe supports another one's point if it has a point there, too.
  kVisibility,  ///< As kSupport; points that violate free space without support are excluded.
};

template <>
inline constexpr NamedChoice<Consistency> kNamesOf<Consistency>[] = {
    {Consistency::kNone, "none"},
    {Consistency::kSupport, "support"},
    {Consistency::kVisibility, "visibility"},
};

struct ConsistencyOptions {
  /// Keyframes measure depth from different events. Their correct depths agree, wrong depths seldom
  /// do.
  Consistency consistency = Consistency::kVisibility;
  /// The maximum difference in inverse depth between a point and its support, as a fraction of the
  /// maximum inverse depth in view. A point that is nearer than all points around it by more than
  /// twice the tolerance is a free-space violation. Range: 0.001 to 1. One plane of 100 is 0.01.
  double consistency_tolerance = 0.03;
  /// Side of the cells of the visibility grid, as an angle. Range: 0.01 to 10. A point is compared
  /// with its cell and the eight adjacent cells, which must be larger than the errors of the poses.
  double consistency_cell_deg = 0.5;
  /// Maximum free-space violations of a point without support; more exclude it. Range: 0 to 16.
  int max_contradictions = 0;

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("consistency", self.consistency);
    visit("consistency_tolerance", self.consistency_tolerance,
          Allowed::from(0.001, 1, "from 0.001 to 1"));
    visit("consistency_cell_deg", self.consistency_cell_deg,
          Allowed::from(0.01, 10, "from 0.01 to 10 (degrees)"));
    visit("max_contradictions", self.max_contradictions, Allowed::from(0, 16, "from 0 to 16"));
  }
  void validate() const { requireFields(*this); }
};

/// The verdict of a keyframe on a point of another keyframe.
enum class Verdict {
  kUnknown,             ///< The keyframe has no points there, or nearer points that hide it.
  kSupports,            ///< The keyframe has a point there, too.
  kFreeSpaceViolation,  ///< All points of the keyframe are well behind: the space is free.
};

/// The visible points of a keyframe, to check the points of other keyframes: the minimum and the
/// maximum depth in each cell of a grid over its view (x / z and y / z of frame `ref`). It is built
/// from the points and the pose alone, so a stored keyframe gives the same grid. Therefore the
/// tolerance depends on the depths, not on a variance per point. 12 bytes per cell.
class VisibilityGrid {
 public:
  /// @param points in the world; points behind the view are ignored.
  VisibilityGrid(const std::vector<CloudPoint>& points, const Rigid3& T_world_ref,
                 const ConsistencyOptions& options);

  /// Compares the inverse depth of a point with its cell and the eight adjacent cells. A depth
  /// within the tolerance supports the point. The point violates free space if at least two cells
  /// have depths and it is nearer than all these depths by more than twice the tolerance.
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
  std::vector<std::uint32_t> row_begin_;  // one more than rows; empty without points
  std::vector<Cell> cells_;               // by row, then column
};

}  // namespace efm
