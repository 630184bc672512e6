// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/window.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "test/mapping/base/refused_option.h"
#include "test/mapping/keyframes/random_scene.h"

namespace efm::event_groups_test {
namespace {

constexpr Window kWindow{0, 1200, 600};  // every number of sub-intervals below divides it

/// How a window is divided.
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
  test::expectLimits<O>({{"time_slices", &O::time_slices, {1, 1000}, {-1, 0, 1001}}});
}

}  // namespace
}  // namespace efm::event_groups_test
