// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/prior_dsi.h"

#include <cstring>

namespace efm {
namespace {

/// The upper half of a float that is finite and not negative, rounded to the nearest, ties to even.
std::uint16_t narrow(float value) {
  constexpr std::uint32_t kHalf = 0x7FFF;
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof(bits));
  return static_cast<std::uint16_t>((bits + kHalf + ((bits >> 16U) & 1U)) >> 16U);
}

}  // namespace

// The values are not cleared: each is written, and touching them twice costs as much as a sweep.
PriorDsi::PriorDsi(const ReferenceView& view, const DepthPlanes& planes)
    : width_(view.width),
      height_(view.height),
      values_(new std::uint16_t[static_cast<std::size_t>(planes.size()) * view.pixels()]) {
  for (int plane = 0; plane < planes.size(); ++plane) {
    inverse_depths_.push_back(static_cast<float>(1 / planes.depth(plane)));
  }
}

void PriorDsi::takeTile(int plane, const cv::Rect& tile, const PlaneValues& values) {
  const auto stride = static_cast<std::size_t>(width_);
  std::uint16_t* to = values_.get() + indexOf(plane) + static_cast<std::size_t>(tile.y) * stride +
                      static_cast<std::size_t>(tile.x);
  const float* from = values.data();
  for (int row = 0; row < tile.height; ++row, to += stride, from += tile.width) {
    for (int column = 0; column < tile.width; ++column) to[column] = narrow(from[column]);
  }
}

kernels::SampledPlane PriorDsi::plane(int plane) const {
  return {values_.get() + indexOf(plane), width_, height_,
          inverse_depths_[static_cast<std::size_t>(plane)]};
}

std::size_t PriorDsi::indexOf(int plane) const {
  return static_cast<std::size_t>(plane) * static_cast<std::size_t>(width_) *
         static_cast<std::size_t>(height_);
}

}  // namespace efm
