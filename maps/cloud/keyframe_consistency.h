// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

namespace efm {

/// What keyframes say of each other's points.
enum class Consistency {
  kNone,        ///< Nothing: only points in the same voxel support each other.
  kSupport,     ///< A keyframe that sees a point where another one has it supports it.
  kVisibility,  ///< And what others look through, and none supports, is left out.
};

std::string_view nameOf(Consistency consistency);
/// @throws std::invalid_argument naming the value and what is known.
Consistency consistencyFromName(std::string_view name);

struct ConsistencyOptions {
  /// The depth of an edge is found in each keyframe anew, from other events: where it is right they
  /// agree, where it is wrong they seldom do.
  Consistency consistency = Consistency::kVisibility;
  /// Up to which difference in inverse depth two keyframes mean the same point, as a share of the
  /// largest inverse depth that they see; over twice as much one looks through the other's. Range:
  /// 0.001 to 1. Errors of depth are equal in inverse depth, as the planes are: a plane of a
  /// hundred is 0.01.
  double consistency_tolerance = 0.03;
  /// Side of the cells in which a keyframe remembers what it saw, as an angle. Range: 0.01 to 10. A
  /// point is compared with its cell and the eight around it: wide enough for errors of poses.
  double consistency_cell_deg = 0.5;
  /// A point that no other keyframe supports is left out where more than so many look through it.
  /// Range: 0 to 16.
  int max_contradictions = 0;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

}  // namespace efm
