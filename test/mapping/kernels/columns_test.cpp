// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/kernels/columns.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "mapping/kernels/weighted_ranks.h"
#include "test/mapping/kernels/fast_kernels.h"

namespace efm::kernels {
namespace {

TEST(ColumnFunctions, AllKernelsAddThePlainKernelsBits) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(0, 3);
  for (const std::size_t planes : {1U, 3U, 15U, 16U, 17U, 100U, 101U}) {
    std::vector<std::uint16_t> values(planes + kColumnPadding);
    for (std::uint16_t& value : values) value = static_cast<std::uint16_t>(random());
    values.front() = 65'535;
    std::vector<float> expected(planes + kColumnPadding, 0.0F);
    std::vector<float> units;
    for (int i = 0; i < 5; ++i) units.push_back(unit(random));
    for (const float u : units) {
      for (std::size_t p = 0; p < planes; ++p) expected[p] += u * static_cast<float>(values[p]);
    }
    for (const VotingKernel kernel : availableKernels()) {
      std::vector<float> sum(planes + kColumnPadding, 0.0F);
      for (const float u : units) {
        columnFunctions(kernel).add(sum.data(), values.data(), planes, u);
      }
      for (std::size_t p = 0; p < planes; ++p) {
        ASSERT_EQ(sum[p], expected[p]) << nameOf(kernel) << ", plane " << p << " of " << planes;
      }
    }
  }
}

TEST(RankFunctions, AllKernelsAddTheWeightsAtOrBelowEachPosition) {
  std::mt19937 random(2);
  for (const std::size_t n : {0U, 1U, 7U, 16U, 17U, 81U}) {
    std::vector<float> positions(n + kRankPadding);
    std::vector<float> weights(n + kRankPadding, 1e9F);  // those of the padding count nowhere
    for (std::size_t i = 0; i < n; ++i) {
      positions[i] = static_cast<float>(random() % 20);  // some are equal
      weights[i] = static_cast<float>(1 + random() % 9);
    }
    std::vector<float> expected(n, 0.0F);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j)
        expected[i] += positions[j] <= positions[i] ? weights[j] : 0;
    }
    for (const VotingKernel kernel : availableKernels()) {
      std::vector<float> below(n + kRankPadding, 0.0F);
      rankFunctions(kernel).add(below.data(), positions.data(), weights.data(), n);
      below.resize(n);
      ASSERT_EQ(below, expected) << nameOf(kernel) << ", " << n << " positions";
    }
  }
}

}  // namespace
}  // namespace efm::kernels
