// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "mapping/depth/aggregated_extraction.h"
#include "test/mapping/depth/same_image.h"
#include "test/mapping/dsi/chosen_dsi.h"
#include "test/oracle/naive_mapper.h"

namespace efm::aggregated_extraction_test {
namespace {

using test::ChosenDsi;

DepthPlanes planesOf(int count) { return DepthPlanes({0.5, 5.0, count, PlaneSpacing::kInverse}); }

/// Position of a depth between planes of inverse spacing: the inverse of `DepthPlanes::depthAt`.
double planePosition(const DepthPlanes& planes, double depth_m) {
  const double first = 1 / planes.depth(0);
  const double last = 1 / planes.depth(planes.size() - 1);
  return (1 / depth_m - first) / (last - first) * (planes.size() - 1);
}

DepthMap extract(const ChosenDsi& dsi, const DepthExtractionOptions& options = {}) {
  return extractAggregated(dsi.swept(), planesOf(dsi.planes), options);
}

double ridge(double plane, double at, double sigma) {
  return std::exp(-(plane - at) * (plane - at) / (2 * sigma * sigma));
}

/// Upright edges, twelve pixels apart: their columns, and whether one is there.
bool isOnEdge(int x) { return x % 12 == 6; }

/// Fraction of the votes of the nearest edge in a column of pixels.
double acrossEdge(int x) {
  const double off = x % 12 - 6;
  return std::exp(-off * off / (2 * 0.7 * 0.7));
}

/// A plane of edges that all have the same ray.
ChosenDsi edges(const cv::Size& size, int planes, const std::function<double(int plane)>& ray) {
  ChosenDsi dsi(size, planes);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      dsi.setColumn({x, y}, [&](int plane) { return acrossEdge(x) * ray(plane); });
    }
  }
  return dsi;
}

ChosenDsi edgesAt(double position, double sigma = 2) {
  return edges({60, 40}, 100, [=](int plane) { return 20 * ridge(plane, position, sigma); });
}

/// Edges with different depths, some of them wrong, and noise everywhere.
ChosenDsi randomEdges(std::uint32_t seed, const cv::Size& size, int planes) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal;
  const double place = std::max(1.0, (planes - 1) / 99.0);
  ChosenDsi dsi(size, planes);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const bool wrong = uniform(random) < 0.15;
      const double right_at = (planes - 1) * (0.2 + 0.6 * (x / 12) / (1 + size.width / 12.0));
      const double at = wrong ? (planes - 1) * uniform(random) : right_at + place * normal(random);
      const double other = (planes - 1) * uniform(random);
      const double height = (4 * acrossEdge(x) + 0.3) * (0.5 + uniform(random));
      const double sigma = place * (1 + uniform(random));
      dsi.setColumn({x, y}, [&](int plane) {
        return height * (ridge(plane, at, sigma) + 0.5 * uniform(random) * ridge(plane, other, 1) +
                         0.02 * uniform(random));
      });
    }
  }
  return dsi;
}

TEST(AggregatedExtraction, EqualsTheOracleOnRandomEdges) {
  int kept = 0;
  int differing = 0;
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const struct {
    int planes;
    double parallax_px_m;
    double step_planes;
  } cases[] = {{1, kFar, 1},
               {2, kFar, 1},
               {3, kFar, 1},
               {40, kFar, 1},
               {100, kFar, 1},
               {250, kFar, 249 / 99.0},
               // 6.3 and 9 pixels of parallax between the limits: an eighth of a pixel.
               {40, 3.5, 39 * 0.125 / 6.3},
               {100, 5, 99 * 0.125 / 9}};
  for (const auto& [planes, parallax_px_m, step_planes] : cases) {
    for (const int window : {3, 5, 11}) {
      const cv::Size size(64, 37);
      const ChosenDsi dsi = randomEdges(static_cast<std::uint32_t>(planes + window), size, planes);
      const DepthPlanes depths = planesOf(planes);
      DepthExtractionOptions options;
      options.threshold_kernel = window;
      options.min_quality = 0.03 * window;
      const DepthMap found = extractAggregated(dsi.swept(), depths, options, parallax_px_m);
      const DepthMap exact =
          oracle::extractAggregated(dsi.rounded().values, size, depths, options, step_planes);
      EXPECT_TRUE(test::same(found.confidence, dsi.swept().peaks.confidence));
      const int kept_before = kept;
      for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
          const double depth = exact.depth(y, x);
          kept += depth > 0 ? 1 : 0;
          if ((found.depth(y, x) > 0) != (depth > 0)) {
            ++differing;
            continue;
          }
          if (depth == 0) continue;
          const bool same_depth = planes == 1 || std::abs(planePosition(depths, found.depth(y, x)) -
                                                          planePosition(depths, depth)) < 0.01;
          const double variance = exact.variance(y, x);
          const bool same_variance =
              std::isinf(variance) ? std::isinf(found.variance(y, x))
                                   : std::abs(found.variance(y, x) - variance) < 0.01 * variance;
          differing += same_depth && same_variance ? 0 : 1;
        }
      }
      EXPECT_GT(kept, kept_before + 40) << planes << " planes, window " << window;
    }
  }
  // Where rounding decides whether a pixel is looked at, those around it may differ too.
  EXPECT_LE(differing, kept / 1000) << "of " << kept;
}

TEST(AggregatedExtraction, ACleanPlaneOfEdgesHasItsDepthEverywhere) {
  for (const double position : {10.0, 41.3, 56.5, 88.7}) {
    const ChosenDsi dsi = edgesAt(position);
    const DepthMap map = extract(dsi);
    for (int y = 2; y < 38; ++y) {
      for (int x = 2; x < 58; ++x) {
        if (isOnEdge(x)) {
          ASSERT_GT(map.depth(y, x), 0) << x << ", " << y;
        }
        if (map.depth(y, x) > 0) {
          ASSERT_NEAR(planePosition(planesOf(100), map.depth(y, x)), position, 0.05);
          ASSERT_GT(map.variance(y, x), 0);
          ASSERT_TRUE(std::isfinite(map.variance(y, x)));
        } else {
          ASSERT_EQ(map.variance(y, x), 0);
        }
      }
    }
  }
}

TEST(AggregatedExtraction, AnEdgeAlongTheMotionIsRejectedBecauseItsColumnIsFlat) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> noise(0, 0.01);
  std::vector<double> flat(100);
  for (double& value : flat) value = 1 + noise(random);
  flat[50] = 1.011;  // where the peak happens to be
  const auto ray = [&](int plane) { return 20 * flat[static_cast<std::size_t>(plane)]; };
  EXPECT_EQ(cv::countNonZero(extract(edges({60, 40}, 100, ray)).depth), 0);
}

TEST(AggregatedExtraction, TheContrastThresholdAndDilationAreThoseOfTheOptions) {
  const ChosenDsi dsi = randomEdges(9, {64, 37}, 100);
  DepthExtractionOptions options;
  const DepthMap kept = extract(dsi, options);
  options.dilate = true;
  const DepthMap grown = extract(dsi, options);
  EXPECT_GT(cv::countNonZero(grown.depth), cv::countNonZero(kept.depth) + 100);
  EXPECT_EQ(cv::countNonZero((grown.depth != kept.depth) & (kept.depth > 0)), 0);
  options.min_local_contrast = 1e6;
  EXPECT_EQ(cv::countNonZero(extract(dsi, options).depth), 0);
}

TEST(AggregatedExtraction, MorePlanesThanTheParallaxTellsApartLoseNoPoints) {
  // A peak of a pixel, of three pixels between the limits.
  std::vector<int> points;
  for (const int planes : {20, 50, 100, 200, 400}) {
    const double px = (planes - 1) / 3.0;
    const ChosenDsi dsi = edges({60, 40}, planes, [&](int plane) {
      return 20 * ridge(plane, 0.4 * (planes - 1), 0.6 * px);
    });
    const DepthMap map = extractAggregated(dsi.swept(), planesOf(planes), {}, 3 / 1.8);
    points.push_back(cv::countNonZero(map.depth));
    const PixelCounts& pixels = map.pixels;
    EXPECT_EQ(pixels.candidates, pixels.at_nearest + pixels.at_farthest + pixels.ambiguous +
                                     static_cast<std::uint64_t>(points.back()));
    // The whole range within half of a pixel tells nothing.
    EXPECT_EQ(
        cv::countNonZero(extractAggregated(dsi.swept(), planesOf(planes), {}, 0.5 / 1.8).depth), 0);
  }
  EXPECT_GT(points[0], 100);
  for (const int count : points) EXPECT_GE(count, 0.95 * points[0]);
}

constexpr float kNear = 2.5F;

/// Kept pixels with positions and weights.
struct Depths {
  cv::Mat1b mask;
  cv::Mat1f positions;
  cv::Mat1f weights;

  explicit Depths(const cv::Size& size)
      : mask(cv::Mat1b::zeros(size)), positions(size, 0.0F), weights(size, 1.0F) {}

  void keep(const cv::Point& pixel, float position, float weight = 1) {
    mask(pixel) = 255;
    positions(pixel) = position;
    weights(pixel) = weight;
  }
  std::vector<LocalAgreement> agreement() const {
    const SparseMask kept(mask);
    std::vector<float> kept_positions;
    std::vector<float> kept_weights;
    kept.forEach([&](std::size_t, cv::Point at) {
      kept_positions.push_back(positions(at));
      kept_weights.push_back(weights(at));
    });
    return localAgreement(kept, kept_positions, kept_weights, kNear);
  }
};

Depths randomDepths(std::uint32_t seed, const cv::Size& size, int one_of) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> position(0, 20);
  std::uniform_real_distribution<float> weight(0.15F, 3);
  Depths depths(size);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      if (random() % static_cast<unsigned>(one_of) == 0) {
        // In half planes, so that some are equal and some exactly as far apart as the limit.
        depths.keep({x, y}, std::round(2 * position(random)) / 2, weight(random));
      }
    }
  }
  return depths;
}

/// The three numbers from their definitions, in double.
LocalAgreement naive(const Depths& depths, const cv::Point& pixel) {
  std::vector<std::pair<double, double>> around;  // position, weight
  double agreeing = 0;
  double others = 0;
  double total = 0;
  for (int y = 0; y < depths.mask.rows; ++y) {
    for (int x = 0; x < depths.mask.cols; ++x) {
      const int dx = x - pixel.x;
      const int dy = y - pixel.y;
      if (depths.mask(y, x) == 0 || std::abs(dx) > 4 || std::abs(dy) > 4) continue;
      const double position = depths.positions(y, x);
      const double weight = depths.weights(y, x);
      around.emplace_back(position, weight);
      total += weight;
      if (dx == 0 && dy == 0) continue;
      const double distance_weight = weight * std::exp(-(dx * dx + dy * dy) / 8.0);
      others += distance_weight;
      if (std::abs(position - double{depths.positions(pixel)}) < double{kNear}) {
        agreeing += distance_weight;
      }
    }
  }
  // The smallest position with half of the weight at or below it.
  double median = INFINITY;
  for (const auto& candidate : around) {
    double at_or_below = 0;
    for (const auto& [position, weight] : around) {
      if (position <= candidate.first) at_or_below += weight;
    }
    if (at_or_below >= total / 2) median = std::min(median, candidate.first);
  }
  std::vector<double> distances;
  for (const auto& [position, weight] : around) distances.push_back(std::abs(position - median));
  std::sort(distances.begin(), distances.end());
  return {static_cast<float>(median), static_cast<float>(distances[distances.size() / 2]),
          static_cast<float>(others > 0 ? agreeing / others : 0)};
}

TEST(LocalAgreement, EqualsTheNaiveOneOnDenseAndSparsePixels) {
  for (const cv::Size& size : {cv::Size(40, 30), {9, 40}, {3, 3}, {1, 1}}) {
    for (const int one_of : {1, 4, 30}) {
      const Depths depths = randomDepths(static_cast<std::uint32_t>(one_of), size, one_of);
      const std::vector<LocalAgreement> found = depths.agreement();
      SparseMask(depths.mask).forEach([&](std::size_t i, cv::Point at) {
        const LocalAgreement exact = naive(depths, at);
        SCOPED_TRACE(testing::Message() << at << " of " << size << ", one of " << one_of);
        ASSERT_EQ(found[i].median, exact.median);
        ASSERT_NEAR(found[i].spread, exact.spread, 1e-5);
        ASSERT_NEAR(found[i].agreeing_fraction, exact.agreeing_fraction, 1e-5);
      });
    }
  }
}

}  // namespace

}  // namespace efm::aggregated_extraction_test
