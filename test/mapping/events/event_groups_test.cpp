// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/event_groups.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <ostream>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "test/mapping/keyframes/random_scene.h"

namespace efm {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// Where a bundle came from, written into its one ray.
struct Origin {
  int camera = 0;
  int slice = 0;
  int polarity = 0;
  int subinterval = 0;

  friend bool operator==(const Origin& a, const Origin& b) {
    return a.camera == b.camera && a.slice == b.slice && a.polarity == b.polarity &&
           a.subinterval == b.subinterval;
  }
  friend std::ostream& operator<<(std::ostream& out, const Origin& o) {
    return out << "camera " << o.camera << ", slice " << o.slice << ", polarity " << o.polarity
               << ", sub-interval " << o.subinterval;
  }
};

RayBundle bundleFrom(const Origin& origin) {
  RayBundle bundle;
  bundle.x_inf.push_back(static_cast<float>(100 * origin.camera + origin.slice));
  bundle.y_inf.push_back(static_cast<float>(100 * origin.polarity + origin.subinterval));
  return bundle;
}

Origin originOf(const RayBundle& bundle) {
  const int x = static_cast<int>(bundle.x_inf.at(0));
  const int y = static_cast<int>(bundle.y_inf.at(0));
  return {x / 100, x % 100, y / 100, y % 100};
}

/// How a window is divided.
struct Division {
  int cameras = 1;
  int slices = 1;
  int polarities = 1;
  int subintervals = 1;
};

std::vector<CameraRays> raysOf(const Division& division) {
  std::vector<CameraRays> cameras(static_cast<std::size_t>(division.cameras));
  for (int c = 0; c < division.cameras; ++c) {
    for (int slice = 0; slice < division.slices; ++slice) {
      for (int polarity = 0; polarity < division.polarities; ++polarity) {
        for (int s = 0; s < division.subintervals; ++s) {
          cameras[static_cast<std::size_t>(c)].push_back(bundleFrom({c, slice, polarity, s}));
        }
      }
    }
  }
  return cameras;
}

/// A permutation for each camera.
std::vector<std::vector<int>> randomSlots(std::mt19937& random, const Division& division) {
  std::vector<std::vector<int>> slots;
  for (int c = 0; c < division.cameras; ++c) {
    std::vector<int>& of_camera = slots.emplace_back();
    for (int s = 0; s < division.subintervals; ++s) of_camera.push_back(s);
    std::shuffle(of_camera.begin(), of_camera.end(), random);
  }
  return slots;
}

template <typename Check>
void forEachDivision(const Check& check) {
  for (int cameras = 1; cameras <= 3; ++cameras) {
    for (int slices = 1; slices <= 4; ++slices) {
      for (int polarities = 1; polarities <= 2; ++polarities) {
        for (const int subintervals : {1, 2, 5}) {
          SCOPED_TRACE(testing::Message() << cameras << " cameras, " << slices << " slices, "
                                          << polarities << " polarities, " << subintervals);
          check(Division{cameras, slices, polarities, subintervals});
        }
      }
    }
  }
}

TEST(ArrangeGroups, SeveralCamerasMeetInEverySliceAndPolarityInTheirSlots) {
  std::mt19937 random(1);
  forEachDivision([&](const Division& division) {
    if (division.cameras == 1) return;
    const auto slots = randomSlots(random, division);
    const SplitRays split = arrangeGroups(raysOf(division), division.slices, slots);
    ASSERT_EQ(split.groups, division.slices * division.polarities);
    ASSERT_EQ(split.inputs.size(), static_cast<std::size_t>(division.cameras));
    for (int c = 0; c < division.cameras; ++c) {
      const auto camera = static_cast<std::size_t>(c);
      ASSERT_EQ(split.inputs[camera].size(),
                static_cast<std::size_t>(split.groups * division.subintervals));
      auto bundle = split.inputs[camera].begin();
      for (int slice = 0; slice < division.slices; ++slice) {
        for (int polarity = 0; polarity < division.polarities; ++polarity) {
          for (const int part : slots[camera]) {
            EXPECT_EQ(originOf(*bundle++), (Origin{c, slice, polarity, part}));
          }
        }
      }
    }
  });
}

TEST(ArrangeGroups, TheSlicesOfASingleCameraStandForCamerasAndOnlyPolaritiesAreGroups) {
  std::mt19937 random(2);
  forEachDivision([&](const Division& division) {
    if (division.cameras > 1) return;
    const auto slots = randomSlots(random, division);
    const SplitRays split = arrangeGroups(raysOf(division), division.slices, slots);
    ASSERT_EQ(split.groups, division.polarities);
    ASSERT_EQ(split.inputs.size(), static_cast<std::size_t>(division.slices));
    for (int slice = 0; slice < division.slices; ++slice) {
      const CameraRays& input = split.inputs[static_cast<std::size_t>(slice)];
      ASSERT_EQ(input.size(), static_cast<std::size_t>(split.groups * division.subintervals));
      auto bundle = input.begin();
      for (int polarity = 0; polarity < division.polarities; ++polarity) {
        for (const int part : slots[0]) {
          EXPECT_EQ(originOf(*bundle++), (Origin{0, slice, polarity, part}));
        }
      }
    }
  });
}

TEST(ArrangeGroups, WithoutASplitTheRaysStayAsTheyAre) {
  const SplitRays split = arrangeGroups(raysOf({2, 1, 1, 3}), 1, {{0, 1, 2}, {0, 1, 2}});
  EXPECT_EQ(split.groups, 1);
  for (int c = 0; c < 2; ++c) {
    for (int s = 0; s < 3; ++s) {
      EXPECT_EQ(originOf(split.inputs[static_cast<std::size_t>(c)][static_cast<std::size_t>(s)]),
                (Origin{c, 0, 0, s}));
    }
  }
}

TEST(EventsOfPolarity, AreThoseOfTheOtherRemovedInTheirOrder) {
  test::RandomScene random(3);
  const std::vector<Event> events = random.events(test::smallCamera(), 500, 0, 1000);
  const std::vector<Event> dark = eventsOfPolarity(events, false);
  const std::vector<Event> bright = eventsOfPolarity(events, true);
  EXPECT_EQ(dark.size() + bright.size(), events.size());
  auto next_dark = dark.begin();
  auto next_bright = bright.begin();
  for (const Event& event : events) {
    auto& next = event.polarity ? next_bright : next_dark;
    ASSERT_EQ(*next, event);
    ++next;
  }
}

TEST(EventsOfPolarity, OfNoneAreNone) {
  EXPECT_TRUE(eventsOfPolarity(EventSpan(), true).empty());
  EXPECT_TRUE(eventsOfPolarity(std::vector<Event>{{1, 2, 3, true}}, false).empty());
}

TEST(SplitFusionOptions, AreTwoSlicesOfTwoPolarities) {
  EXPECT_EQ(SplitFusionOptions().polarities(), 2);
  EXPECT_EQ(SplitFusionOptions().time_slices, 2);
}

TEST(SplitFusionOptions, NoneIsOneGroup) {
  EXPECT_EQ(SplitFusionOptions::none().polarities(), 1);
  EXPECT_EQ(SplitFusionOptions::none().time_slices, 1);
}

TEST(SplitFusionOptions, SlicesOutOfRangeAreNamed) {
  for (const int slices : {-1, 0, 1001}) {
    SplitFusionOptions options;
    options.time_slices = slices;
    EXPECT_THAT(
        [&] { options.validate(); },
        ThrowsMessage<std::invalid_argument>(HasSubstr("time_slices = " + std::to_string(slices))));
  }
  for (const int slices : {1, 1000}) {
    SplitFusionOptions options;
    options.time_slices = slices;
    EXPECT_NO_THROW(options.validate());
  }
  EXPECT_NO_THROW(SplitFusionOptions().validate());
}

}  // namespace
}  // namespace efm
