// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/image_ordered_rays.h"

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <limits>

namespace efm {
namespace {

constexpr float kNowhere = std::numeric_limits<float>::quiet_NaN();

/// A packet's part of what its rays are made of.
struct PacketSlope {
  float scale = 0;  // C_z
  float x = 0;      // f C_x + c C_z
  float y = 0;
  float limit = 0;  // see kernels::SlopedRays
};

/// Forward rays see 1 - C_z q > 0, backward ones the opposite.
float limitOf(const RayPacket& packet) {
  constexpr float kNone = std::numeric_limits<float>::infinity();
  const double z = packet.center_ref.z();
  if (packet.forward) return z > 0 ? static_cast<float>(1 / z) : kNone;
  return z > 0 ? static_cast<float>(-1 / z) : -kNone;
}

PacketSlope slopeOf(const RayPacket& packet, const ReferenceView& view) {
  const Eigen::Vector3d& center_ref = packet.center_ref;
  return {static_cast<float>(center_ref.z()),
          static_cast<float>(view.fx * center_ref.x() + view.cx * center_ref.z()),
          static_cast<float>(view.fy * center_ref.y() + view.cy * center_ref.z()), limitOf(packet)};
}

/// Patches of the view, row by row; what is beside it belongs to those at its border.
class Patches {
 public:
  explicit Patches(const ReferenceView& view)
      : columns_((view.width - 1) / kWidth + 1), rows_((view.height - 1) / kHeight + 1) {}

  std::size_t count() const { return static_cast<std::size_t>(columns_ * rows_); }
  std::uint32_t at(float x, float y) const {
    return static_cast<std::uint32_t>(inOne(y / kHeight, rows_) * columns_ +
                                      inOne(x / kWidth, columns_));
  }

 private:
  static constexpr int kWidth = 64;  // pixels: a few lines of a cache
  static constexpr int kHeight = 16;

  static int inOne(float position, int count) {
    const auto last = static_cast<float>(count - 1);
    // In this order, what is not a number becomes 0.
    return static_cast<int>(std::min(last, std::max(0.0F, position)));
  }

  int columns_;
  int rows_;
};

/// Calls with each ray's x_inf, y_inf and its packet's slope, in order.
template <typename Take>
void forEachRay(const std::vector<const RayBundle*>& bundles, const ReferenceView& view,
                const Take& take) {
  for (const RayBundle* bundle : bundles) {
    for (const RayPacket& packet : bundle->packets) {
      const PacketSlope slope = slopeOf(packet, view);
      for (std::size_t i = packet.begin; i < packet.end; ++i) {
        take(bundle->x_inf[i], bundle->y_inf[i], slope);
      }
    }
  }
}

std::size_t wholeBlocks(std::size_t rays) {
  return (rays + kernels::kRayBlock - 1) / kernels::kRayBlock * kernels::kRayBlock;
}

}  // namespace

ImageOrderedRays::ImageOrderedRays(const std::vector<const RayBundle*>& bundles,
                                   const ReferenceView& view, const DepthPlanes& planes) {
  const auto middle =
      static_cast<float>(0.5 * (1 / planes.depth(0) + 1 / planes.depth(planes.size() - 1)));
  const Patches patches(view);
  std::vector<std::uint32_t> patch_of;
  std::vector<std::size_t> rays_in(patches.count());
  forEachRay(bundles, view, [&](float x, float y, const PacketSlope& slope) {
    patch_of.push_back(patches.at(x + middle * (slope.x - slope.scale * x),
                                  y + middle * (slope.y - slope.scale * y)));
    ++rays_in[patch_of.back()];
  });

  begin_.push_back(0);
  for (const std::size_t rays : rays_in) begin_.push_back(begin_.back() + wholeBlocks(rays));
  for (PixelValues<float>* values : {&x_, &y_, &dx_, &dy_, &limit_}) {
    values->assign(begin_.back(), kNowhere);
  }
  std::vector<std::size_t> next = begin_;
  auto patch = patch_of.begin();
  forEachRay(bundles, view, [&](float x, float y, const PacketSlope& slope) {
    const std::size_t to = next[*patch++]++;
    x_[to] = x;
    y_[to] = y;
    dx_[to] = slope.x - slope.scale * x;
    dy_[to] = slope.y - slope.scale * y;
    limit_[to] = slope.limit;
  });
}

kernels::SlopedRays ImageOrderedRays::patch(std::size_t index) const {
  const std::size_t begin = begin_[index];
  return {x_.data() + begin,  y_.data() + begin,     dx_.data() + begin,
          dy_.data() + begin, limit_.data() + begin, begin_[index + 1] - begin};
}

}  // namespace efm
