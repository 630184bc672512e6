// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "mapping/events/window.h"
#include "test/mapping/keyframes/random_scene.h"

namespace efm::window_test {
namespace {

using ::testing::ElementsAre;

constexpr std::int64_t kNow_ns = 1'700'000'000'000'000'003;

/// Returns events at these times, each with its own pixel.
std::vector<Event> eventsAt(const std::vector<std::int64_t>& times_ns) {
  std::vector<Event> events;
  for (const std::int64_t t_ns : times_ns) {
    const auto i = static_cast<std::uint16_t>(events.size());
    events.push_back({t_ns, i, 0, false});
  }
  return events;
}

SubintervalOptions into(int count, SubintervalSplit split) {
  SubintervalOptions options;
  options.count = count;
  options.split = split;
  return options;
}

TEST(Subintervals, PartsOfEqualDurationEndWhereTheExactFractionIsRoundedDown) {
  std::mt19937 random(2);
  for (int draw = 0; draw < 300; ++draw) {
    const auto duration_ns = static_cast<std::int64_t>(1 + random() % 500);
    const int count = static_cast<int>(1 + random() % 20);
    std::vector<std::int64_t> times_ns;  // one event per nanosecond
    for (std::int64_t t_ns = 0; t_ns < duration_ns; ++t_ns) times_ns.push_back(kNow_ns + t_ns);
    const std::vector<Event> events = eventsAt(times_ns);
    const auto parts = splitIntoSubintervals(EventSpan(events), kNow_ns, kNow_ns + duration_ns,
                                             into(count, SubintervalSplit::kDuration));
    for (int s = 0; s < count; ++s) {
      const auto first = static_cast<std::size_t>(duration_ns * s / count);
      const auto end = static_cast<std::size_t>(duration_ns * (s + 1) / count);
      const EventSpan part = parts[static_cast<std::size_t>(s)];
      ASSERT_EQ(part.begin() - events.data(), static_cast<std::ptrdiff_t>(first));
      ASSERT_EQ(part.size(), end - first) << duration_ns << " ns into " << count;
    }
  }
}

TEST(Subintervals, AWindowOfAHundredYearsDoesNotOverflow) {
  const std::int64_t century_ns = 3'155'760'000'000'000'000;
  const auto events = eventsAt({0, century_ns / 1000 * 999 - 1, century_ns / 1000 * 999});
  const auto parts = splitIntoSubintervals(EventSpan(events), 0, century_ns,
                                           into(1000, SubintervalSplit::kDuration));
  EXPECT_EQ(parts[0].size(), 1U);
  EXPECT_EQ(parts[998].size(), 1U);
  EXPECT_EQ(parts[999].size(), 1U);
}

TEST(Subintervals, PartsOfEqualCountEndWhereTheExactFractionIsRoundedDown) {
  std::mt19937 random(3);
  for (int draw = 0; draw < 300; ++draw) {
    const std::size_t size = random() % 200;
    const std::vector<Event> events = eventsAt(std::vector<std::int64_t>(size, kNow_ns));
    const std::size_t count = 1 + random() % 30;
    const auto parts =
        splitIntoSubintervals(EventSpan(events), kNow_ns, kNow_ns + 1,
                              into(static_cast<int>(count), SubintervalSplit::kCount));
    for (std::size_t s = 0; s < count; ++s) {
      ASSERT_EQ(parts[s].begin() - events.data(), static_cast<std::ptrdiff_t>(size * s / count));
      ASSERT_EQ(parts[s].size(), size * (s + 1) / count - size * s / count)
          << size << " into " << count;
    }
  }
}

TEST(SubintervalShuffle, NoneFusesTheSameSubintervals) {
  const auto slots = assignSubintervals(3, into(4, SubintervalSplit::kDuration));
  ASSERT_EQ(slots.size(), 3U);
  for (const auto& camera : slots) EXPECT_THAT(camera, ElementsAre(0, 1, 2, 3));
}

TEST(SubintervalShuffle, ShiftSpreadsTheCamerasOverTheWindow) {
  SubintervalOptions options = into(4, SubintervalSplit::kDuration);
  options.shuffle = SubintervalShuffle::kShift;
  for (int count = 1; count <= 12; ++count) {
    options.count = count;
    for (int cameras = 1; cameras <= 15; ++cameras) {
      const auto slots = assignSubintervals(cameras, options);
      for (int c = 0; c < cameras; ++c) {
        for (int s = 0; s < count; ++s) {
          ASSERT_EQ(slots[static_cast<std::size_t>(c)][static_cast<std::size_t>(s)],
                    (s + c * std::max(1, count / cameras)) % count)
              << cameras << " cameras, " << count << " sub-intervals";
        }
      }
    }
  }
}

TEST(SubintervalShuffle, RandomIsAPermutationPerCameraThatTheSeedDecides) {
  SubintervalOptions options = into(16, SubintervalSplit::kDuration);
  options.shuffle = SubintervalShuffle::kRandom;
  std::set<std::vector<int>> different;
  for (std::uint32_t seed = 0; seed < 5; ++seed) {
    options.shuffle_seed = seed;
    const auto slots = assignSubintervals(3, options);
    EXPECT_EQ(slots, assignSubintervals(3, options)) << "the same in every window";
    for (std::vector<int> camera : slots) {
      different.insert(camera);
      std::sort(camera.begin(), camera.end());
      for (int s = 0; s < 16; ++s) ASSERT_EQ(camera[static_cast<std::size_t>(s)], s);
    }
  }
  // Two of 15 permutations (of 16! = 2e13) are equal with a probability of 5e-12.
  EXPECT_EQ(different.size(), 15U);
}

TEST(SubintervalShuffle, EveryPermutationComesAboutEquallyOften) {
  SubintervalOptions options = into(3, SubintervalSplit::kDuration);
  options.shuffle = SubintervalShuffle::kRandom;
  std::map<std::vector<int>, int> seen;
  for (const auto& camera : assignSubintervals(6000, options)) ++seen[camera];
  ASSERT_EQ(seen.size(), 6U);
  // 1000 of each are expected, within five standard deviations of sqrt(6000 * 1/6 * 5/6) = 29.
  for (const auto& [permutation, count] : seen) EXPECT_NEAR(count, 1000, 145);
}

constexpr Window kWindow{0, 1200, 600};  // divisible by all numbers of sub-intervals below

/// The division of a window.
struct Division {
  int cameras = 1;
  SplitFusionOptions split;
  SubintervalOptions subintervals;
};

template <typename Check>
void forEachDivision(const Check& check) {
  for (int cameras = 1; cameras <= 3; ++cameras) {
    for (int slices = 1; slices <= 4; ++slices) {
      for (const bool polarity : {false, true}) {
        for (const int subintervals : {1, 2, 5}) {
          SCOPED_TRACE(testing::Message() << cameras << " cameras, " << slices << " slices, "
                                          << polarity << " polarity, " << subintervals);
          Division division{cameras, {polarity, slices}, {}};
          division.subintervals.count = subintervals;
          division.subintervals.shuffle = SubintervalShuffle::kRandom;
          check(division);
        }
      }
    }
  }
}

TEST(EventGroups, EachEventOfAWindowIsInThePartOfItsSubintervalAndPolarity) {
  test::RandomScene random(3);
  const std::vector<Event> events = random.events(test::smallCamera(), 500, 0, kWindow.t1_ns);
  forEachDivision([&](const Division& division) {
    const EventGroups groups(division.split, division.subintervals);
    const std::int64_t intervals = division.split.time_slices * division.subintervals.count;
    EXPECT_EQ(groups.subintervals(), static_cast<std::size_t>(intervals));
    std::size_t seen = 0;
    PolaritySplit split;
    for (const EventPart& part : groups.partsOf(events, kWindow)) {
      EXPECT_EQ(part.polarity.has_value(), division.split.polarity);
      const EventSpan selected = part.select(split);
      seen += selected.size();
      for (std::size_t i = 0; i < selected.size(); ++i) {
        const auto subinterval = static_cast<std::int64_t>(part.subinterval);
        ASSERT_GE(selected[i].t_ns * intervals, kWindow.t1_ns * subinterval);
        ASSERT_LT(selected[i].t_ns * intervals, kWindow.t1_ns * (subinterval + 1));
        ASSERT_EQ(selected[i].polarity, part.polarity.value_or(selected[i].polarity));
        ASSERT_LE(selected[i > 0 ? i - 1 : 0].t_ns, selected[i].t_ns) << "in their order";
      }
    }
    EXPECT_EQ(seen, events.size());
  });
}

TEST(EventGroups, InputsMeetInTheSameGroupsAndInTheirShuffledSlots) {
  forEachDivision([](const Division& division) {
    const EventGroups groups(division.split, division.subintervals);
    const FusionLayout layout = groups.layoutOf(division.cameras);
    const auto slots = assignSubintervals(division.cameras, division.subintervals);
    const std::vector<EventPart> parts = groups.partsOf(EventSpan(), kWindow);
    const int slices = division.split.time_slices;
    const int polarities = division.split.polarities();
    const bool slices_are_inputs = division.cameras == 1;
    ASSERT_EQ(layout.groups, slices_are_inputs ? polarities : slices * polarities);
    ASSERT_EQ(layout.inputs.size(),
              static_cast<std::size_t>(slices_are_inputs ? slices : division.cameras));
    for (std::size_t input = 0; input < layout.inputs.size(); ++input) {
      const std::size_t camera = slices_are_inputs ? 0 : input;
      auto source = layout.inputs[input].begin();
      for (int group = 0; group < layout.groups; ++group) {
        const int slice = slices_are_inputs ? static_cast<int>(input) : group / polarities;
        for (const int subinterval : slots[camera]) {
          ASSERT_NE(source, layout.inputs[input].end());
          ASSERT_EQ(source->camera, camera);
          const EventPart& part = parts.at(source->part);
          ASSERT_EQ(part.subinterval,
                    static_cast<std::size_t>(slice * division.subintervals.count + subinterval));
          ASSERT_EQ(part.polarity.value_or(false), group % polarities == 1);
          ++source;
        }
      }
      ASSERT_EQ(source, layout.inputs[input].end());
    }
  });
}

TEST(SplitFusionOptions, AreTwoSlicesOfTwoPolaritiesAndNoneIsOneGroup) {
  using O = SplitFusionOptions;
  EXPECT_EQ(O().polarities() * 10 + O().time_slices, 22);
  EXPECT_EQ(O::none().polarities() * 10 + O::none().time_slices, 11);
}

}  // namespace

}  // namespace efm::window_test
