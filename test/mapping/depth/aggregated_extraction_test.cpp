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

/// Returns the position of a depth between planes of inverse spacing (inverse of `depthAt`).
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

/// Returns the fraction of the nearest edge's votes that a column of pixels has.
double acrossEdge(int x) {
  const double off = x % 12 - 6;
  return std::exp(-off * off / (2 * 0.7 * 0.7));
}

/// Returns edges that all have the same values along their rays.
ChosenDsi edges(const cv::Size& size, int planes, const std::function<double(int plane)>& ray) {
  ChosenDsi dsi(size, planes);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      dsi.setColumn({x, y}, [&](int plane) { return acrossEdge(x) * ray(plane); });
    }
  }
  return dsi;
}

/// Draws edges with different depths, some wrong depths, and noise everywhere.
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
               // Parallax between the limits: 6.3 and 9 pixels. A step is 1/8 pixel.
               {40, 3.5, 39 * 0.125 / 6.3},
               {100, 5, 99 * 0.125 / 9}};
  for (const auto& [planes, parallax_px_m, step_planes] : cases) {
    for (const int window : {3, 5, 11}) {
      const cv::Size size(64, 37);
      const ChosenDsi dsi = randomEdges(static_cast<std::uint32_t>(planes + window), size, planes);
      const DepthPlanes depths = planesOf(planes);
      DepthExtractionOptions options;
      options.threshold_kernel = window;
      options.min_probability = 0.2 + 0.03 * window;
      options.neighbours = window > 3;
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
          const bool same_probability =
              planes > 2 ? std::abs(found.probability(y, x) - exact.probability(y, x)) < 0.005F
                         : std::isnan(found.probability(y, x));
          differing += same_depth && same_variance && same_probability ? 0 : 1;
        }
      }
      EXPECT_GT(kept, kept_before + 40) << planes << " planes, window " << window;
    }
  }
  // If rounding decides whether a pixel is a candidate, the pixels around it may differ too.
  EXPECT_LE(differing, kept / 1000) << "of " << kept;
}

TEST(AggregatedExtraction, AnEdgeAlongTheMotionIsRejectedBecauseItsColumnIsFlat) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> noise(0, 0.01);
  std::vector<double> flat(100);
  for (double& value : flat) value = 1 + noise(random);
  flat[50] = 1.011;  // the peak is here by chance
  const auto ray = [&](int plane) { return 20 * flat[static_cast<std::size_t>(plane)]; };
  for (const bool neighbours : {false, true}) {
    DepthExtractionOptions options;
    options.neighbours = neighbours;
    EXPECT_EQ(cv::countNonZero(extract(edges({60, 40}, 100, ray), options).depth), 0);
  }
}

TEST(AggregatedExtraction, TheContrastThresholdAndTheNeighboursAreThoseOfTheOptions) {
  const ChosenDsi dsi = randomEdges(9, {64, 37}, 100);
  DepthExtractionOptions options;
  options.min_probability = 0.5;
  options.neighbours = false;
  const DepthMap kept = extract(dsi, options);
  options.neighbours = true;
  const DepthMap grown = extract(dsi, options);
  EXPECT_GT(cv::countNonZero(grown.depth), cv::countNonZero(kept.depth) + 100);
  EXPECT_EQ(cv::countNonZero((grown.depth != kept.depth) & (kept.depth > 0)), 0);
  EXPECT_EQ(grown.pixels.neighbours, static_cast<std::uint64_t>(cv::countNonZero(grown.depth) -
                                                                cv::countNonZero(kept.depth)));
  options.min_local_contrast = 1e6;
  EXPECT_EQ(cv::countNonZero(extract(dsi, options).depth), 0);
}

TEST(AggregatedExtraction, MorePlanesThanTheParallaxTellsApartLoseNoPoints) {
  // The peak is one pixel of parallax wide; the limits are three pixels apart.
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
    // A range of half a pixel of parallax gives no depth.
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
        // Positions are multiples of 1/2 plane: some are equal, some differ by exactly the limit.
        depths.keep({x, y}, std::round(2 * position(random)) / 2, weight(random));
      }
    }
  }
  return depths;
}

/// Computes the three numbers from their definitions, in double.
LocalAgreement naive(const Depths& depths, const cv::Point& pixel) {
  std::vector<std::pair<double, double>> around;  // position, weight
  double agreeing = 0;
  int agreeing_count = 0;
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
        ++agreeing_count;
      }
    }
  }
  // The median is the smallest position with half of the weight at or below it.
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
          static_cast<float>(others > 0 ? agreeing / others : 0), agreeing_count};
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
        ASSERT_EQ(found[i].agreeing, exact.agreeing);
      });
    }
  }
}

// --- The sum of the rays around each pixel -------------------------------------------------------

/// Draws ridges of several heights on every ray, and noise.
ChosenDsi randomDsi(std::uint32_t seed, const cv::Size& size, int planes) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  ChosenDsi dsi(size, planes);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const double height = 5 + 10 * uniform(random);
      const double at = (planes - 1) * uniform(random);
      const double other = (planes - 1) * uniform(random);
      dsi.setColumn({x, y}, [&](int plane) {
        return height * ridge(plane, at, 2.5) + 0.6 * height * ridge(plane, other, 1.5) +
               0.3 * uniform(random);
      });
    }
  }
  return dsi;
}

cv::Mat1b randomMask(std::uint32_t seed, const cv::Size& size, int one_of) {
  std::mt19937 random(seed);
  cv::Mat1b mask = cv::Mat1b::zeros(size);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      if (random() % static_cast<unsigned>(one_of) == 0) mask(y, x) = 255;
    }
  }
  return mask;
}

std::vector<AggregatedPeak> aggregate(const ChosenDsi& dsi, const cv::Mat1b& mask) {
  const SweptDsi swept = dsi.swept();
  return aggregateColumns(SparseMask(mask), swept.columns, planesPerStep(swept.columns.planes()));
}

/// Returns the sum of the rays of the chosen pixels in 9x9, in double.
std::vector<double> naiveSum(const ChosenDsi& dsi, const cv::Mat1b& mask, const cv::Point& pixel) {
  std::vector<double> sum(static_cast<std::size_t>(dsi.planes));
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      const int dx = std::abs(x - pixel.x);
      const int dy = std::abs(y - pixel.y);
      if (mask(y, x) == 0 || dx > 4 || dy > 4) continue;
      const double weight = std::exp(-(dx * dx + dy * dy) / (2 * 1.5 * 1.5));
      for (int plane = 0; plane < dsi.planes; ++plane) {
        sum[static_cast<std::size_t>(plane)] += weight * double{dsi.at({x, y}, plane)};
      }
    }
  }
  return sum;
}

/// Returns whether two peaks have the same height up to rounding.
bool isTie(const std::vector<double>& sum, double top) {
  return std::count_if(sum.begin(), sum.end(),
                       [&](double value) { return value > top * (1 - 1e-4); }) > 1;
}

void expectNaive(const ChosenDsi& dsi, const cv::Mat1b& mask) {
  const std::vector<AggregatedPeak> peaks = aggregate(dsi, mask);
  const ChosenDsi rounded = dsi.rounded();
  const SparseMask chosen(mask);
  ASSERT_EQ(peaks.size(), chosen.size());
  const double place = std::max(1.0, (dsi.planes - 1) / 99.0);
  int compared = 0;
  chosen.forEach([&](std::size_t i, cv::Point pixel) {
    const std::vector<double> sum = naiveSum(rounded, mask, pixel);
    const auto best = static_cast<int>(std::max_element(sum.begin(), sum.end()) - sum.begin());
    const double top = sum[static_cast<std::size_t>(best)];
    if (isTie(sum, top)) return;
    ++compared;
    SCOPED_TRACE(testing::Message() << pixel << " of " << dsi.planes << " planes");
    const bool at_end = best == 0 || best == dsi.planes - 1;
    ASSERT_EQ(peaks[i].at_end, at_end);
    for (std::size_t b = 0; b < peaks[i].second_peak.size(); ++b) {
      const double places = AggregatedPeak::kMinSteps + static_cast<double>(b);
      double second = 0;
      for (int plane = 0; plane < dsi.planes; ++plane) {
        if (std::abs(plane - best) <= std::lround(places * place)) continue;
        second = std::max(second, sum[static_cast<std::size_t>(plane)]);
      }
      ASSERT_NEAR(peaks[i].second_peak[b], second / top, 1e-4) << places << " places";
    }
    double position = best;
    if (at_end) {
      ASSERT_TRUE(std::isinf(peaks[i].width_sq));
    } else {
      const double before = sum[static_cast<std::size_t>(best - 1)];
      const double after = sum[static_cast<std::size_t>(best + 1)];
      const double curvature = 2 * top - before - after;
      position += 0.5 * (after - before) / curvature;
      ASSERT_NEAR(peaks[i].width_sq, top / curvature, 1e-3 * top / curvature * top / curvature);
    }
    ASSERT_NEAR(peaks[i].position, position, 5e-3);
  });
  EXPECT_GT(compared, static_cast<int>(chosen.size()) * 9 / 10);
}

TEST(ColumnAggregation, EqualsTheNaiveSumForAnyNumberOfPlanesAndPixels) {
  std::uint32_t seed = 0;
  for (const cv::Size& size : {cv::Size(1, 1), {1, 9}, {5, 3}}) {
    expectNaive(randomDsi(7, size, 40), cv::Mat1b(size, 255));
  }
  for (const int planes : {1, 2, 3, 8, 100, 150, 500}) {
    for (const int one_of : {1, 3, 20}) {
      const cv::Size size(31, 22);
      ++seed;
      expectNaive(randomDsi(seed, size, planes), randomMask(seed, size, one_of));
    }
  }
}

TEST(ColumnAggregation, ASingleRidgeIsFoundBetweenPlanesWithItsWidthForAnyNumberOfPlanes) {
  for (const int planes : {100, 400, 800, 1600, 6400}) {
    const double step = (planes - 1) / 99.0;
    for (const double at : {20.0, 20.25, 20.5, 33.8}) {
      ChosenDsi dsi({11, 11}, planes);
      dsi.setColumn({5, 5}, [&](int plane) { return 10 * ridge(plane / step, at, 3); });
      cv::Mat1b mask = cv::Mat1b::zeros(11, 11);
      mask(5, 5) = 255;
      const AggregatedPeak peak = aggregate(dsi, mask).at(0);
      EXPECT_NEAR(peak.position / step, at, 0.02) << planes;
      EXPECT_NEAR(peak.width_sq / (step * step), 9, 1.0) << planes;
      EXPECT_FALSE(peak.at_end);
    }
  }
}

TEST(ColumnAggregation, OfTwoEqualPeaksTheNearerIsTakenAndFullyAmbiguous) {
  ChosenDsi dsi({1, 1}, 60);
  dsi.setColumn({0, 0}, [](int plane) { return ridge(plane, 20, 1) + ridge(plane, 40, 1); });
  const AggregatedPeak peak = aggregate(dsi, cv::Mat1b(1, 1, 255)).at(0);
  EXPECT_NEAR(peak.second_peak.front(), 1, 1e-3);
  EXPECT_EQ(peak.position, 20);
}

TEST(PlanesPerStep, IsOneUpToAHundredPlanesAndGrowsWithThem) {
  for (const int planes : {1, 2, 50, 100}) EXPECT_EQ(planesPerStep(planes), 1);
  EXPECT_DOUBLE_EQ(planesPerStep(199), 2);
  EXPECT_DOUBLE_EQ(planesPerStep(496), 5);
  // If the parallax is small, a step is an eighth of a pixel, but at most a 24th of the range.
  EXPECT_DOUBLE_EQ(planesPerStep(101, 10), 1.25);
  EXPECT_DOUBLE_EQ(planesPerStep(241, 1), 10);
  EXPECT_DOUBLE_EQ(planesPerStep(11, 1), 10 / 24.0);
  EXPECT_DOUBLE_EQ(planesPerStep(11, 100), 1);
}

}  // namespace

}  // namespace efm::aggregated_extraction_test
