// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/kernels/peaks.h"

namespace efm::kernels {
namespace {

constexpr float kNoValue = -1;

void take(const PeakArrays& peaks, std::int32_t plane, const float* values, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    const float value = values[i];
    if (value > peaks.best[i]) {
      peaks.best[i] = value;
      peaks.before[i] = peaks.previous[i];
      peaks.after[i] = kNoValue;
      peaks.plane[i] = plane;
    } else if (peaks.plane[i] == plane - 1) {
      peaks.after[i] = value;
    }
    peaks.previous[i] = value;
  }
}

}  // namespace

const PeakFunctions& plainPeaks() {
  static constexpr PeakFunctions kFunctions = {take};
  return kFunctions;
}

}  // namespace efm::kernels
