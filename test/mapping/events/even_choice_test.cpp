// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/event.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace efm::even_choice_test {
namespace {

TEST(EvenChoice, TakesOneEventOfEachIntervalOfEqualCount) {
  for (const std::size_t events : {1U, 2U, 7U, 100U, 12345U}) {
    for (const std::size_t limit : {1U, 2U, 3U, 6U, 99U, 5000U, 12344U}) {
      const EvenChoice choice(events, limit);
      ASSERT_EQ(choice.size(), std::min(events, limit));
      EXPECT_EQ(choice.all(), limit >= events);
      const double interval = static_cast<double>(events) / static_cast<double>(choice.size());
      for (std::size_t k = 0; k < choice.size(); ++k) {
        const auto index = static_cast<double>(choice[k]);
        ASSERT_GT(index + 1, interval * static_cast<double>(k)) << events << ", " << limit;
        ASSERT_LT(index, interval * static_cast<double>(k + 1)) << events << ", " << limit;
        ASSERT_TRUE(k == 0 || choice[k] > choice[k - 1]);
      }
    }
  }
}

TEST(EvenChoice, HasNoRegularStep) {
  const EvenChoice choice(8000, 1000);
  std::set<std::size_t> offsets;
  std::size_t odd = 0;
  for (std::size_t k = 0; k < choice.size(); ++k) {
    offsets.insert(choice[k] % 8);
    odd += choice[k] % 2;
  }
  EXPECT_EQ(offsets.size(), 8U) << "every position in an interval occurs";
  EXPECT_NEAR(static_cast<double>(odd), 500, 80) << "of alternating polarities both are chosen";
}

TEST(EvenChoice, WithoutALimitTheEventsAreNotCopied) {
  std::vector<Event> events(50);
  for (std::size_t i = 0; i < events.size(); ++i) events[i].x = static_cast<std::uint16_t>(i);
  std::vector<Event> buffer(3);
  for (const std::size_t limit : {0U, 50U, 51U}) {
    EXPECT_EQ(chooseEvenly(events, limit, buffer).begin(), events.data());
    EXPECT_EQ(chosenEvenly(events, limit), events);
  }
  const std::vector<Event> chosen = chosenEvenly(events, 9);
  const EvenChoice choice(50, 9);
  ASSERT_EQ(chosen.size(), 9U);
  for (std::size_t k = 0; k < 9; ++k) EXPECT_EQ(chosen[k].x, choice[k]);
  EXPECT_EQ(chooseEvenly(events, 9, buffer).size(), 9U);
  EXPECT_TRUE(chooseEvenly({}, 1, buffer).empty());
}

}  // namespace
}  // namespace efm::even_choice_test
