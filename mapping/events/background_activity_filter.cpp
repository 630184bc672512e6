// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/background_activity_filter.h"

#include <algorithm>
#include <array>

#include "mapping/geometry/timestamp.h"

namespace efm {

BackgroundActivityFilter::BackgroundActivityFilter(int width, int height, std::int64_t support_ns)
    : support_ns_(support_ns),
      stride_(static_cast<std::size_t>(width) + 2),
      newest_ns_(stride_ * (static_cast<std::size_t>(height) + 2), kMinTimeNs) {}

bool BackgroundActivityFilter::isIsolated(const Event& event) {
  std::int64_t* pixel = newest_ns_.data() + (std::size_t{event.y} + 1) * stride_ + event.x + 1;
  *pixel = event.t_ns;
  const std::int64_t from_ns = event.t_ns - support_ns_;
  const auto row = static_cast<std::ptrdiff_t>(stride_);
  const std::array<std::ptrdiff_t, 8> neighbors = {-1,      1,        -row,    row,
                                                   row - 1, -row + 1, row + 1, -row - 1};
  return std::none_of(neighbors.begin(), neighbors.end(),
                      [&](std::ptrdiff_t offset) { return pixel[offset] >= from_ns; });
}

}  // namespace efm
