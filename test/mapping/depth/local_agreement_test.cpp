// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/aggregated_extraction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace efm::local_agreement_test {
namespace {

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
}  // namespace efm::local_agreement_test
