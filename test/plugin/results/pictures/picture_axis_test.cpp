// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "plugin/results/pictures/picture_axis.h"

namespace efm {
namespace {

using testing::ElementsAre;

std::vector<std::string> textsOf(const AxisRange& range, int max_ticks) {
  std::vector<std::string> texts;
  for (const AxisTick& tick : ticksOf(range, max_ticks)) texts.push_back(tick.text);
  return texts;
}

TEST(PictureAxis, TicksAreRoundNumbers) {
  EXPECT_THAT(textsOf({0, 1}, 6), ElementsAre("0", "0.2", "0.4", "0.6", "0.8", "1"));
  EXPECT_THAT(textsOf({0, 102}, 6), ElementsAre("0", "20", "40", "60", "80", "100"));
  EXPECT_THAT(textsOf({-0.7, 2.3}, 5), ElementsAre("0", "1", "2"));
  EXPECT_THAT(textsOf({12.3, 12.9}, 4), ElementsAre("12.4", "12.6", "12.8"));
  EXPECT_THAT(textsOf({0, 1}, 5), ElementsAre("0", "0.5", "1"));
  EXPECT_THAT(textsOf({0, 1}, 2), ElementsAre("0", "1"));
  EXPECT_TRUE(ticksOf({1, 1}, 5).empty());
}

TEST(PictureAxis, AnInverseAxisHasEqualInversesOnEqualLengths) {
  const AxisRange inverse{0.77, 6.4, AxisScale::kInverse};  // equal steps of the inverse
  EXPECT_DOUBLE_EQ(inverse.fractionAlong(0.77), 0);
  EXPECT_DOUBLE_EQ(inverse.fractionAlong(6.4), 1);
  EXPECT_NEAR(inverse.fractionAlong(2 / (1 / 0.77 + 1 / 6.4)), 0.5, 1e-12);
  EXPECT_TRUE(std::isnan(inverse.fractionAlong(0)));
  EXPECT_THAT(textsOf(inverse, 6), ElementsAre("0.8", "1", "2", "5"));
  EXPECT_THAT(textsOf({1.05, 1.35, AxisScale::kInverse}, 3), ElementsAre("1.1", "1.2", "1.3"));
}

RC_GTEST_PROP(PictureAxis, ItsTicksAreRoundAndInside, ()) {
  const double from = *rc::gen::inRange(-1000, 1000);
  const double to = from + *rc::gen::inRange(1, 1000);
  const double unit = std::pow(10.0, *rc::gen::inRange(-12, 12));
  const AxisRange range{from * unit, to * unit};
  const auto ticks = ticksOf(range, 6);
  RC_ASSERT(!ticks.empty());
  RC_ASSERT(ticks.size() <= 6U);
  for (const AxisTick& tick : ticks) {
    RC_ASSERT(range.fractionAlong(tick.value) > -1e-6);
    RC_ASSERT(range.fractionAlong(tick.value) < 1 + 1e-6);
  }
}

}  // namespace

}  // namespace efm
