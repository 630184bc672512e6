// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstring>

#include "mapping/kernels/ray_samples.h"

namespace efm::kernels {
namespace {

float widen(std::uint16_t value) {
  const std::uint32_t bits = std::uint32_t{value} << 16U;
  float wide = 0;
  std::memcpy(&wide, &bits, sizeof(wide));
  return wide;
}

float sampleAt(const SampledPlane& plane, float x, float y) {
  const int column = static_cast<int>(x);
  const int row = static_cast<int>(y);
  const float to_right = x - static_cast<float>(column);
  const float to_bottom = y - static_cast<float>(row);
  const std::uint16_t* upper = plane.values + std::ptrdiff_t{row} * plane.width + column;
  const std::uint16_t* lower = upper + plane.width;
  const float above = widen(upper[0]) + to_right * (widen(upper[1]) - widen(upper[0]));
  const float below = widen(lower[0]) + to_right * (widen(lower[1]) - widen(lower[0]));
  return above + to_bottom * (below - above);
}

void sample(const SlopedRays& rays, const SampledPlane& plane, SamplePower power, float* values,
            float* sums) {
  const auto right = static_cast<float>(plane.width - 1);
  const auto bottom = static_cast<float>(plane.height - 1);
  const float q = plane.inverse_depth;
  for (std::size_t i = 0; i < rays.n; ++i) {
    const float x = rays.x[i] + rays.dx[i] * q;
    const float y = rays.y[i] + rays.dy[i] * q;
    const bool in_front = std::copysign(q, rays.limit[i]) < rays.limit[i];
    float value = 0;
    if (in_front && x >= 0 && x < right && y >= 0 && y < bottom) value = sampleAt(plane, x, y);
    if (power == SamplePower::kTwo) value *= value;
    values[i] = value;
    sums[i] += value;
  }
}

std::size_t findLarge(const float* values, const float* thresholds, std::size_t n,
                      std::uint32_t* found) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (values[i] >= thresholds[i]) found[count++] = static_cast<std::uint32_t>(i);
  }
  return count;
}

}  // namespace

const RaySampleFunctions& plainRaySamples() {
  static constexpr RaySampleFunctions kFunctions = {sample, findLarge};
  return kFunctions;
}

}  // namespace efm::kernels
