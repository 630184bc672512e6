// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/text/event_columns.h"

#include <gtest/gtest.h>

#include <functional>

namespace efm {
namespace {

/// The values of event i: of its time, its column, its row and its polarity.
using Values = std::function<double(int)>;
struct Recorded {
  Values t = [](int i) { return 1 + i * 1e-5; };
  Values x = [](int i) { return i * 97 % 240; };
  Values y = [](int i) { return i * 59 % 180; };
  Values p = [](int i) { return i % 3 == 0 ? 1 : 0; };
};

/// What the values of events with the columns x y t p show: "xytp!" if it is certain.
std::string shownBy(const Recorded& recorded, int count = 200,
                    const std::string& expected = "txyp") {
  EventRows rows = {{1, 2, 3}};  // not four numbers
  for (int i = 0; i < count; ++i) {
    rows.push_back({recorded.x(i), recorded.y(i), recorded.t(i), recorded.p(i)});
  }
  const std::optional<ColumnOrder> found = orderOfValues(rows, expected);
  return found ? found->order + (found->certain ? "!" : "") : "";
}

TEST(ColumnOrder, IsThatOfTheOnlyPossibleColumns) {
  const auto with = [](Values Recorded::*column, const Values& values) {
    Recorded recorded;
    recorded.*column = values;
    return recorded;
  };
  EXPECT_EQ(shownBy({}), "xytp!");
  EXPECT_EQ(shownBy({}, 9), "");
  EXPECT_EQ(shownBy({}, 10), "xytp");
  EXPECT_EQ(shownBy({}, 99), "xytp");
  EXPECT_EQ(shownBy({}, 100), "xytp!");
  EXPECT_EQ(shownBy(with(&Recorded::p, [](int) { return 1; })), "xytp");
  EXPECT_EQ(shownBy(with(&Recorded::p, [](int) { return 0; })), "xytp");
  EXPECT_EQ(shownBy(with(&Recorded::p, [](int i) { return i % 2 * 2 - 1; })), "xytp!");
  EXPECT_EQ(shownBy(with(&Recorded::p, [](int i) { return -(i % 2); })), "");
  EXPECT_EQ(shownBy(with(&Recorded::p, [](int i) { return i % 3; })), "");
  EXPECT_EQ(shownBy(with(&Recorded::p, [](int i) { return 0.5 * (i % 3); })), "");
  // A late time is a tenth of all before the newest at most.
  EXPECT_EQ(shownBy(with(&Recorded::t, [](int i) { return i == 101 ? 90 : i; }), 102), "xytp!");
  EXPECT_EQ(shownBy(with(&Recorded::t, [](int i) { return i == 101 ? 89 : i; }), 102), "");
  EXPECT_EQ(shownBy(with(&Recorded::t, [](int) { return 0.5; })), "");
  // Pixels are whole, at least 0, have 16 bits, and differ by 2 at least.
  for (const auto& column : {&Recorded::x, &Recorded::y}) {
    for (const auto& [least, most, order] :
         {std::tuple(0.0, 65'535.0, "xytp!"), std::tuple(3.0, 5.0, "xytp!"),
          std::tuple(0.0, 65'536.0, ""), std::tuple(-1.0, 9.0, ""), std::tuple(0.5, 9.0, ""),
          std::tuple(3.0, 4.0, "")}) {
      const auto pixels = [least = least, most = most](int i) { return i % 2 == 0 ? most : least; };
      EXPECT_EQ(shownBy(with(column, pixels)), order) << least << " to " << most;
    }
  }
}

TEST(ColumnOrder, IsTheExpectedOneWhereItIsPossible) {
  for (const char* expected : {"xytp", "yxtp"}) {
    EXPECT_EQ(shownBy({}, 10, expected), std::string(expected) + "!");
  }
  Recorded still;  // with one pixel, one polarity and one time
  still.t = still.x = still.y = [](int) { return 7; };
  still.p = [](int) { return 1; };
  EXPECT_EQ(shownBy(still, 200, "xytp"), "xytp!");
  Recorded restarted;  // with decimals, a time may fall
  restarted.t = [](int i) { return i % 100 + 0.5; };
  EXPECT_EQ(shownBy(restarted, 200, "xytp"), "xytp!");
  restarted.t = [](int i) { return i % 100; };
  EXPECT_EQ(shownBy(restarted, 200, "xytp"), "");
  EXPECT_EQ(shownBy({}, 200, "xytp-"), "xytp!") << "another number of columns";
}

}  // namespace
}  // namespace efm
