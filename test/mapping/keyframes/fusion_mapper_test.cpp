// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframes/fusion_mapper.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "test/mapping/keyframes/random_scene.h"

namespace efm {
namespace {

using test::RandomScene;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;

FusionMapperOptions options(double window_s, double stride_s) {
  FusionMapperOptions options;
  options.keyframes.window_s = window_s;
  options.keyframes.stride_s = stride_s;
  options.keyframe.planes.num_planes = 4;
  options.keyframe.sweep.threads = 1;
  options.filter.hot_pixels = false;  // most of these recordings are a single pixel's
  return options;
}

Rigid3 shifted(double x_m) { return {Eigen::Quaterniond::Identity(), {x_m, 0, 0}}; }

RigCamera camera(double x_m = 0) { return {test::smallCamera(), shifted(x_m), 0}; }

Event eventAt(std::int64_t t_ns, int x = 20, int y = 20) {
  return {t_ns, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), true};
}

void addPoses(FusionMapper& mapper, std::int64_t from_ns, std::int64_t to_ns) {
  for (std::int64_t t_ns = from_ns; t_ns <= to_ns; t_ns += 10 * kMs) {
    mapper.addPose({t_ns, shifted(1e-9 * static_cast<double>(t_ns - kStart_ns))});
  }
}

/// An event every millisecond.
std::vector<Event> steadyEvents(std::int64_t from_ns, std::int64_t to_ns) {
  std::vector<Event> events;
  for (std::int64_t t_ns = from_ns; t_ns < to_ns; t_ns += kMs) events.push_back(eventAt(t_ns));
  return events;
}

/// The same, handed over in packets of 10 ms.
void addSteadyPackets(FusionMapper& mapper, int camera, std::int64_t from_ns, std::int64_t to_ns) {
  for (std::int64_t t_ns = from_ns; t_ns < to_ns; t_ns += 10 * kMs) {
    mapper.addEvents(camera, steadyEvents(t_ns, std::min(t_ns + 10 * kMs, to_ns)));
  }
}

std::vector<KeyframeDepthMap> takeAll(FusionMapper& mapper) {
  std::vector<KeyframeDepthMap> keyframes;
  while (auto keyframe = mapper.next()) keyframes.push_back(*keyframe);
  return keyframes;
}

void expectCountsToAddUp(const MapperCounts& counts, std::uint64_t planes) {
  for (const EventCounts& c : counts.cameras) {
    EXPECT_EQ(c.read, c.used + c.without_pose + c.outside_window + c.dropped + c.filtered);
  }
  EXPECT_EQ(counts.votes.total(), counts.event_uses * planes);
}

TEST(FusionMapper, WindowsStartAtTheFirstEventWithAPose) {
  FusionMapper mapper(options(0.1, 0.1));
  mapper.addCamera(camera());
  addPoses(mapper, kStart_ns + 15 * kMs, kStart_ns + 500 * kMs);
  mapper.addEvents(0, steadyEvents(kStart_ns, kStart_ns + 400 * kMs));
  mapper.finish();
  const auto keyframes = takeAll(mapper);
  ASSERT_EQ(keyframes.size(), 3U);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(keyframes[k].window.t0_ns, kStart_ns + (15 + 100 * static_cast<int>(k)) * kMs);
    EXPECT_EQ(keyframes[k].events[0], 100U) << "an event at t1 belongs to the next window";
  }
  const EventCounts total = mapper.counts().total();
  EXPECT_EQ(total.read, 400U);
  EXPECT_EQ(total.without_pose, 15U);
  EXPECT_EQ(total.used, 300U);
  EXPECT_EQ(total.outside_window, 85U) << "the trailing window is not full";
  expectCountsToAddUp(mapper.counts(), 4);
}

TEST(FusionMapper, OverlappingWindowsCountDistinctEventsAndAllUses) {
  FusionMapper mapper(options(0.1, 0.04));
  mapper.addCamera(camera());
  addPoses(mapper, kStart_ns, kStart_ns + 400 * kMs);
  mapper.addEvents(0, steadyEvents(kStart_ns, kStart_ns + 301 * kMs));
  mapper.finish();
  EXPECT_EQ(takeAll(mapper).size(), 6U);  // t0 = 0, 40, ..., 200 ms
  EXPECT_EQ(mapper.counts().event_uses, 600U);
  EXPECT_EQ(mapper.counts().total().used, 300U);
  EXPECT_EQ(mapper.counts().total().outside_window, 1U);
  expectCountsToAddUp(mapper.counts(), 4);
}

TEST(FusionMapper, EventsBetweenWindowsAreOutsideThem) {
  FusionMapper mapper(options(0.05, 0.1));
  mapper.addCamera(camera());
  addPoses(mapper, kStart_ns, kStart_ns + 400 * kMs);
  std::size_t keyframes = 0;
  for (int packet = 0; packet < 30; ++packet) {
    const std::int64_t t_ns = kStart_ns + packet * 10 * kMs;
    mapper.addEvents(0, steadyEvents(t_ns, t_ns + 10 * kMs));
    keyframes += takeAll(mapper).size();
  }
  mapper.finish();
  keyframes += takeAll(mapper).size();
  EXPECT_EQ(keyframes, 3U);
  EXPECT_EQ(mapper.counts().total().used, 150U);
  EXPECT_EQ(mapper.counts().total().outside_window, 150U);
  EXPECT_EQ(mapper.counts().total().dropped, 0U);
}

/// The same recording, cut into packets and interleaved in another way.
struct Delivery {
  std::vector<KeyframeDepthMap> keyframes;
  MapperCounts counts;
};

Delivery deliver(std::uint32_t seed, std::size_t packet_size, bool poses_first) {
  RandomScene random(seed);
  const Trajectory trajectory = random.motion(kStart_ns, 0.5, 1.0, 2.0);
  std::vector<std::vector<Event>> events;
  FusionMapper mapper(options(0.12, 0.07));
  for (int c = 0; c < 2; ++c) {
    mapper.addCamera(camera(0.1 * c));
    events.push_back(random.events(test::smallCamera(), 4000, kStart_ns - 20 * kMs, 480 * kMs));
  }
  Delivery delivery;
  std::size_t next_pose = 0;
  const auto addPosesUntil = [&](std::int64_t t_ns) {
    const auto& poses = trajectory.poses();
    while (next_pose < poses.size() && poses[next_pose].t_ns <= t_ns) {
      mapper.addPose(poses[next_pose++]);
    }
  };
  const auto take = [&] {
    for (auto& keyframe : takeAll(mapper)) delivery.keyframes.push_back(std::move(keyframe));
  };
  if (poses_first) addPosesUntil(kStart_ns + 1000 * kMs);
  for (std::size_t i = 0; i < 4000; i += packet_size) {
    for (int c = 0; c < 2; ++c) {
      const auto& all = events[static_cast<std::size_t>(c)];
      const auto from = all.begin() + static_cast<std::ptrdiff_t>(i);
      const auto count = static_cast<std::ptrdiff_t>(std::min(packet_size, all.size() - i));
      mapper.addEvents(c, {from, from + count});
      take();
    }
    addPosesUntil(events[0][std::min<std::size_t>(3999, i + packet_size)].t_ns);
    take();
  }
  addPosesUntil(kStart_ns + 1000 * kMs);
  mapper.finish();
  take();
  delivery.counts = mapper.counts();
  return delivery;
}

TEST(FusionMapper, HowARecordingIsCutIntoPacketsNeverChangesTheResult) {
  for (std::uint32_t seed = 1; seed <= 3; ++seed) {
    const Delivery whole = deliver(seed, 4000, true);
    EXPECT_GE(whole.keyframes.size(), 4U);
    EXPECT_GT(whole.counts.total().without_pose, 0U);
    expectCountsToAddUp(whole.counts, 4);
    for (const std::size_t packet_size : {1U, 37U, 1000U}) {
      const Delivery cut = deliver(seed, packet_size, packet_size == 37);
      ASSERT_EQ(cut.keyframes.size(), whole.keyframes.size()) << packet_size;
      for (std::size_t k = 0; k < cut.keyframes.size(); ++k) {
        EXPECT_EQ(cut.keyframes[k].window.t0_ns, whole.keyframes[k].window.t0_ns);
        EXPECT_EQ(cut.keyframes[k].events, whole.keyframes[k].events);
        EXPECT_EQ(cv::norm(cut.keyframes[k].map.confidence, whole.keyframes[k].map.confidence,
                           cv::NORM_INF),
                  0);
      }
      EXPECT_EQ(cut.counts.total().used, whole.counts.total().used);
      EXPECT_EQ(cut.counts.total().without_pose, whole.counts.total().without_pose);
      EXPECT_EQ(cut.counts.total().outside_window, whole.counts.total().outside_window);
      EXPECT_EQ(cut.counts.total().dropped, 0U);
    }
  }
}

TEST(FusionMapper, AWindowWaitsForThePosesThatCoverIt) {
  FusionMapper mapper(options(0.1, 0.1));
  mapper.addCamera(camera());
  mapper.addEvents(0, steadyEvents(kStart_ns, kStart_ns + 200 * kMs));
  addPoses(mapper, kStart_ns, kStart_ns + 90 * kMs);
  EXPECT_FALSE(mapper.next());
  addPoses(mapper, kStart_ns + 100 * kMs, kStart_ns + 100 * kMs);
  EXPECT_TRUE(mapper.next());
}

TEST(FusionMapper, AWindowWaitsForEveryCamera) {
  FusionMapper mapper(options(0.1, 0.1));
  mapper.addCamera(camera());
  mapper.addCamera(camera(0.1));
  addPoses(mapper, kStart_ns, kStart_ns + 300 * kMs);
  mapper.addEvents(0, steadyEvents(kStart_ns, kStart_ns + 200 * kMs));
  EXPECT_FALSE(mapper.next());
  mapper.addEvents(1, steadyEvents(kStart_ns, kStart_ns + 111 * kMs));
  const auto keyframe = mapper.next();
  ASSERT_TRUE(keyframe);
  EXPECT_THAT(keyframe->events, ::testing::ElementsAre(100U, 100U));
}

TEST(FusionMapper, ASilentCameraIsReportedAndHoldsNothingUp) {
  FusionMapper mapper(options(0.1, 0.1));
  mapper.addCamera(camera());
  mapper.addCamera(camera(0.1));
  addPoses(mapper, kStart_ns, kStart_ns + 2000 * kMs);
  addSteadyPackets(mapper, 0, kStart_ns, kStart_ns + 1500 * kMs);
  const auto keyframes = takeAll(mapper);
  EXPECT_EQ(keyframes.size(), 4U) << "those that end a second before the newest event";
  ASSERT_FALSE(keyframes.empty());
  EXPECT_THAT(keyframes[0].silent_cameras, ::testing::ElementsAre(1));
  mapper.coverUntil(1, kStart_ns + 1400 * kMs);
  EXPECT_EQ(takeAll(mapper).size(), 10U) << "once the camera is known to have seen nothing";
}

TEST(FusionMapper, ALongPacketDoesNotMakeTheOtherCameraLate) {
  FusionMapper mapper(options(0.1, 0.1));
  mapper.addCamera(camera());
  mapper.addCamera(camera(0.1));
  addPoses(mapper, kStart_ns, kStart_ns + 3000 * kMs);
  mapper.addEvents(0, steadyEvents(kStart_ns, kStart_ns + 2500 * kMs));
  EXPECT_THAT(takeAll(mapper), ::testing::IsEmpty()) << "camera 1's packet may begin as early";
  mapper.addEvents(1, steadyEvents(kStart_ns, kStart_ns + 2500 * kMs));
  EXPECT_EQ(takeAll(mapper).size(), 24U);
  EXPECT_EQ(mapper.counts().total().dropped, 0U);
}

TEST(FusionMapper, EventsThatComeAfterTheirWindowAreDroppedAndCounted) {
  FusionMapper mapper(options(0.1, 0.1));
  mapper.addCamera(camera());
  mapper.addCamera(camera(0.1));
  addPoses(mapper, kStart_ns, kStart_ns + 2000 * kMs);
  addSteadyPackets(mapper, 0, kStart_ns, kStart_ns + 1500 * kMs);
  takeAll(mapper);
  mapper.addEvents(1, steadyEvents(kStart_ns, kStart_ns + 50 * kMs));
  mapper.finish();
  takeAll(mapper);
  EXPECT_EQ(mapper.counts().cameras[1].dropped, 50U);
  expectCountsToAddUp(mapper.counts(), 4);
}

TEST(FusionMapper, AnUnselectedCamerasEventsAreDroppedAndNobodyWaitsForThem) {
  FusionMapperOptions left_only = options(0.1, 0.1);
  left_only.cameras = {0};
  FusionMapper mapper(left_only);
  mapper.addCamera(camera());
  mapper.addCamera(camera(0.1));
  addPoses(mapper, kStart_ns, kStart_ns + 300 * kMs);
  mapper.addEvents(1, steadyEvents(kStart_ns, kStart_ns + 50 * kMs));
  mapper.addEvents(0, steadyEvents(kStart_ns, kStart_ns + 111 * kMs));
  EXPECT_EQ(takeAll(mapper).size(), 1U);
  EXPECT_EQ(mapper.counts().cameras[1].dropped, 50U);
}

TEST(FusionMapper, ACamerasTimeOffsetIsAddedToItsStamps) {
  FusionMapper mapper(options(0.1, 0.1));
  RigCamera late = camera();
  late.time_offset_ns = -30 * kMs;
  mapper.addCamera(late);
  addPoses(mapper, kStart_ns, kStart_ns + 300 * kMs);
  mapper.addEvents(0, steadyEvents(kStart_ns, kStart_ns + 200 * kMs));
  const auto keyframe = mapper.next();
  ASSERT_TRUE(keyframe);
  EXPECT_EQ(keyframe->window.t0_ns, kStart_ns);
  mapper.finish();
  takeAll(mapper);
  EXPECT_EQ(mapper.counts().total().without_pose, 30U);
}

TEST(FusionMapper, TheOnlyWindowIsMappedWithWhatThereIs) {
  FusionMapperOptions single = options(0.1, 0.1);
  single.only_window = Window{kStart_ns + 50 * kMs, kStart_ns + 500 * kMs, kStart_ns + 60 * kMs};
  FusionMapper mapper(single);
  mapper.addCamera(camera());
  addPoses(mapper, kStart_ns, kStart_ns + 200 * kMs);
  mapper.addEvents(0, steadyEvents(kStart_ns, kStart_ns + 300 * kMs));
  EXPECT_FALSE(mapper.next());
  mapper.finish();
  const auto keyframes = takeAll(mapper);
  ASSERT_EQ(keyframes.size(), 1U);
  EXPECT_EQ(keyframes[0].events[0], 151U);
  EXPECT_EQ(mapper.counts().total().without_pose, 99U);
  EXPECT_EQ(mapper.counts().total().outside_window, 50U);
  expectCountsToAddUp(mapper.counts(), 4);
}

TEST(FusionMapper, AKeyframeWhoseReferenceHasNoPoseIsCountedAndSkipped) {
  FusionMapperOptions with_gap = options(0.1, 0.1);
  with_gap.trajectory.max_pose_gap_s = 0.02;
  FusionMapper mapper(with_gap);
  mapper.addCamera(camera());
  addPoses(mapper, kStart_ns, kStart_ns + 120 * kMs);
  addPoses(mapper, kStart_ns + 180 * kMs, kStart_ns + 400 * kMs);
  mapper.addEvents(0, steadyEvents(kStart_ns, kStart_ns + 301 * kMs));
  mapper.finish();
  EXPECT_EQ(takeAll(mapper).size(), 2U);
  EXPECT_EQ(mapper.counts().keyframes_without_pose, 1U);
  EXPECT_EQ(mapper.counts().total().without_pose, 59U) << "between the poses at 120 and 180 ms";
  expectCountsToAddUp(mapper.counts(), 4);
}

TEST(FusionMapper, WithoutPosesAllEventsAreWithoutOne) {
  FusionMapper mapper(options(0.1, 0.1));
  mapper.addCamera(camera());
  mapper.addEvents(0, steadyEvents(kStart_ns, kStart_ns + 300 * kMs));
  mapper.finish();
  EXPECT_FALSE(mapper.next());
  EXPECT_EQ(mapper.counts().total().without_pose, 300U);
}

TEST(FusionMapper, AnEventOutsideTheSensorIsAnErrorAndNothingOfItsPacketIsTaken) {
  FusionMapper mapper(options(0.1, 0.1));
  mapper.addCamera(camera());
  EXPECT_THAT(
      [&] {
        mapper.addEvents(0, {eventAt(1), eventAt(2, 48, 0)});
      },
      ThrowsMessage<std::invalid_argument>(
          AllOf(HasSubstr("(48, 0)"), HasSubstr("48x36"), HasSubstr("0.000000002 s"))));
  EXPECT_EQ(mapper.counts().total().read, 0U);
}

TEST(FusionMapper, EventsUpToTenMillisecondsLateAreSortedAndCounted) {
  FusionMapper in_order(options(0.1, 0.1));
  FusionMapper shuffled(options(0.1, 0.1));
  RandomScene random(5);
  auto events = random.events(test::smallCamera(), 3000, kStart_ns, 300 * kMs);
  for (FusionMapper* mapper : {&in_order, &shuffled}) {
    mapper->addCamera(camera());
    addPoses(*mapper, kStart_ns, kStart_ns + 400 * kMs);
    mapper->addEvents(0, events);
    mapper->finish();
    // Blocks of 5 ms the other way round: times are unique, so there is one right order.
    for (std::size_t i = 0; i < events.size(); i += 50) {
      std::reverse(events.begin() + static_cast<std::ptrdiff_t>(i),
                   events.begin() + static_cast<std::ptrdiff_t>(std::min(i + 50, events.size())));
    }
  }
  const auto expected = takeAll(in_order);
  const auto sorted = takeAll(shuffled);
  ASSERT_EQ(expected.size(), 2U);
  ASSERT_EQ(sorted.size(), 2U);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(cv::norm(expected[k].map.confidence, sorted[k].map.confidence, cv::NORM_INF), 0);
  }
  EXPECT_EQ(in_order.counts().sorted_events, 0U);
  EXPECT_GT(shuffled.counts().sorted_events, 2000U);
  expectCountsToAddUp(shuffled.counts(), 4);
}

TEST(FusionMapper, EventsOfOneTimeAreNotLate) {
  FusionMapper mapper(options(0.1, 0.1));
  mapper.addCamera(camera());
  mapper.addEvents(0, {eventAt(kStart_ns), eventAt(kStart_ns), eventAt(kStart_ns + 1)});
  mapper.addEvents(0, {eventAt(kStart_ns + 1)});
  EXPECT_EQ(mapper.counts().sorted_events, 0U);
  mapper.addEvents(0, {eventAt(kStart_ns), eventAt(kStart_ns + 1)});
  EXPECT_EQ(mapper.counts().sorted_events, 1U);
}

TEST(FusionMapper, EventsThatComeLaterThanThatAreAnError) {
  FusionMapper mapper(options(0.1, 0.1));
  mapper.addCamera(camera());
  mapper.addEvents(0, {eventAt(20 * kMs), eventAt(10 * kMs)});
  EXPECT_THAT([&] { mapper.addEvents(0, {eventAt(10 * kMs - 1)}); },
              ThrowsMessage<std::invalid_argument>(
                  AllOf(HasSubstr("event at 0.009999999 s"), HasSubstr("that at 0.020000000 s"))));
  EXPECT_EQ(mapper.counts().total().read, 2U);
}

TEST(FusionMapper, OfTwoPosesWithOneTimeTheFirstStandsAndTheSecondIsCounted) {
  FusionMapper mapper(options(0.1, 0.1));
  mapper.addCamera(camera());
  addPoses(mapper, kStart_ns, kStart_ns + 150 * kMs);
  EXPECT_EQ(mapper.counts().duplicate_poses, 0U);
  mapper.addPose({kStart_ns + 50 * kMs, shifted(7)});   // among the others
  mapper.addPose({kStart_ns + 150 * kMs, shifted(7)});  // at their end
  EXPECT_EQ(mapper.counts().duplicate_poses, 2U);
  addSteadyPackets(mapper, 0, kStart_ns, kStart_ns + 150 * kMs);
  mapper.finish();
  const auto keyframe = mapper.next();
  ASSERT_TRUE(keyframe);
  EXPECT_EQ(keyframe->T_world_ref.translation.x(), shifted(0.05).translation.x());
}

TEST(FusionMapper, APoseFarBehindTheNewestIsAnErrorThatNamesBoth) {
  FusionMapper mapper(options(0.1, 0.1));
  mapper.addPose({kStart_ns + 5000 * kMs, shifted(0)});
  EXPECT_THAT(
      [&] {
        mapper.addPose({kStart_ns, shifted(0)});
      },
      ThrowsMessage<std::invalid_argument>(
          AllOf(HasSubstr("1700000000.000000000 s"), HasSubstr("1700000005.000000000 s"))));
}

TEST(FusionMapper, TheReferenceMayStandFarOutsideTheOnlyWindow) {
  for (const std::int64_t t_ref_ns : {kStart_ns + 100 * kMs, kStart_ns + 2900 * kMs}) {
    FusionMapperOptions single = options(0.1, 0.1);
    single.only_window = Window{kStart_ns + 1500 * kMs, kStart_ns + 1600 * kMs, t_ref_ns};
    FusionMapper mapper(single);
    mapper.addCamera(camera());
    std::size_t keyframes = 0;
    for (int packet = 0; packet < 300; ++packet) {
      const std::int64_t t_ns = kStart_ns + packet * 10 * kMs;
      addPoses(mapper, t_ns, t_ns);
      mapper.addEvents(0, steadyEvents(t_ns, t_ns + 10 * kMs));
      keyframes += takeAll(mapper).size();
    }
    mapper.finish();
    keyframes += takeAll(mapper).size();
    EXPECT_EQ(keyframes, 1U);
    EXPECT_EQ(mapper.counts().total().used, 100U);
    expectCountsToAddUp(mapper.counts(), 4);
  }
}

TEST(FusionMapper, PosesThatStartLateLeaveEarlierEventsWithoutOneNotDropped) {
  FusionMapperOptions single = options(0.1, 0.1);
  single.only_window = Window{kStart_ns + 400 * kMs, kStart_ns + 500 * kMs, kStart_ns + 450 * kMs};
  FusionMapper mapper(single);
  mapper.addCamera(camera());
  for (int packet = 0; packet < 60; ++packet) {
    const std::int64_t t_ns = kStart_ns + packet * 10 * kMs;
    if (packet >= 30) addPoses(mapper, t_ns, t_ns);
    mapper.addEvents(0, steadyEvents(t_ns, t_ns + 10 * kMs));
    takeAll(mapper);
  }
  mapper.finish();
  takeAll(mapper);
  EXPECT_EQ(mapper.counts().total().used, 100U);
  EXPECT_EQ(mapper.counts().total().dropped, 0U);
  EXPECT_EQ(mapper.counts().total().without_pose, 309U) << "before and after the poses";
  expectCountsToAddUp(mapper.counts(), 4);
}

TEST(FusionMapper, WindowsWithoutEventsMakeNoKeyframes) {
  FusionMapperOptions left_only = options(0.1, 0.1);
  left_only.cameras = {0};
  FusionMapper mapper(left_only);
  mapper.addCamera(camera());
  mapper.addCamera(camera(0.1));
  addPoses(mapper, kStart_ns, kStart_ns + 3000 * kMs);
  mapper.addEvents(0, steadyEvents(kStart_ns, kStart_ns + 250 * kMs));
  mapper.coverUntil(0, kStart_ns + 3000 * kMs);
  mapper.addEvents(1, steadyEvents(kStart_ns, kStart_ns + 2001 * kMs));
  mapper.finish();
  EXPECT_EQ(takeAll(mapper).size(), 3U) << "the third one has events for half of it";
  EXPECT_EQ(mapper.counts().windows_without_events, 17U);
}

TEST(FusionMapper, AGapOfYearsCostsNoTime) {
  FusionMapper mapper(options(0.001, 0.001));
  mapper.addCamera(camera());
  addPoses(mapper, 0, 20 * kMs);
  mapper.addEvents(0, steadyEvents(0, 5 * kMs));
  addPoses(mapper, kStart_ns, kStart_ns + 20 * kMs);
  mapper.addEvents(0, steadyEvents(kStart_ns, kStart_ns + 5 * kMs));
  mapper.finish();
  EXPECT_EQ(takeAll(mapper).size(), 9U);
  EXPECT_GT(mapper.counts().windows_without_events, 1'600'000'000'000U);
  expectCountsToAddUp(mapper.counts(), 4);
}

TEST(FusionMapper, LimitsKeepEventsAndWindowsInside) {
  for (const std::int64_t recorded_ms : {400, 1000}) {
    FusionMapperOptions limited = options(0.1, 0.1);
    limited.limits = {kStart_ns + 50 * kMs, kStart_ns + 350 * kMs};
    FusionMapper mapper(limited);
    mapper.addCamera(camera());
    addPoses(mapper, kStart_ns, kStart_ns + 1200 * kMs);
    mapper.addEvents(0, steadyEvents(kStart_ns, kStart_ns + recorded_ms * kMs));
    mapper.finish();
    const auto keyframes = takeAll(mapper);
    ASSERT_EQ(keyframes.size(), 3U) << "whatever the recording's length";
    EXPECT_EQ(keyframes.front().window.t0_ns, kStart_ns + 50 * kMs);
    EXPECT_EQ(keyframes.back().window.t1_ns, kStart_ns + 350 * kMs);
    EXPECT_EQ(mapper.counts().total().read, static_cast<std::uint64_t>(recorded_ms));
    EXPECT_EQ(mapper.counts().total().outside_window,
              static_cast<std::uint64_t>(recorded_ms - 300));
    expectCountsToAddUp(mapper.counts(), 4);
  }
}

TEST(FusionMapper, OptionsThatCannotBeAreNamed) {
  FusionMapperOptions wrong = options(0.1, 0.1);
  wrong.cameras = {0, 1, 0};
  EXPECT_THAT([&] { FusionMapper mapper(wrong); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("cameras = 0: must be there once")));
  wrong.cameras = {-1};
  EXPECT_THAT([&] { FusionMapper mapper(wrong); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("cameras = -1")));
  wrong.cameras = {};
  wrong.limits = {20, 10};
  EXPECT_THAT([&] { FusionMapper mapper(wrong); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("must be after")));
}

TEST(FusionMapper, ACameraThatIsNotThereIsAnError) {
  FusionMapperOptions third = options(0.1, 0.1);
  third.cameras = {0, 2};
  FusionMapper mapper(third);
  mapper.addCamera(camera());
  mapper.addCamera(camera(0.1));
  addPoses(mapper, kStart_ns, kStart_ns + 300 * kMs);
  mapper.addEvents(0, steadyEvents(kStart_ns, kStart_ns + 200 * kMs));
  mapper.finish();
  EXPECT_THAT([&] { mapper.next(); }, ThrowsMessage<std::invalid_argument>(
                                          AllOf(HasSubstr("cameras = 2"), HasSubstr("0 to 1"))));
}

}  // namespace
}  // namespace efm
