// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "mapping/kernels/instruction_set.h"

namespace efm::kernels {

/// Rays that meet the plane at inverse depth q at (x + dx * q, y + dy * q), where
/// q < limit, or -q < limit where the limit is negative: elsewhere the plane is behind the camera.
/// Arrays owned by the caller, that need no alignment.
struct SlopedRays {
  const float* x = nullptr;
  const float* y = nullptr;
  const float* dx = nullptr;
  const float* dy = nullptr;
  const float* limit = nullptr;
  std::size_t n = 0;  ///< A multiple of `kRayBlock`.
};
constexpr std::size_t kRayBlock = 16;  ///< No vector has more lanes.

/// One plane of a DSI: row-major, each value the upper half of a float, rounded (bfloat16).
struct SampledPlane {
  const std::uint16_t* values = nullptr;
  int width = 0;
  int height = 0;
  float inverse_depth = 0;
};

enum class SamplePower { kOne, kTwo };

/// values[i] = the plane where ray i meets it, bilinear, to the power; 0 where a vote would not be
/// cast (see `votePlain`). Adds values[i] to sums[i].
using SampleRays = void(const SlopedRays& rays, const SampledPlane& plane, SamplePower power,
                        float* values, float* sums);

/// Writes the indices of values that are at least their threshold, increasing, and perhaps
/// `kRayBlock` more elements after them. @param n a multiple of `kRayBlock`. @return their number.
using FindLarge = std::size_t(const float* values, const float* thresholds, std::size_t n,
                              std::uint32_t* found);

struct RaySampleFunctions {
  SampleRays* sample = nullptr;
  FindLarge* find_large = nullptr;
};

/// The plain scalar functions: the specification.
const RaySampleFunctions& plainRaySamples();

/// @param kernel one of `runnableKernels`.
const RaySampleFunctions& raySampleFunctions(VotingKernel kernel);

}  // namespace efm::kernels
