// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/tile_rays.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace efm {
namespace {

/// Appends as a kernel does: writes behind those that are there, then says how many there are.
void append(std::size_t count, float first, TileRays& rays) {
  rays.reserve(count);
  const kernels::TileRays view = rays.view();
  for (std::size_t i = 0; i < count; ++i) {
    const float value = first + static_cast<float>(i);
    view.x[view.size + i] = value;
    view.y[view.size + i] = value + 0.25F;
    view.dx[view.size + i] = value + 0.5F;
    view.dy[view.size + i] = value + 0.75F;
  }
  rays.resize(view.size + count);
}

TEST(TileRays, GrowingKeepsWhatIsThere) {
  TileRays rays;
  std::size_t size = 0;
  for (const std::size_t more : {1U, 7U, 0U, 500U, 3U, 20'000U}) {
    append(more, static_cast<float>(size), rays);
    size += more;
  }
  const kernels::TileRays view = rays.view();
  ASSERT_EQ(view.size, size);
  for (std::size_t i = 0; i < size; ++i) {
    const auto value = static_cast<float>(i);
    ASSERT_EQ(view.x[i], value);
    ASSERT_EQ(view.y[i], value + 0.25F);
    ASSERT_EQ(view.dx[i], value + 0.5F);
    ASSERT_EQ(view.dy[i], value + 0.75F);
  }
}

TEST(TileRays, PaddingIsNotCountedAndLiesOutsideEveryTile) {
  TileRays rays;
  for (const std::size_t size : {0U, 1U, 64U, 1000U}) {
    rays.clear();
    append(size, 5, rays);
    rays.pad();
    ASSERT_EQ(rays.size(), size);
    const kernels::TileRays view = rays.view();
    for (std::size_t i = size; i < size + kernels::kRayPadding; ++i) {
      ASSERT_LT(view.x[i], 0);
      ASSERT_LT(view.y[i], 0);
      ASSERT_EQ(view.dx[i], 0);
      ASSERT_EQ(view.dy[i], 0);
    }
  }
}

TEST(TileRays, ArraysBeginWhereAVectorOfAnyInstructionSetMay) {
  TileRays rays;
  append(3, 0, rays);
  const kernels::TileRays view = rays.view();
  for (const float* values : {view.x, view.y, view.dx, view.dy}) {
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(values) % 64, 0U);
  }
}

}  // namespace
}  // namespace efm
