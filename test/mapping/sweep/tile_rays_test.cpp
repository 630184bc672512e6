// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/tile_rays.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace efm {
namespace {

TEST(TileRays, GrowingKeepsRaysAndPaddingIsNotCountedAndLiesOutsideEveryTile) {
  TileRays rays;
  std::size_t size = 0;
  for (const std::size_t more : {1U, 7U, 0U, 500U, 3U, 20'000U}) {
    rays.reserve(more);
    for (std::size_t i = 0; i < more; ++i, ++size) {
      const auto value = static_cast<float>(size);
      const kernels::MovingRays view = rays.view();
      view.x[size] = value;
      view.y[size] = value + 0.25F;
      view.dx[size] = value + 0.5F;
      view.dy[size] = value + 0.75F;
    }
    rays.resize(size);
    rays.pad();
    ASSERT_EQ(rays.size(), size);
    const kernels::MovingRays view = rays.view();
    for (std::size_t i = 0; i < size; ++i) {
      const auto value = static_cast<float>(i);
      ASSERT_EQ(view.x[i], value);
      ASSERT_EQ(view.y[i], value + 0.25F);
      ASSERT_EQ(view.dx[i], value + 0.5F);
      ASSERT_EQ(view.dy[i], value + 0.75F);
    }
    for (std::size_t i = size; i < size + kernels::kRayPadding; ++i) {
      ASSERT_TRUE(view.x[i] < 0 && view.y[i] < 0 && view.dx[i] == 0 && view.dy[i] == 0);
    }
    // Where a vector of any instruction set may begin.
    for (const float* values : {view.x, view.y, view.dx, view.dy}) {
      ASSERT_EQ(reinterpret_cast<std::uintptr_t>(values) % 64, 0U);
    }
  }
}

}  // namespace
}  // namespace efm
