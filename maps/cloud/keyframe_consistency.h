// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

namespace efm {

/// How keyframes check each other's points.
enum class Consistency {
  kNone,        ///< No check: only points in the same voxel support each other.
  kSupport,     ///< A keyframe supports a point of another one where it has a point, too.
  kVisibility,  ///< As kSupport; free-space violations without support are excluded.
};

std::string_view nameOf(Consistency consistency);
/// @throws std::invalid_argument naming the value and the known names.
Consistency consistencyFromName(std::string_view name);

struct ConsistencyOptions {
  /// Keyframes measure depth from different events. Their correct depths agree, wrong ones seldom
  /// do.
  Consistency consistency = Consistency::kVisibility;
  /// The maximum difference in inverse depth between a point and its support, as a fraction of the
  /// maximum inverse depth in view. A point that is nearer than all points around it by more than
  /// twice the tolerance is a free-space violation. Range: 0.001 to 1. One of 100 depth planes is
  /// 0.01.
  double consistency_tolerance = 0.03;
  /// Side of the cells of the visibility grid, as an angle. Range: 0.01 to 10. A point is compared
  /// with its cell and the eight adjacent ones, which must cover the errors of the poses.
  double consistency_cell_deg = 0.5;
  /// A point without support is excluded where it has more free-space violations. Range: 0 to 16.
  int max_contradictions = 0;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

}  // namespace efm
