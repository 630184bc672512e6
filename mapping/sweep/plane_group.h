// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace efm {

/// Consecutive depth planes.
struct PlaneGroup {
  int begin = 0;
  int end = 0;               ///< One past the last.
  double first_depth_m = 0;  ///< Of plane `begin`.
  double last_depth_m = 0;   ///< Of plane `end - 1`.
};

}  // namespace efm
