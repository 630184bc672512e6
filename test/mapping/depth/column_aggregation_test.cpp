// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/aggregated_extraction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "test/mapping/dsi/chosen_dsi.h"

namespace efm::column_aggregation_test {
namespace {

using test::ChosenDsi;

double ridge(double plane, double at, double sigma) {
  return std::exp(-(plane - at) * (plane - at) / (2 * sigma * sigma));
}

/// Ridges of several heights on every ray, and noise.
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

/// The sum of the rays of the chosen pixels in 9x9, in double.
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

/// Two peaks of the same height up to rounding.
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
  // An eighth of a pixel of little parallax; at most a 24th of the range.
  EXPECT_DOUBLE_EQ(planesPerStep(101, 10), 1.25);
  EXPECT_DOUBLE_EQ(planesPerStep(241, 1), 10);
  EXPECT_DOUBLE_EQ(planesPerStep(11, 1), 10 / 24.0);
  EXPECT_DOUBLE_EQ(planesPerStep(11, 100), 1);
}

}  // namespace
}  // namespace efm::column_aggregation_test
