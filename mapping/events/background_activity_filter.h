// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mapping/events/event.h"

namespace efm {

/// Finds events that nothing around them supports: an edge fires in neighbouring pixels within a
/// short time, the noise of a pixel comes alone (Delbruck, "Frame-free dynamic digital vision",
/// Proc. Intl. Symp. on Secure-Life Electronics, 2008). The first event of an edge that reaches a
/// quiet part of the image is lost with it.
class BackgroundActivityFilter {
 public:
  /// @param support_ns how long before an event one of its eight neighbours must have fired. Above
  /// 0; a pixel of the image in motion takes about 1 / (pixels per second).
  BackgroundActivityFilter(int width, int height, std::int64_t support_ns);

  /// Takes the next event of the camera, in time order; it lies inside the sensor. Whether isolated
  /// or not, it supports those after it. Constant cost: at most eight times are read, one written.
  bool isIsolated(const Event& event);

 private:
  std::int64_t support_ns_;
  std::size_t stride_;
  std::vector<std::int64_t> newest_ns_;  // per pixel, row-major, with a frame of one silent pixel
};

}  // namespace efm
