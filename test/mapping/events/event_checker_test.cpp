// SPDX-License-Identifier: BSD-3-Clause
// Tests the events that a program adds. Those of files: test/plugin/recordings/streams.
#include "mapping/events/event_checker.h"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>

#include "test/mapping/keyframes/random_scene.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr std::int64_t kMs = 1'000'000;

Event eventAt(std::int64_t t_ns, int x = 20) {
  return {t_ns, static_cast<std::uint16_t>(x), 0, true};
}

TEST(EventIntake, WhatIsNotPossibleIsRejectedAndNothingOfItsCallAdded) {
  EventIntake intake(3, {test::smallCamera(), {}, 0});
  std::vector<Event> first;
  for (std::int64_t ms = 0; ms < 40; ++ms) first.push_back(eventAt(ms * kMs));
  first.push_back(eventAt(30 * kMs));
  EXPECT_EQ(intake.add(first).size(), 41U);
  const auto rejected = [&](std::vector<Event> events, const auto& message) {
    events.insert(events.begin(), eventAt(45 * kMs));
    EXPECT_THAT([&] { intake.add(events); }, ThrowsMessage<std::invalid_argument>(message));
  };
  rejected({eventAt(20 * kMs, 48)},
           AllOf(HasSubstr("camera 3"), HasSubstr("(48, 0)"), HasSubstr("48x36")));
  rejected({Event{40 * kMs, 0, 36, true}}, HasSubstr("(0, 36)"));
  rejected({eventAt(kEndOfTimeNs + 1)}, HasSubstr("times must lie within"));
  rejected({eventAt(29 * kMs)},
           AllOf(HasSubstr("event at 0.029000000 s"), HasSubstr("that at 0.045000000 s")));
  EXPECT_EQ(intake.add({eventAt(29 * kMs)}).size(), 1U) << "45 ms were not added";
}

// Of events in portions of any size, exactly a burst with a wrong time is left out.
RC_GTEST_PROP(EventIntake, LeavesOutABurstOfWrongTimesAlone, ()) {
  const auto length = *rc::gen::inRange<std::int64_t>(1, 1000);
  const auto at = *rc::gen::element<std::int64_t>(0, 10'000, 20'000);
  const auto shift_ns = *rc::gen::inRange<std::int64_t>(11'000, 400'000'000) * kMs;
  const auto portion = *rc::gen::element<std::int64_t>(1, 100, 1'000'000);
  std::vector<Event> all, good;
  for (std::int64_t i = 0; i < 20'000 + length; ++i) {
    Event event = eventAt(i * 10'000, static_cast<int>(i % 48));
    const bool wrong = i >= at && i < at + length;
    if (!wrong) good.push_back(event);
    if (wrong) event.t_ns += shift_ns;
    all.push_back(event);
  }
  EventIntake intake(0, {test::smallCamera(), {}, 0});
  std::vector<Event> right;
  for (auto begin = all.begin(); begin != all.end();) {
    const auto end = begin + std::min<std::ptrdiff_t>(portion, all.end() - begin);
    const CheckedEvents passed = intake.add({begin, end});
    const bool in_order = passed.empty() || passed.back().t_ns <= intake.waitsSinceNs();
    RC_ASSERT(in_order);
    right.insert(right.end(), passed.begin(), passed.end());
    begin = end;
  }
  const CheckedEvents rest = intake.finish();
  right.insert(right.end(), rest.begin(), rest.end());
  const bool same = right == good;  // not printed: long
  RC_ASSERT(same);
  RC_ASSERT(intake.wrongEvents() == static_cast<std::uint64_t>(length));
  RC_ASSERT(!intake.firstWrong().empty());
}

}  // namespace
}  // namespace efm
