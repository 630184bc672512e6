// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/ray_bins.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "mapping/sweep/tiled_sweep.h"
#include "test/mapping/kernels/fast_kernels.h"
#include "test/mapping/rays/chosen_rays.h"
#include "test/mapping/rays/random_rays.h"

namespace efm {
namespace {

using test::RandomRays;

/// The exact pixels of a ray on the first and the last plane of a group; NaN behind its camera.
struct RayPath {
  Eigen::Vector2d first;
  Eigen::Vector2d last;
};

/// A coordinate is rounded to 1/4096 px on the anchor plane, from which its error may double; and
/// as floats of up to 8192 px in four steps.
constexpr double kRounding_px = 2.0 / 4096 + 4 * 0.5 / 1024;
/// Rays this far from a tile need not be gathered; those farther must not be.
constexpr double kNear_px = 0.05;

Eigen::Vector2d pixelOn(const RayBundle& rays, const RayPacket& packet, std::size_t ray,
                        const ReferenceView& view, double depth_m) {
  const PlaneTransfer to = transferToPlane(packet, view, depth_m);
  if (!to.in_front) return Eigen::Vector2d::Constant(std::nan(""));
  return {to.scale * double{rays.x_inf[ray]} + to.offset_x,
          to.scale * double{rays.y_inf[ray]} + to.offset_y};
}

std::vector<RayPath> pathsOf(const RayBundle& rays, const ReferenceView& view,
                             const PlaneRange& group) {
  std::vector<RayPath> paths;
  for (const RayPacket& packet : rays.packets) {
    for (std::size_t i = packet.begin; i < packet.end; ++i) {
      paths.push_back({pixelOn(rays, packet, i, view, 1 / group.first),
                       pixelOn(rays, packet, i, view, 1 / group.last)});
    }
  }
  return paths;
}

/// Whether the straight path comes within a margin of the box around the cells: negative for those
/// that certainly are inside on some plane. Along each axis by itself, as rays are gathered.
bool passes(const RayPath& path, const cv::Rect& cells, double margin) {
  const Eigen::Vector2d min = path.first.cwiseMin(path.last);
  const Eigen::Vector2d max = path.first.cwiseMax(path.last);
  return max.x() >= cells.x - margin && min.x() < cells.br().x + margin &&
         max.y() >= cells.y - margin && min.y() < cells.br().y + margin;
}

/// Whether the ray is inside the cells at one of a hundred positions between the two planes.
bool votesIn(const RayPath& path, const cv::Rect& cells) {
  for (int step = 0; step <= 100; ++step) {
    const Eigen::Vector2d pixel = path.first + step * 0.01 * (path.last - path.first);
    if (pixel.x() >= cells.x && pixel.x() < cells.br().x && pixel.y() >= cells.y &&
        pixel.y() < cells.br().y) {
      return true;
    }
  }
  return false;
}

class RayBinsOn : public ::testing::TestWithParam<VotingKernel> {
 protected:
  /// The rays of a bundle that a tile gathers, each as its path.
  std::vector<RayPath> gather(const std::vector<RayBins>& all, const TileCells& tile,
                              const PlaneRange& group, const DepthPlanes& planes) const {
    TileRays found;
    for (const RayBins& bins : all) {
      const bool in_front = bins.covers(group) || bins.isInFront(group.begin);
      if (in_front) bins.gather(bins.footprintOn(group), tile, functions_, found);
    }
    const Eigen::Vector2d origin(tile.origin.x, tile.origin.y);
    std::vector<RayPath> paths;
    const kernels::MovingRays rays = found.view();
    const auto pixelAt = [&](std::size_t i, double from_pixels) -> Eigen::Vector2d {
      const Eigen::Vector2d pixel(rays.x[i], rays.y[i]);
      const Eigen::Vector2d shift(rays.dx[i], rays.dy[i]);
      return origin + (pixel + from_pixels * shift) / (1 << kernels::kFractionBits);
    };
    for (std::size_t i = 0; i < rays.size; ++i) {
      paths.push_back({pixelAt(i, group.first - RayBins::pixelPlane(planes)),
                       pixelAt(i, group.last - RayBins::pixelPlane(planes))});
    }
    return paths;
  }

  /// Every ray that votes in some tile is found there, once, where it is; others are not.
  void expectEveryRayOnce(const RayBundle& rays, const ReferenceView& view,
                          const DepthPlanes& planes, int planes_per_group) const {
    const std::vector<RayBins> all = RayBins::sort(rays, {view, planes});
    const PlaneRange all_planes(planes, 0, planes.size());
    const bool on_all_planes = std::all_of(
        all.begin(), all.end(), [&](const RayBins& bins) { return bins.covers(all_planes); });
    if (!on_all_planes) planes_per_group = 1;
    for (int begin = 0; begin < planes.size(); begin += planes_per_group) {
      const int end = std::min(planes.size(), begin + planes_per_group);
      const PlaneRange group(planes, begin, end);
      const std::vector<RayPath> paths = pathsOf(rays, view, group);
      for (const cv::Rect& tile : tilesOf(view, TileCells::kMaxPixels)) {
        const TileCells cells(tile, view);
        SCOPED_TRACE(testing::Message() << "tile " << tile.x << ", " << tile.y << ", planes "
                                        << begin << " to " << end - 1);
        expectMatch(paths, gather(all, cells, group, planes), cells.in_view);
      }
    }
  }

  static void expectMatch(const std::vector<RayPath>& paths, const std::vector<RayPath>& found,
                          const cv::Rect& cells) {
    std::vector<bool> taken(paths.size(), false);
    for (const RayPath& ray : found) {
      std::size_t match = 0;
      while (match < paths.size() && (taken[match] || !isAt(ray, paths[match]))) ++match;
      ASSERT_LT(match, paths.size()) << "found twice or nowhere: " << ray.first.transpose();
      taken[match] = true;
      ASSERT_TRUE(passes(paths[match], cells, kNear_px)) << ray.first.transpose();
    }
    for (std::size_t i = 0; i < paths.size(); ++i) {
      ASSERT_TRUE(taken[i] || !votesIn(paths[i], cells))
          << "missed: " << paths[i].first.transpose() << " to " << paths[i].last.transpose();
    }
  }

  static bool isAt(const RayPath& found, const RayPath& path) {
    const double off = std::max((found.first - path.first).cwiseAbs().maxCoeff(),
                                (found.last - path.last).cwiseAbs().maxCoeff());
    return off <= kRounding_px;  // fails behind the camera
  }

  const kernels::TileFunctions& functions_ = kernels::tileFunctions(GetParam());
};

INSTANTIATE_TEST_SUITE_P(Kernels, RayBinsOn, ::testing::ValuesIn(test::fastKernels()),
                         test::nameOfKernel);

constexpr ReferenceView kView{150, 100, 90, 95, 70, 52};

/// Rays of one packet at each centre, which fill the view on planes in turn.
RayBundle raysFrom(const std::vector<RayPacket>& sources, const DepthPlanes& planes,
                   RandomRays& random) {
  RayBundle bundle;
  int plane = 0;
  for (const RayPacket& source : sources) {
    for (int tries = 0; tries < planes.size(); ++tries, ++plane) {
      const double depth_m = planes.depth(plane % planes.size());
      if (!transferToPlane(source, kView, depth_m).in_front) continue;
      test::appendPacket({source.center_ref, source.forward, depth_m}, kView,
                         random.points(kView, 60), bundle);
    }
  }
  return bundle;
}

TEST_P(RayBinsOn, ATileFindsEachRayThatItSeesOnceWhereCamerasAreBeforeAllPlanes) {
  const DepthPlanes planes({0.5, 5, 12, PlaneSpacing::kInverse});
  for (std::uint32_t seed = 1; seed <= 2; ++seed) {
    RandomRays random(seed);
    std::vector<RayPacket> sources;
    for (int i = 0; i < 4; ++i) {
      sources.push_back(
          {0,
           0,
           {random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform(-0.4, 0.4)},
           true});
    }
    const RayBundle rays = raysFrom(sources, planes, random);
    for (const int planes_per_group : {1, 5, 12}) {
      expectEveryRayOnce(rays, kView, planes, planes_per_group);
    }
  }
}

TEST_P(RayBinsOn, ATileFindsEachRayThatItSeesOnceWhereCamerasAreBetweenPlanesAndBehindThem) {
  const DepthPlanes planes({0.5, 5, 6, PlaneSpacing::kLinear});
  RandomRays random(4);
  const RayBundle rays = raysFrom({{0, 0, {0.1, 0, 0.95}, true},
                                   {0, 0, {0.1, 0.2, 0.95}, false},
                                   {0, 0, {-0.3, 0.1, 3.6}, true},
                                   {0, 0, {-0.3, 0.1, 3.6}, false},
                                   {0, 0, {0.2, 0.2, 9}, false},
                                   {0, 0, {0, 0.2, -0.1}, true}},
                                  planes, random);
  expectEveryRayOnce(rays, kView, planes, 1);
}

TEST_P(RayBinsOn, ATileFindsEachRayThatItSeesOnceWhereRaysMoveFartherThanBinsReach) {
  const DepthPlanes planes({0.5, 5, 5, PlaneSpacing::kInverse});
  RandomRays random(5);
  const RayBundle rays =
      raysFrom({{0, 0, {26, 0, 0}, true}, {0, 0, {-30, 25, 0.2}, true}}, planes, random);
  expectEveryRayOnce(rays, kView, planes, 1);
}

TEST(RayBins, RaysThatAreOnNoPlaneOrOutsideOnAllAreLeftOut) {
  const DepthPlanes planes({0.5, 5, 10, PlaneSpacing::kInverse});
  RayBundle behind;
  test::appendPacket({{0, 0, 6}, true, 7}, kView, {{70, 50}}, behind);
  EXPECT_TRUE(RayBins::sort(behind, {kView, planes}).empty());
  EXPECT_TRUE(RayBins::sort(RayBundle(), {kView, planes}).empty());
}

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
