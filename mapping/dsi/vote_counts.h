// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace efm {

/// Counts of votes. One vote is one used event on one plane:
/// cast + outside_view + behind_camera = events x planes.
struct VoteCounts {
  std::uint64_t cast = 0;
  std::uint64_t outside_view = 0;   ///< Not all four neighbouring pixels lie inside the view.
  std::uint64_t behind_camera = 0;  ///< The plane point is behind the camera that saw the event.

  std::uint64_t total() const { return cast + outside_view + behind_camera; }
  VoteCounts& operator+=(const VoteCounts& other) {
    cast += other.cast;
    outside_view += other.outside_view;
    behind_camera += other.behind_camera;
    return *this;
  }
};

}  // namespace efm
