// SPDX-License-Identifier: BSD-3-Clause
#include "maps/metrics/depth_metrics.h"

#include <gtest/gtest.h>

#include <cmath>

namespace efm {
namespace {

/// All of them.
std::vector<double> valuesOf(const DepthErrors& e) {
  return {e.mean_abs_m,     e.median_abs_m,
          e.median_inverse, e.bad_pix_5px.value_or(-1),
          e.silog,          e.bad_pix_3px.value_or(-1),
          e.aerrr,          e.aerrr_by_estimate,
          e.log_rmse,       e.delta[0],
          e.delta[1],       e.delta[2],
          e.beyond_tenth};
}

void expectMeasures(const std::vector<double>& values, const std::vector<double>& expected) {
  ASSERT_EQ(values.size(), expected.size());
  for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(values[i], expected[i], 1e-12) << i;
}

TEST(DepthErrors, AreWorkedOutByHand) {
  // |Z - Z_true| = 1, 0, 1, 3; |1/Z - 1/Z_true| = 1/2, 0, 1/2, 3/10; d = ln 2, 0, -ln 2, ln 5/2.
  const DepthErrors errors = depthErrors({{2, 1}, {3, 3}, {1, 2}, {5, 2}});
  EXPECT_EQ(errors.points, 4U);
  const double ln2 = std::log(2.0);
  const double other = std::log(2.5);
  const double squares = (2 * ln2 * ln2 + other * other) / 4;
  expectMeasures(valuesOf(errors), {5.0 / 4, 1, 0.4, -1, 100 * (squares - other * other / 16), -1,
                                    (1 + 0.5 + 1.5) / 4, (0.5 + 1 + 0.6) / 4,
                                    100 * std::sqrt(squares), 0.25, 0.25, 0.25, 0.75});
  expectMeasures(valuesOf(depthErrors({}, 100.0)), std::vector<double>(13, 0.0));
  // A tenth is not beyond a tenth.
  EXPECT_EQ(depthErrors({{2.25, 2.5}, {2.75, 2.5}, {8, 10}}).beyond_tenth, 1.0 / 3);
}

TEST(DepthErrors, MeanOverMapsCountsEachMapTheSameAndEmptyOnesNot) {
  const DepthErrors a = depthErrors({{2, 1}, {1, 1}}, 10.0);
  const DepthErrors b = depthErrors({{4, 1}, {3, 2}, {1, 1}, {1.1, 1}}, 10.0);
  const DepthErrors mean = meanOfErrors({a, depthErrors({}, 10.0), b});
  EXPECT_EQ(mean.points, 6U);
  std::vector<double> expected = valuesOf(a);
  for (std::size_t i = 0; i < 13; ++i) expected[i] = (expected[i] + valuesOf(b)[i]) / 2;
  expectMeasures(valuesOf(mean), expected);
  EXPECT_FALSE(meanOfErrors({a, depthErrors({{1, 1}})}).bad_pix_3px.has_value());
  EXPECT_EQ(meanOfErrors({}).points, 0U);
  expectMeasures(valuesOf(meanOfErrors({})), valuesOf(depthErrors({})));
}

TEST(DepthErrors, BadPixelsExceedTheLimitInPixelsAndFivePercent) {
  // f * b = 100, so disparity = 100 / Z.
  const std::vector<DepthPair> pairs = {
      {100.0 / 50, 100.0 / 50},    // exact
      {100.0 / 54, 100.0 / 50},    // 4 px, 8 %: bad for 3 px only
      {100.0 / 56, 100.0 / 50},    // 6 px, 12 %: bad for both
      {100.0 / 206, 100.0 / 200},  // 6 px, 3 %: good for both
  };

  const DepthErrors errors = depthErrors(pairs, 100.0);

  EXPECT_DOUBLE_EQ(errors.bad_pix_5px.value(), 0.25);
  EXPECT_DOUBLE_EQ(errors.bad_pix_3px.value(), 0.5);
  // At the limits a pixel is good: 69 px for 64, and 168 px for 160, which is 5 % more.
  EXPECT_EQ(depthErrors({{64, 69}}, 64.0 * 69).bad_pix_5px.value(), 0);
  EXPECT_EQ(depthErrors({{160, 168}}, 160.0 * 168).bad_pix_5px.value(), 0);
  EXPECT_THROW(depthErrors({{1, 1}}, 0.0), std::invalid_argument);
  EXPECT_THROW(depthErrors({{1, 1}}, std::nan("")), std::invalid_argument);
}

TEST(DepthErrors, DeltaCountsRatiosUnderPowersOfFiveFourths) {
  // Ratios, either way up: 1.2, 1.25 (not under 1.25), 1.5, 1.9, 2.
  const DepthErrors errors = depthErrors({{1.2, 1}, {1, 1.25}, {1.5, 1}, {1, 1.9}, {2, 1}});
  EXPECT_DOUBLE_EQ(errors.delta[0], 1.0 / 5);
  EXPECT_DOUBLE_EQ(errors.delta[1], 3.0 / 5);
  EXPECT_DOUBLE_EQ(errors.delta[2], 4.0 / 5);
}

}  // namespace
}  // namespace efm
