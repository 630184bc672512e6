// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mapping/events/event.h"

namespace efm {

/// Finds isolated events. An edge fires in neighbouring pixels within a short time; noise of a
/// pixel comes alone (Delbruck, "Frame-free dynamic digital vision", Proc. Intl. Symp. on
/// Secure-Life Electronics, 2008). The first event of an edge in a quiet part of the image is
/// isolated, too.
class BackgroundActivityFilter {
 public:
  /// @param support_ns an event is isolated if none of its eight neighbours fired in this time
  /// before it. Above 0; an edge crosses a pixel in about 1 / (pixels per second).
  BackgroundActivityFilter(int width, int height, std::int64_t support_ns);

  /// @param event the next one of the camera, in time order, inside the sensor. It supports later
  /// ones, isolated or not. Constant cost.
  bool isIsolated(const Event& event);

 private:
  std::int64_t support_ns_;
  std::size_t stride_;
  std::vector<std::int64_t> newest_ns_;  // per pixel, row-major, with a frame of one silent pixel
};

}  // namespace efm
