// SPDX-License-Identifier: BSD-3-Clause
// Compares the fast kernels with the plain kernel: cameras anywhere, few and many planes and rays,
// views of any size, and every bound from which a size is derived.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/sweep/space_sweep.h"
#include "mapping/sweep/tiles.h"
#include "test/mapping/depth/same_image.h"
#include "test/mapping/kernels/fast_kernels.h"
#include "test/mapping/rays/random_rays.h"
#include "test/mapping/sweep/sweep_case.h"

namespace efm {
namespace {

using Centers = std::vector<Eigen::Vector3d>;
using Points = std::vector<Eigen::Vector2d>;

/// Votes of rays in double precision, and bounds for the errors of floats.
struct ExactVotes {
  std::vector<double> dsi;  ///< [plane][row][column]
  VoteCounts counts;
  /// Votes so near to the border of the view that rounding decides whether they are cast.
  std::uint64_t at_border = 0;
  /// Largest sum of the shifts of all votes in x and y by the rounding of floats, pixels.
  double float_shift_px = 0;
};

/// @param unit_px unit of rounded coordinates: 1/4096 px in the fast kernels.
ExactVotes voteExactly(const RayBundle& rays, const ReferenceView& view, const DepthPlanes& planes,
                       double unit_px = 1.0 / 4096) {
  // One rounding of a product, one of a sum, and two more on the plane of the binning.
  constexpr double kRoundings = 4.0 / (1 << 24);
  ExactVotes votes;
  votes.dsi.resize(static_cast<std::size_t>(planes.size()) * view.pixels());
  for (const RayPacket& packet : rays.packets) {
    for (int plane = 0; plane < planes.size(); ++plane) {
      const PlaneTransfer to = transferToPlane(packet, view, planes.depth(plane));
      if (!to.in_front) {
        votes.counts.behind_camera += packet.end - packet.begin;
        continue;
      }
      double* density = votes.dsi.data() + static_cast<std::size_t>(plane) * view.pixels();
      for (std::size_t i = packet.begin; i < packet.end; ++i) {
        const double from_x = to.scale * double{rays.x_inf[i]};
        const double from_y = to.scale * double{rays.y_inf[i]};
        const double x = from_x + to.offset_x;
        const double y = from_y + to.offset_y;
        const double shift_x = kRoundings * std::max(std::abs(from_x), std::abs(to.offset_x));
        const double shift_y = kRoundings * std::max(std::abs(from_y), std::abs(to.offset_y));
        // Distance from the border in pixels: positive outside, negative inside.
        const double out = std::max({-x, x - (view.width - 1), -y, y - (view.height - 1)});
        if (std::abs(out) <= unit_px + std::max(shift_x, shift_y)) ++votes.at_border;
        if (!(x >= 0 && x < view.width - 1 && y >= 0 && y < view.height - 1)) {
          ++votes.counts.outside_view;
          continue;
        }
        ++votes.counts.cast;
        votes.float_shift_px += shift_x + shift_y;
        const auto column = static_cast<std::size_t>(x);
        const auto row = static_cast<std::size_t>(y);
        const double a = x - static_cast<double>(column);
        const double b = y - static_cast<double>(row);
        double* upper = density + row * static_cast<std::size_t>(view.width) + column;
        double* lower = upper + view.width;
        upper[0] += (1 - a) * (1 - b);
        upper[1] += a * (1 - b);
        lower[0] += (1 - a) * b;
        lower[1] += a * b;
      }
    }
  }
  return votes;
}

/// Largest error per vote. If votes are few, all may be rounded by 1/4096 px in x and in y.
constexpr double kMostPerVote = 4.0 / 4096 + 4.0 / 32'768;

/// Compares a fast kernel's counts and DSI with those of the plain kernel within the bounds of
/// rounding, and the plain kernel's counts with the exact counts. Counts may differ only by votes
/// at the border of the view.
/// @param input fused by arithmetic means, which neither increase nor reduce errors.
void expectThePlainSweep(const test::SweepCase& input, VotingKernel kernel) {
  constexpr double kFewVotes = 1000;
  const test::SweepOutput fast = sweep(input, kernel, 2);
  const test::SweepOutput plain = sweep(input, VotingKernel::kPlain, 2);
  double at_border = 0;
  double float_shift_px = 0;
  double cast = 0;
  for (std::size_t c = 0; c < input.cameras.size(); ++c) {
    double camera_at_border = 0;
    std::uint64_t rays = 0;
    VoteCounts exact_counts;
    for (const RayBundle& bundle : input.cameras[c]) {
      const ExactVotes exact = voteExactly(bundle, input.view, input.planes);
      camera_at_border += static_cast<double>(exact.at_border);
      float_shift_px += exact.float_shift_px;
      rays += bundle.size();
      exact_counts += exact.counts;
    }
    at_border += camera_at_border;
    const VoteCounts& counts = fast.result.votes[c];
    const VoteCounts& plain_counts = plain.result.votes[c];
    EXPECT_EQ(counts.total(), rays * static_cast<std::uint64_t>(input.planes.size()));
    EXPECT_EQ(counts.behind_camera, plain_counts.behind_camera);
    EXPECT_EQ(plain_counts.behind_camera, exact_counts.behind_camera);
    EXPECT_NEAR(static_cast<double>(counts.cast), static_cast<double>(plain_counts.cast),
                camera_at_border);
    EXPECT_NEAR(static_cast<double>(plain_counts.cast), static_cast<double>(exact_counts.cast),
                camera_at_border);
    cast += static_cast<double>(plain_counts.cast);
  }
  const test::DsiDifference difference = test::differenceOf(fast.dsi, plain.dsi);
  if (cast == 0) {
    EXPECT_LE(difference.error_sum, at_border);
    return;
  }
  const double per_vote = cast < kFewVotes ? kMostPerVote : test::kFastErrorOverMass;
  EXPECT_LE(difference.error, per_vote + (at_border + 2 * float_shift_px) / cast);
  EXPECT_LE(std::abs(difference.signed_error), 1e-5 + at_border / cast);
}

class FastSweepOn : public ::testing::TestWithParam<VotingKernel> {
 protected:
  static constexpr ReferenceView kView{150, 100, 90, 95, 70, 52};

  static DepthPlanes inverse(double nearest_m, double farthest_m, int count) {
    return DepthPlanes({nearest_m, farthest_m, count, PlaneSpacing::kInverse});
  }
  static DepthPlanes linear(double nearest_m, double farthest_m, int count) {
    return DepthPlanes({nearest_m, farthest_m, count, PlaneSpacing::kLinear});
  }
  static const std::vector<DepthPlanes>& somePlanes() {
    static const std::vector<DepthPlanes> kPlanes = {inverse(0.5, 4, 9), linear(0.5, 4, 9),
                                                     inverse(0.5, 4, 2), inverse(0.5, 4, 1)};
    return kPlanes;
  }

  /// Returns for each centre and each plane in front of it rays that fill the view on that plane.
  RayBundle raysFrom(const Centers& centers, bool forward, const DepthPlanes& planes,
                     const ReferenceView& view = kView, int rays = 300) {
    RayBundle bundle;
    for (const Eigen::Vector3d& center_ref : centers) {
      for (int plane = 0; plane < planes.size(); ++plane) {
        const double depth_m = planes.depth(plane);
        if (forward ? center_ref.z() >= depth_m : center_ref.z() <= depth_m) continue;
        test::appendPacket({center_ref, forward, depth_m}, view, random_.points(view, rays),
                           bundle);
      }
    }
    return bundle;
  }
  /// Returns packets of a camera that moves along a line.
  RayBundle walk(const DepthPlanes& planes, const Eigen::Vector3d& step, int packets, int rays,
                 const ReferenceView& view = kView) {
    RayBundle bundle;
    for (int packet = 0; packet < packets; ++packet) {
      test::appendPacket({packet * step, true, planes.depth(packet % planes.size())}, view,
                         random_.points(view, rays), bundle);
    }
    return bundle;
  }
  static test::SweepCase caseOf(const DepthPlanes& planes, const RayBundle& rays,
                                const ReferenceView& view = kView) {
    return {view, planes, {{rays}}};
  }
  static void expectPlain(const DepthPlanes& planes, const RayBundle& rays,
                          const ReferenceView& view = kView) {
    expectThePlainSweep(caseOf(planes, rays, view), GetParam());
  }

  test::RandomRays random_{1};
};

INSTANTIATE_TEST_SUITE_P(Kernels, FastSweepOn, ::testing::ValuesIn(test::fastKernels()),
                         test::nameOfKernel);

// ---------------------------------------------------------------- cameras anywhere

TEST_P(FastSweepOn, CamerasBeforeBetweenAndBehindPlanesAreThePlainKernels) {
  for (const DepthPlanes& planes : somePlanes()) {
    std::vector<double> forward = {0.0, 0.2, -0.3, -20.0, 0.6, 1.1, 3.7};
    for (int plane = 0; plane < planes.size(); ++plane) {
      for (const double before_m : {1e-2, 1e-4}) forward.push_back(planes.depth(plane) - before_m);
    }
    std::vector<double> backward = {0.6, 1.1, 3.7, 4.5, 9.0};
    for (const double behind_m : {1e-2, 1e-3, 1e-4}) {
      backward.push_back(planes.depth(planes.size() - 1) + behind_m);
    }
    for (const bool looks_forward : {true, false}) {
      for (const double z : looks_forward ? forward : backward) {
        SCOPED_TRACE(testing::Message() << "at " << z << (looks_forward ? " forward" : " backward")
                                        << ", " << planes.size() << " planes");
        expectPlain(planes, raysFrom({{0.1, -0.05, z}}, looks_forward, planes));
      }
    }
  }
}

TEST_P(FastSweepOn, CamerasOnAPlaneAreBehindItAsInThePlainKernel) {
  // The inverses of these depths are rounded: the depth of a centre times the inverse is not 1.
  for (const double farthest : {49.0, 4.9}) {
    for (const int count : {1, 2, 9}) {
      const DepthPlanes planes = linear(0.49, farthest, count);
      for (int plane = 0; plane < count; ++plane) {
        for (const bool forward : {true, false}) {
          SCOPED_TRACE(testing::Message() << "on plane " << plane << " of " << count << " to "
                                          << farthest << (forward ? " forward" : " backward"));
          // The pixel where all rays would meet is inside the view.
          const Eigen::Vector3d center(0.01, 0.02, planes.depth(plane));
          RayBundle rays = raysFrom({center}, forward, planes);
          test::appendPacket({center, forward, 0.3}, kView, random_.points(kView, 100), rays);
          expectPlain(planes, rays);
        }
      }
    }
  }
}

TEST_P(FastSweepOn, RaysParallelToThePlanesVoteNowhereAndAreOutside) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const std::vector<float> values = {kNan,   -kNan, kInfinity, -kInfinity, 1e30F, -1e30F, 3e38F,
                                     -3e38F, 1e20F, 1e10F,     -1e10F,     1e7F,  -1e7F,  70.5F};
  for (const DepthPlanes& planes : somePlanes()) {
    for (const double z : {0.0, 0.2, -0.3, 1.1, 0.4999}) {
      RayBundle rays;
      for (const float x : values) {
        for (const float y : values) {
          rays.x_inf.push_back(x);
          rays.y_inf.push_back(y);
        }
      }
      rays.packets.push_back({0, rays.size(), {0.1, 0.05, z}, true});
      SCOPED_TRACE(testing::Message() << "from " << z << ", " << planes.size() << " planes");
      expectPlain(planes, rays);
    }
  }
}

// ---------------------------------------------------------------- few and many

TEST_P(FastSweepOn, FewAndManyPlanesAndPacketsAreThePlainKernels) {
  const Eigen::Vector3d step(0.01, 0.002, 0.003);
  const struct {
    const char* name;
    DepthPlanes planes;
    Eigen::Vector3d step;
    int packets;
    int rays;
  } cases[] = {
      {"one plane", inverse(0.5, 5, 1), step, 30, 200},
      {"500 planes", inverse(0.5, 5, 500), step, 10, 60},
      {"2 planes at equal distances", linear(0.3, 30, 2), step, 40, 50},
      {"40 planes at equal distances", linear(0.3, 30, 40), step, 40, 50},
      {"nearly equal planes", inverse(1, 1 + 1e-9, 20), step, 30, 100},
      {"100,000 packets of one ray", inverse(0.5, 5, 3), {2e-6, 1e-6, -1e-6}, 100'000, 1},
      {"intervals of motion with bins of their own",
       inverse(0.5, 5, 4),
       {0.02, -0.01, 0.001},
       300,
       60},
      // A ray moves by less than 1 px over all planes, or by 200 px from each plane to the next.
      {"all planes in one group", inverse(0.5, 5, 10), {1e-5, 0, 0}, 10, 300},
      {"a group for each plane", inverse(0.5, 5, 10), {12, 0, 0}, 2, 300},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.name);
    expectPlain(c.planes, walk(c.planes, c.step, c.packets, c.rays));
  }
}

TEST_P(FastSweepOn, EmptyPacketsChangeNothingAndEmptyBundlesLeaveTheDsiEmpty) {
  const DepthPlanes planes = inverse(0.5, 5, 4);
  const RayBundle rays = walk(planes, {0.01, 0, 0}, 5, 100);
  RayBundle with_empty = rays;
  with_empty.packets.clear();
  for (const RayPacket& packet : rays.packets) {
    with_empty.packets.push_back({packet.begin, packet.begin, {9, 9, 9}, true});
    with_empty.packets.push_back(packet);
    with_empty.packets.push_back({packet.end, packet.end, {0, 0, 2}, false});
  }
  const test::SweepOutput a = sweep(caseOf(planes, rays), GetParam());
  const test::SweepOutput b = sweep(caseOf(planes, with_empty), GetParam());
  EXPECT_EQ(a.result.votes[0].cast, b.result.votes[0].cast);
  EXPECT_LE(test::differenceOf(b.dsi, a.dsi).error, test::kFastErrorOverMass);
  const test::SweepOutput nothing = sweep(caseOf(planes, RayBundle()), GetParam());
  EXPECT_EQ(nothing.dsi, std::vector<float>(4 * kView.pixels(), 0.0F));
  EXPECT_EQ(nothing.result.votes[0].total(), 0U);
}

// ---------------------------------------------------------------- bounds

TEST_P(FastSweepOn, ParallaxOfHundredsOfPixelsAtHdIsThePlainKernels) {
  const ReferenceView view{1280, 720, 836, 836, 639.5, 359.5};
  const DepthPlanes planes = inverse(0.3, 10, 2);
  // 0.5 m sideways are 1350 px between the planes. One camera moves 2.5 m sideways and 1 m back.
  for (const Eigen::Vector3d& side : Centers{{-0.5, 0.4, 0.05}, {2.5, -2, -1}, {0.1, 0.1, 0.299}}) {
    SCOPED_TRACE(testing::Message() << "to " << side.transpose());
    expectPlain(planes, walk(planes, side / 59, 60, 150, view), view);
  }
}

TEST_P(FastSweepOn, ParallaxOfTenTimesTheViewIsThePlainKernels) {
  const ReferenceView view{200, 150, 150, 150, 100, 75};
  const DepthPlanes planes = inverse(0.5, 5, 12);
  // From the middle plane to the outermost planes, a ray moves by 150 C_x (2 - 0.2) / 2 px (C_x: x
  // of the centre, m): 2048 px if C_x = 15.17.
  for (const Eigen::Vector3d& center : Centers{{15.1, 0, 0},
                                               {15.16, 0, 0},
                                               {15.17, 0, 0},
                                               {15.18, 0, 0},
                                               {-15.18, 0, 0},
                                               {0, 15.1, 0},
                                               {0, -15.2, 0},
                                               {0, 0, 0.475},
                                               {0, 0, 0.49},
                                               {300, 0, 0},
                                               {15, 15, -1}}) {
    SCOPED_TRACE(testing::Message() << "from " << center.transpose());
    expectPlain(planes, raysFrom({center}, true, planes, view), view);
  }
}

/// Returns the first cells of the tiles along a side, the cells before them, and the side's ends.
std::vector<double> bordersOf(int side) {
  std::vector<double> borders = {0, 1.0 * (side - 1)};
  for (const cv::Rect& tile : tilesOf({side, 1, 1, 1, 0, 0}, TileCells::kMaxPixels)) {
    for (const int cell : {tile.x - 1, tile.x}) {
      if (cell > 0) borders.push_back(cell);
    }
  }
  return borders;
}

TEST_P(FastSweepOn, RaysOnEveryBorderOfTilesAndTheViewAreCountedOnce) {
  const ReferenceView view{150, 130, 100, 100, 75, 65};
  const DepthPlanes planes = inverse(0.5, 5, 3);
  Points inside;
  Points all;
  for (const double border_x : bordersOf(150)) {
    for (const double border_y : bordersOf(130)) {
      for (const double off_x : {-1e-3, 0.0, 1e-3}) {
        for (const double off_y : {-1e-3, 0.0, 1e-3}) {
          const Eigen::Vector2d point(border_x + off_x, border_y + off_y);
          all.push_back(point);
          if (point.minCoeff() >= 0 && point.x() < 149 && point.y() < 129) inside.push_back(point);
        }
      }
    }
  }
  const RayBundle rays = test::raysFromOrigin(all);
  const auto fast = sweep(caseOf(planes, rays, view), GetParam());
  EXPECT_EQ(fast.result.votes[0].cast, 3 * inside.size());
  EXPECT_EQ(fast.result.votes[0].total(), 3 * all.size());
  EXPECT_LE(test::differenceOf(fast.dsi, voteExactly(rays, view, planes).dsi).error, kMostPerVote);
}

TEST_P(FastSweepOn, RaysThatCrossBordersOfTilesFromPlaneToPlaneAreNeverLost) {
  // Rays cross each border between two tiles in small steps, at many fractions of a pixel.
  const ReferenceView view{100, 100, 80, 80, 50, 50};
  const DepthPlanes planes = inverse(0.5, 5, 400);
  for (const Eigen::Vector3d& center : Centers{{0.01, 0.02, 0}, {0, 0, -0.4}, {-0.3, 0.01, 0.1}}) {
    RayBundle rays;
    Points points;
    for (int i = 0; i < 40; ++i) points.emplace_back(47.3 + 0.11 * i, 52.1 - 0.13 * i);
    test::appendPacket({center, true, planes.depth(200)}, view, points, rays);
    expectPlain(planes, rays, view);
  }
}

TEST_P(FastSweepOn, WideAndHighViewsAreThePlainKernels) {
  // Coordinates count from multiples of 1984 px. The views have one or more of these origins.
  const DepthPlanes planes = inverse(0.5, 5, 4);
  for (const cv::Size& size : {cv::Size(1023, 8), cv::Size(1026, 9), cv::Size(2050, 7),
                               cv::Size(4100, 6), cv::Size(10'000, 8), cv::Size(5, 9000)}) {
    const ReferenceView view{size.width, size.height,      700,
                             700,        0.5 * size.width, 0.5 * size.height};
    const Centers centers = {{0, 0, 0}, {0.05, 0.003, 0}, {0, 0, 0.1}, {3, 0, -0.1}, {-8, 0.01, 0}};
    SCOPED_TRACE(testing::Message() << size);
    expectPlain(planes, raysFrom(centers, true, planes, view, 1000), view);
  }
}

TEST_P(FastSweepOn, VotesWhereTheOriginOfCoordinatesChangesHaveTheirWeights) {
  // Every ray stays in the view, near the first pixel of a tile whose origin differs from its
  // neighbour's. The last bit of rounding differs between the two tiles: some votes on the border
  // count twice or not at all.
  const ReferenceView view{2100, 3, 500, 500, 1050, 1};
  const std::vector<cv::Rect> tiles = tilesOf(view, TileCells::kMaxPixels);
  const auto border = std::find_if(tiles.begin(), tiles.end(), [&](const cv::Rect& tile) {
    return TileCells(tile, view).origin.x > 0;
  });
  ASSERT_NE(border, tiles.end());
  const DepthPlanes planes = inverse(0.5, 5, 50);
  Points points;
  for (int i = 0; i < 2000; ++i) points.emplace_back(border->x + random_.uniform(-0.1, 0.1), 1.3);
  RayBundle rays;
  test::appendPacket({{1e-4, 0, 0}, true, planes.depth(25)}, view, points, rays);
  const test::SweepOutput swept = sweep(caseOf(planes, rays, view), GetParam());
  EXPECT_NEAR(static_cast<double>(swept.result.votes[0].cast), 2000 * 50, 100);
  const ExactVotes exact = voteExactly(rays, view, planes);
  EXPECT_LE(std::abs(test::differenceOf(swept.dsi, exact.dsi).signed_error), 1e-5);
}

// ---------------------------------------------------------------- random rigs, any view

/// Sizes around the ends of tiles of 63 pixels and of vectors of up to 16.
const std::vector<cv::Size> kOddSizes = {{1, 1},   {2, 2},    {1, 50},   {50, 1},    {2, 64},
                                         {17, 16}, {63, 63},  {64, 64},  {65, 127},  {126, 126},
                                         {127, 3}, {128, 62}, {190, 33}, {200, 130}, {63, 190}};

test::SweepCase randomCase(test::RandomRays& random, const cv::Size& size,
                           const DepthPlanes& planes, const FusionInputs& inputs, int max_rays) {
  test::SweepCase input{random.view(size), planes, {}};
  input.groups = inputs.groups;
  for (int camera = 0; camera < inputs.cameras; ++camera) {
    CameraRays& of_camera = input.cameras.emplace_back();
    for (int slot = 0; slot < inputs.slots_per_group * inputs.groups; ++slot) {
      of_camera.push_back(random.bundle(input.view, planes, random.integer(0, max_rays)));
    }
  }
  return input;
}

TEST_P(FastSweepOn, RandomRigsPlanesGroupsAndViewsAreThePlainKernels) {
  for (std::uint32_t seed = 1; seed <= 40; ++seed) {
    test::RandomRays random(seed);
    const FusionInputs inputs{random.integer(1, 4), random.integer(1, 3), random.integer(1, 3)};
    const cv::Size size = seed <= kOddSizes.size()
                              ? kOddSizes[seed - 1]
                              : cv::Size(random.integer(2, 200), random.integer(2, 150));
    test::SweepCase input = randomCase(random, size, random.planes(), inputs, 3000);
    input.camera_peaks = seed % 2 == 0;
    SCOPED_TRACE(testing::Message()
                 << "seed " << seed << ", " << size << ", " << inputs.cameras << " cameras, "
                 << inputs.slots_per_group << " slots, " << inputs.groups << " groups");
    expectThePlainSweep(input, GetParam());
  }
}

/// Two cameras in one slot take a shortcut if no other results are requested.
TEST_P(FastSweepOn, NeitherThreadsNorRequestsChangeABitOfTheFusedDsiPeaksAndCounts) {
  const tbb::global_control as_if_eight_cores(tbb::global_control::max_allowed_parallelism, 8);
  for (const cv::Size& size : {cv::Size(1, 1), {64, 64}, {130, 70}}) {
    for (const FusionRule rule :
         {FusionRule::kHarmonic, FusionRule::kGeometric, FusionRule::kArithmetic}) {
      for (const FusionInputs inputs : {FusionInputs{2, 1, 1}, {2, 1, 4}, {3, 1, 2}, {2, 2, 2}}) {
        SCOPED_TRACE(testing::Message() << size << ", " << nameOf(rule) << ", " << inputs.cameras
                                        << " cameras, " << inputs.groups << " groups");
        test::RandomRays random(80);
        test::SweepCase input = randomCase(random, size, inverse(0.5, 5, 9), inputs, 2500);
        input.fusion.across_cameras = rule;
        input.camera_peaks = false;
        const test::SweepOutput alone = sweep(input, GetParam(), 1);
        SpaceSweepOptions options;
        options.fusion = input.fusion;
        options.kernel = GetParam();
        SweepRequest fused_only;
        fused_only.groups = inputs.groups;
        EXPECT_TRUE(
            test::same(alone.result.fused.peaks,
                       sweepSpace(input.cameras, {input.view, input.planes}, options, fused_only)
                           .fused.peaks));
        input.camera_peaks = true;
        input.column_window = 5;
        for (const int threads : {1, 8}) {
          const test::SweepOutput with_all = sweep(input, GetParam(), threads);
          EXPECT_EQ(alone.dsi, with_all.dsi) << threads;
          EXPECT_TRUE(test::same(alone.result.fused.peaks.confidence,
                                 with_all.result.fused.peaks.confidence))
              << threads;
          for (std::size_t c = 0; c < input.cameras.size(); ++c) {
            EXPECT_EQ(alone.result.votes[c].cast, with_all.result.votes[c].cast);
            EXPECT_EQ(alone.result.votes[c].outside_view, with_all.result.votes[c].outside_view);
            EXPECT_EQ(alone.result.votes[c].behind_camera, with_all.result.votes[c].behind_camera);
          }
        }
      }
    }
  }
}

/// Columns of the planes that were swept are those of a sweep of all planes, and interpolated
/// between them; a sink and the cameras' own peaks get all planes.
TEST_P(FastSweepOn, CoarseToFineDependsNeitherOnThreadsNorRequestsAndInterpolates) {
  const tbb::global_control as_if_eight_cores(tbb::global_control::max_allowed_parallelism, 8);
  for (const FusionInputs inputs : {FusionInputs{2, 1, 4}, {3, 1, 2}}) {
    SCOPED_TRACE(testing::Message() << inputs.cameras << " cameras");
    test::RandomRays random(81);
    test::SweepCase input = randomCase(random, {130, 70}, inverse(0.5, 5, 501), inputs, 2500);
    input.column_window = 5;
    const test::SweepOutput all = sweep(input, GetParam());
    SpaceSweepOptions options;
    options.fusion = input.fusion;
    options.kernel = GetParam();
    std::vector<SweepResult> results;
    for (const bool with_all : {false, true}) {
      for (const int threads : {1, 8}) {
        options.threads = threads;
        test::WholeDsi dsi(input.planes, input.view);
        results.push_back(sweepSpace(
            input.cameras, {input.view, input.planes}, options,
            {with_all, with_all ? &dsi : nullptr, input.groups, input.column_window, 4}));
        if (with_all) {
          EXPECT_EQ(dsi.values, all.dsi);
        }
      }
    }
    const SweepResult& alone = results.front();
    for (const SweepResult& result : results) {
      EXPECT_TRUE(test::same(alone.fused.peaks.confidence, result.fused.peaks.confidence));
      for (std::size_t c = 0; c < result.cameras.size(); ++c) {
        EXPECT_TRUE(
            test::same(result.cameras[c].peaks.confidence, all.result.cameras[c].peaks.confidence));
      }
      for (std::size_t c = 0; c < input.cameras.size(); ++c) {
        EXPECT_EQ(result.votes[c].total(), all.result.votes[c].total());
        EXPECT_EQ(result.votes[c].behind_camera, all.result.votes[c].behind_camera);
        EXPECT_EQ(result.votes[c].interpolated > 0, result.cameras.empty());
      }
    }
    const DsiColumns& columns = alone.fused.columns;
    int coarse_only = 0;
    for (int y = 0; y < input.view.height; ++y) {
      for (int x = 0; x < input.view.width; ++x) {
        if (!columns.has({x, y})) continue;
        const double confidence = alone.fused.peaks.confidence(y, x);
        const double step = confidence / 64;  // twice the step of a byte near the peak
        const auto exact = [&](int plane) {
          return double{all.dsi[static_cast<std::size_t>(
              (plane * input.view.height + y) * input.view.width + x)]};
        };
        for (int plane = 0; plane + 4 < input.planes.size(); plane += 4) {
          ASSERT_NEAR(columns.value({x, y}, plane), exact(plane), step);
          const double middle = columns.value({x, y}, plane + 2);
          const double line = (exact(plane) + exact(plane + 4)) / 2;
          const bool is_exact = std::abs(middle - exact(plane + 2)) <= step;
          ASSERT_TRUE(is_exact || std::abs(middle - line) <= step);
          coarse_only += is_exact ? 0 : 1;
        }
      }
    }
    EXPECT_GT(coarse_only, 0);
  }
}

// ---------------------------------------------------------------- tiles of the view

TEST(ViewTiles, EveryPixelLiesInOneTileOfNearlyTheSameSize) {
  constexpr int kMax = TileCells::kMaxPixels;
  for (const int width : {1, 2, 62, 63, 64, 65, 126, 127, 346, 1280, 65'535}) {
    for (const int height : {1, 50, 63, 64, 127}) {
      if (width > 2000 && height > 1) continue;
      SCOPED_TRACE(testing::Message() << width << " x " << height);
      cv::Mat1i tiles_of(height, width, 0);
      const std::vector<cv::Rect> tiles = tilesOf({width, height, 1, 1, 0, 0}, kMax);
      EXPECT_EQ(static_cast<int>(tiles.size()),
                ((width + kMax - 1) / kMax) * ((height + kMax - 1) / kMax));
      for (const cv::Rect& tile : tiles) {
        ASSERT_EQ(tile & cv::Rect(0, 0, width, height), tile);
        ASSERT_LE(std::abs(tile.width - tiles.front().width), 1);
        ASSERT_LE(std::abs(tile.height - tiles.front().height), 1);
        ASSERT_TRUE(tile.width <= kMax && tile.height <= kMax);
        tiles_of(tile) += 1;
      }
      EXPECT_EQ(cv::countNonZero(tiles_of != 1), 0);
    }
  }
}

}  // namespace
}  // namespace efm
