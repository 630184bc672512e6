// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/kernels/kernels.h"

#include "mapping/kernels/highway_targets.h"

namespace efm::kernels {
namespace {

struct Target {
  VotingKernel kernel;
  std::int64_t bits;
};

constexpr Target kTargets[] = {
    {VotingKernel::kBaseline, HWY_SCALAR | HWY_EMU128},
    {VotingKernel::kSse4, HWY_SSE4},
    {VotingKernel::kAvx2, HWY_AVX2},
    {VotingKernel::kAvx512, HWY_AVX3},
    {VotingKernel::kNeon, HWY_NEON},
};

}  // namespace

std::vector<VotingKernel> availableKernels() {
  // The compiler's own baseline always runs, even if Highway's build did not detect it.
  const std::int64_t runnable = (HWY_SUPPORTED_TARGETS | HWY_STATIC_TARGET) & HWY_TARGETS;
  std::vector<VotingKernel> kernels = {VotingKernel::kPlain};
  for (const Target& target : kTargets) {
    if ((runnable & target.bits) != 0) kernels.push_back(target.kernel);
  }
  return kernels;
}

std::uint64_t voteBilinear(const RayArrays& rays, const RayTransfer& transfer,
                           const VotePlane& plane) {
  const auto right = static_cast<float>(plane.width - 1);
  const auto bottom = static_cast<float>(plane.height - 1);
  const std::ptrdiff_t stride = plane.width;
  std::uint64_t cast = 0;
  for (std::size_t i = transfer.begin; i < transfer.end; ++i) {
    const float x = transfer.scale * rays.x[i] + transfer.offset_x;
    const float y = transfer.scale * rays.y[i] + transfer.offset_y;
    // Non-finite coordinates fail this test too.
    if (!(x >= 0 && x < right && y >= 0 && y < bottom)) continue;
    const int column = static_cast<int>(x);
    const int row = static_cast<int>(y);
    const float to_right = x - static_cast<float>(column);
    const float to_bottom = y - static_cast<float>(row);
    float* upper = plane.votes + row * stride + column;
    float* lower = upper + stride;
    upper[0] += (1 - to_right) * (1 - to_bottom);
    upper[1] += to_right * (1 - to_bottom);
    lower[0] += (1 - to_right) * to_bottom;
    lower[1] += to_right * to_bottom;
    ++cast;
  }
  return cast;
}

}  // namespace efm::kernels
