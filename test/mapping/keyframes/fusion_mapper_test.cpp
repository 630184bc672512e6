// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframes/fusion_mapper.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "mapping/geometry/timestamp.h"
#include "test/mapping/depth/same_image.h"
#include "test/mapping/keyframes/random_scene.h"
#include "test/mapping/options/refused_option.h"

namespace efm::fusion_mapper_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::ThrowsMessage;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;
constexpr int kPlanes = 4;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::int64_t at(std::int64_t ms) { return kStart_ns + ms * kMs; }

FusionMapperOptions period(double window_s = 0.1, double stride_s = 0.1) {
  FusionMapperOptions options;
  options.policy.window_s = window_s;
  options.policy.stride_s = stride_s;
  options.keyframe.planes.num_planes = kPlanes;
  options.keyframe.sweep.threads = 1;
  options.filter.hot_pixels = false;  // most of these recordings are a single pixel's
  options.fill_last_window = false;   // `EdgeCase` has tests of it
  return options;
}

Event eventAt(std::int64_t t_ns, int x = 20) {
  return {t_ns, static_cast<std::uint16_t>(x), 0, true};
}

/// A mapper of cameras side by side. Times are milliseconds since kStart_ns.
class Mapper : public FusionMapper {
 public:
  explicit Mapper(const FusionMapperOptions& options = period(), int cameras = 1)
      : FusionMapper(options) {
    for (int c = 0; c < cameras; ++c) {
      addCamera({test::smallCamera(), {Eigen::Quaterniond::Identity(), {0.1 * c, 0, 0}}, 0});
    }
  }
  /// A pose every 10 ms, the last time included.
  void addPoses(std::int64_t from_ms, std::int64_t to_ms) {
    for (std::int64_t ms = from_ms; ms <= to_ms; ms += 10) {
      addPose({at(ms), {Eigen::Quaterniond::Identity(), {1e-3 * static_cast<double>(ms), 0, 0}}});
    }
  }
  /// One packet with an event every millisecond.
  void addSteady(int camera, std::int64_t from_ms, std::int64_t to_ms) {
    std::vector<Event> events;
    for (std::int64_t ms = from_ms; ms < to_ms; ++ms) events.push_back(eventAt(at(ms)));
    addEvents(camera, events);
  }
  /// The same in packets of 10 ms.
  void addSteadyPackets(int camera, std::int64_t from_ms, std::int64_t to_ms) {
    for (std::int64_t ms = from_ms; ms < to_ms; ms += 10) {
      addSteady(camera, ms, std::min(ms + 10, to_ms));
    }
  }
  std::vector<KeyframeDepthMap> takeAll() {
    std::vector<KeyframeDepthMap> keyframes;
    while (auto keyframe = next()) keyframes.push_back(std::move(*keyframe));
    return keyframes;
  }
  /// The remaining keyframes at the end of the recording; the counts add up then.
  std::vector<KeyframeDepthMap> end() {
    finish();
    std::vector<KeyframeDepthMap> keyframes = takeAll();
    const MapperCounts all = counts();
    for (const EventCounts& c : all.cameras) {
      EXPECT_EQ(c.read, c.used + c.without_pose + c.outside_window + c.dropped + c.filtered +
                            c.outside_lens + c.over_budget);
    }
    EXPECT_EQ(all.votes.total(), all.event_uses * kPlanes);
    return keyframes;
  }
};

TEST(FusionMapper, WindowsStartAtTheFirstEventWithAPose) {
  Mapper mapper;
  mapper.addPoses(15, 495);
  mapper.addSteady(0, 0, 400);
  const auto keyframes = mapper.end();
  ASSERT_EQ(keyframes.size(), 3U);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(keyframes[k].window.t0_ns, at(15 + 100 * static_cast<int>(k)));
    EXPECT_EQ(keyframes[k].events[0], 100U) << "an event at t1 belongs to the next window";
  }
  const EventCounts total = mapper.counts().total();
  EXPECT_EQ(total.read, 400U);
  EXPECT_EQ(total.without_pose, 15U);
  EXPECT_EQ(total.used, 300U);
  EXPECT_EQ(total.outside_window, 85U) << "the last window is not full";
}

TEST(FusionMapper, WindowsOverlapOrLeaveGapsAndCountEachEventOnce) {
  struct Case {
    double window_s, stride_s;
    int end_ms;
    std::size_t keyframes;
    std::uint64_t uses, used, outside;
  };
  for (const Case& c : {Case{0.1, 0.04, 301, 6, 600, 300, 1}, {0.05, 0.1, 300, 3, 150, 150, 150}}) {
    Mapper mapper(period(c.window_s, c.stride_s));
    mapper.addPoses(0, 400);
    std::size_t keyframes = 0;
    for (int ms = 0; ms < c.end_ms; ms += 10) {
      mapper.addSteady(0, ms, std::min(ms + 10, c.end_ms));
      keyframes += mapper.takeAll().size();
    }
    EXPECT_EQ(keyframes + mapper.end().size(), c.keyframes);
    EXPECT_EQ(mapper.counts().event_uses, c.uses);
    EXPECT_EQ(mapper.counts().total().used, c.used);
    EXPECT_EQ(mapper.counts().total().outside_window, c.outside);
    EXPECT_EQ(mapper.counts().total().dropped, 0U);
  }
}

TEST(FusionMapper, AWindowWaitsForThePosesThatCoverIt) {
  Mapper mapper;
  mapper.addSteady(0, 0, 200);
  mapper.addPoses(0, 90);
  EXPECT_FALSE(mapper.next());
  mapper.addPoses(100, 100);
  EXPECT_TRUE(mapper.next());
}

TEST(FusionMapper, AWindowWaitsForEveryCamera) {
  Mapper mapper(period(), 2);
  mapper.addPoses(0, 300);
  mapper.addSteady(0, 0, 200);
  EXPECT_FALSE(mapper.next());
  mapper.addSteady(1, 0, 111);
  const auto keyframe = mapper.next();
  ASSERT_TRUE(keyframe);
  EXPECT_THAT(keyframe->events, ElementsAre(100U, 100U));
}

TEST(FusionMapper, ASilentCameraIsReportedAndDelaysNobodyForLongerThanASecond) {
  Mapper mapper(period(), 2);
  mapper.addPoses(0, 2000);
  mapper.addSteadyPackets(0, 0, 1500);
  const auto keyframes = mapper.takeAll();
  EXPECT_EQ(keyframes.size(), 4U) << "those that end a second before the newest packet";
  ASSERT_FALSE(keyframes.empty());
  EXPECT_THAT(keyframes[0].silent_cameras, ElementsAre(1));
  mapper.coverUntil(1, at(1400));
  EXPECT_EQ(mapper.takeAll().size(), 10U) << "once the camera is known to have no events";
}

TEST(FusionMapper, ALongPacketDoesNotMakeTheOtherCameraLate) {
  Mapper mapper(period(), 2);
  mapper.addPoses(0, 3000);
  mapper.addSteady(0, 0, 2500);
  EXPECT_THAT(mapper.takeAll(), IsEmpty()) << "camera 1's packet may begin as early";
  mapper.addSteady(1, 0, 2500);
  EXPECT_EQ(mapper.takeAll().size(), 24U);
  EXPECT_EQ(mapper.counts().total().dropped, 0U);
}

TEST(FusionMapper, EventsThatComeAfterTheirWindowAreDroppedAndCounted) {
  Mapper mapper(period(), 2);
  mapper.addPoses(0, 2000);
  mapper.addSteadyPackets(0, 0, 1500);
  mapper.takeAll();
  mapper.addSteady(1, 0, 50);
  mapper.end();
  EXPECT_EQ(mapper.counts().cameras[1].dropped, 50U);
}

TEST(FusionMapper, AnUnselectedCamerasEventsAreDroppedAndNobodyWaitsForThem) {
  FusionMapperOptions left_only = period();
  left_only.cameras = {0};
  Mapper mapper(left_only, 2);
  mapper.addPoses(0, 300);
  mapper.addSteady(1, 0, 50);
  mapper.addSteady(0, 0, 111);
  EXPECT_EQ(mapper.takeAll().size(), 1U);
  EXPECT_EQ(mapper.counts().cameras[1].dropped, 50U);
}

TEST(FusionMapper, ACamerasTimeOffsetIsAddedToItsTimes) {
  Mapper mapper(period(), 0);
  mapper.addCamera({test::smallCamera(), {}, -30 * kMs});
  mapper.addPoses(0, 300);
  mapper.addSteady(0, 0, 200);
  const auto keyframe = mapper.next();
  ASSERT_TRUE(keyframe);
  EXPECT_EQ(keyframe->window.t0_ns, kStart_ns);
  mapper.end();
  EXPECT_EQ(mapper.counts().total().without_pose, 30U);
}

TEST(FusionMapper, TheOnlyWindowIsMappedAtTheEndEvenIfItIsNotFull) {
  FusionMapperOptions single = period();
  single.only_window = Window{at(50), at(500), at(60)};
  Mapper mapper(single);
  mapper.addPoses(0, 200);
  mapper.addSteady(0, 0, 300);
  EXPECT_FALSE(mapper.next());
  const auto keyframes = mapper.end();
  ASSERT_EQ(keyframes.size(), 1U);
  EXPECT_EQ(keyframes[0].events[0], 151U);
  EXPECT_EQ(mapper.counts().total().without_pose, 99U);
  EXPECT_EQ(mapper.counts().total().outside_window, 50U);
}

TEST(FusionMapper, AKeyframeWhoseReferenceHasNoPoseIsCountedAndSkipped) {
  FusionMapperOptions with_gap = period();
  with_gap.trajectory.max_pose_gap_s = 0.02;
  Mapper mapper(with_gap);
  mapper.addPoses(0, 120);
  mapper.addPoses(180, 400);
  mapper.addSteady(0, 0, 301);
  EXPECT_EQ(mapper.end().size(), 2U);
  EXPECT_EQ(mapper.counts().keyframes_without_pose, 1U);
  EXPECT_EQ(mapper.counts().total().without_pose, 59U) << "between the poses at 120 and 180 ms";
}

TEST(FusionMapper, WithoutPosesAllEventsAreCountedAsWithoutPose) {
  Mapper mapper;
  mapper.addSteady(0, 0, 300);
  EXPECT_THAT(mapper.end(), IsEmpty());
  EXPECT_EQ(mapper.counts().total().without_pose, 300U);
}

TEST(FusionMapper, AnEventOutsideTheSensorIsAnErrorAndNoEventOfItsPacketIsTaken) {
  Mapper mapper;
  EXPECT_THAT(([&] {
                mapper.addEvents(0, {eventAt(1), eventAt(2, 48)});
              }),
              ThrowsMessage<std::invalid_argument>(
                  AllOf(HasSubstr("(48, 0)"), HasSubstr("48x36"), HasSubstr("0.000000002 s"))));
  EXPECT_EQ(mapper.counts().total().read, 0U);
}

TEST(FusionMapper, ACalibrationThatIsNoneIsRefusedWithItsValue) {
  using Change = std::function<void(RigCamera&)>;
  const std::vector<std::pair<const char*, Change>> cases = {
      {"fx = 0: must be", [](RigCamera& c) { c.model.fx = 0; }},
      {"T_rig_cam: x = nan: must be finite",
       [](RigCamera& c) {
         c.T_rig_cam.translation = {kNan, 0, 0};
       }},
      {"T_rig_cam: z = inf: must be finite",
       [](RigCamera& c) {
         c.T_rig_cam.translation = {0, 0, std::numeric_limits<double>::infinity()};
       }},
      {"quaternion = nan: must be 1", [](RigCamera& c) { c.T_rig_cam.rotation.w() = kNan; }},
      {"quaternion = 2: must be 1", [](RigCamera& c) { c.T_rig_cam.rotation.w() = 2; }},
      {"quaternion = 0: must be 1", [](RigCamera& c) { c.T_rig_cam.rotation.w() = 0; }},
      {"time offset = 9223372036.854775807: must be within",
       [](RigCamera& c) { c.time_offset_ns = kMaxTimeNs; }},
      {"time offset = -4611686018.427387904: must be within 4611686018.427387903 s",
       [](RigCamera& c) { c.time_offset_ns = -kEndOfTimeNs - 1; }},
  };
  for (const auto& [message, change] : cases) {
    RigCamera camera{test::smallCamera(), {}, 0};
    change(camera);
    Mapper mapper(period(), 0);
    EXPECT_THAT([&] { mapper.addCamera(camera); },
                ThrowsMessage<std::invalid_argument>(HasSubstr(message)));
    EXPECT_TRUE(mapper.rig().cameras.empty());
    EXPECT_THAT([&] { KeyframeMapper({{camera}}, {0}, period().keyframe); },
                ThrowsMessage<std::invalid_argument>(HasSubstr(message)));
  }
}

TEST(FusionMapper, NoTimeOverflowsWithTheOffsetOfItsCamera) {
  for (const std::int64_t sign : {-1, 1}) {
    Mapper mapper(period(), 0);
    mapper.addCamera({test::smallCamera(), {}, sign * kEndOfTimeNs});
    mapper.coverUntil(0, sign * kMaxTimeNs);
    const std::int64_t farthest_ns = -sign * kEndOfTimeNs;
    mapper.addEvents(0, {eventAt(std::min<std::int64_t>(farthest_ns, 0)),
                         eventAt(std::max<std::int64_t>(farthest_ns, 0))});
    EXPECT_THAT([&] { mapper.addEvents(0, {eventAt(sign * kMs)}); },
                ThrowsMessage<std::invalid_argument>(
                    AllOf(HasSubstr("times must lie within"), HasSubstr("offset of"))));
    EXPECT_EQ(mapper.counts().total().read, 2U);
  }
}

TEST(FusionMapper, EventsOutsideTheLensAreCountedAndReachNoFilterAndNoWindow) {
  FusionMapperOptions options = period();
  options.filter.hot_pixels = true;
  options.filter.hot_pixel.min_events = 40;
  options.cameras = {1, 0};
  Mapper mapper(options, 0);
  mapper.addCamera({test::smallCamera(), {}, 0});
  mapper.addCamera({test::foldingCamera(), {}, 0});
  mapper.addCamera({test::foldingCamera(), {}, 0});  // takes no part
  mapper.addPoses(0, 300);
  for (int camera = 0; camera < 3; ++camera) {
    std::vector<Event> events;
    for (int ms = 0; ms < 250; ++ms) {
      events.push_back({at(ms), 0, 0, true});  // hot
      events.push_back({at(ms), 23, static_cast<std::uint16_t>(10 + ms % 16), true});
    }
    mapper.addEvents(camera, events);
  }
  EXPECT_EQ(mapper.end().size(), 2U);
  const std::vector<EventCounts> counts = mapper.counts().cameras;
  EXPECT_EQ(counts[0].outside_lens, 0U);
  EXPECT_EQ(counts[0].filtered, 211U);
  EXPECT_EQ(counts[1].outside_lens, 250U);
  EXPECT_EQ(counts[1].used, 200U);
  EXPECT_EQ(counts[1].filtered, 0U);
  EXPECT_EQ(counts[2].outside_lens, 0U);
  EXPECT_EQ(counts[2].dropped, 500U);
}

TEST(FusionMapper, EventsUpToTenMillisecondsLateAreSortedAndCounted) {
  auto events = test::RandomScene(5).events(test::smallCamera(), 3000, kStart_ns, 300 * kMs);
  const auto keyframesOf = [&](std::uint64_t& sorted_events) {
    Mapper mapper;
    mapper.addPoses(0, 400);
    mapper.addEvents(0, events);
    auto keyframes = mapper.end();
    sorted_events = mapper.counts().sorted_events;
    return keyframes;
  };
  std::uint64_t sorted_events = 0;
  const auto expected = keyframesOf(sorted_events);
  EXPECT_EQ(sorted_events, 0U);
  // Blocks of 5 ms in reverse: times are unique, so there is one right order.
  for (auto block = events.begin(); block != events.end(); block += 50) {
    std::reverse(block, block + 50);
  }
  const auto sorted = keyframesOf(sorted_events);
  EXPECT_GT(sorted_events, 2000U);
  ASSERT_EQ(expected.size(), 2U);
  ASSERT_EQ(sorted.size(), 2U);
  for (std::size_t k = 0; k < 2; ++k) EXPECT_TRUE(test::same(expected[k].map, sorted[k].map));
}

TEST(FusionMapper, EventsOfOneTimeAreNotLate) {
  Mapper mapper;
  mapper.addEvents(0, {eventAt(kStart_ns), eventAt(kStart_ns), eventAt(kStart_ns + 1)});
  mapper.addEvents(0, {eventAt(kStart_ns + 1)});
  EXPECT_EQ(mapper.counts().sorted_events, 0U);
  mapper.addEvents(0, {eventAt(kStart_ns), eventAt(kStart_ns + 1)});
  EXPECT_EQ(mapper.counts().sorted_events, 1U);
}

TEST(FusionMapper, EventsThatComeLaterThanThatAreAnError) {
  Mapper mapper;
  mapper.addEvents(0, {eventAt(20 * kMs), eventAt(10 * kMs)});
  EXPECT_THAT([&] { mapper.addEvents(0, {eventAt(10 * kMs - 1)}); },
              ThrowsMessage<std::invalid_argument>(
                  AllOf(HasSubstr("event at 0.009999999 s"), HasSubstr("that at 0.020000000 s"))));
  EXPECT_EQ(mapper.counts().total().read, 2U);
}

TEST(FusionMapper, OfTwoPosesWithOneTimeTheFirstStandsAndTheSecondIsCounted) {
  Mapper mapper;
  mapper.addPoses(0, 150);
  EXPECT_EQ(mapper.counts().duplicate_poses, 0U);
  const Rigid3 T_world_other{Eigen::Quaterniond::Identity(), {7, 0, 0}};
  mapper.addPose({at(50), T_world_other});   // among the others
  mapper.addPose({at(150), T_world_other});  // at their end
  EXPECT_EQ(mapper.counts().duplicate_poses, 2U);
  mapper.addSteadyPackets(0, 0, 150);
  mapper.finish();
  const auto keyframe = mapper.next();
  ASSERT_TRUE(keyframe);
  EXPECT_NEAR(keyframe->T_world_ref.translation.x(), 0.05, 1e-12);
}

TEST(FusionMapper, APoseFarBehindTheNewestIsAnErrorThatNamesBoth) {
  Mapper mapper;
  mapper.addPoses(5000, 5000);
  EXPECT_THAT([&] { mapper.addPoses(0, 0); },
              ThrowsMessage<std::invalid_argument>(
                  AllOf(HasSubstr("1700000000.000000000 s"), HasSubstr("1700000005.000000000 s"))));
}

TEST(FusionMapper, TheReferenceMayStandFarOutsideTheOnlyWindow) {
  for (const std::int64_t t_ref_ns : {at(100), at(2900)}) {
    FusionMapperOptions single = period();
    single.only_window = Window{at(1500), at(1600), t_ref_ns};
    Mapper mapper(single);
    std::size_t keyframes = 0;
    for (int ms = 0; ms < 3000; ms += 10) {
      mapper.addPoses(ms, ms);
      mapper.addSteady(0, ms, ms + 10);
      keyframes += mapper.takeAll().size();
    }
    EXPECT_EQ(keyframes + mapper.end().size(), 1U);
    EXPECT_EQ(mapper.counts().total().used, 100U);
  }
}

TEST(FusionMapper, EventsBeforeTheFirstPoseAreWithoutPoseNotDropped) {
  FusionMapperOptions single = period();
  single.only_window = Window{at(400), at(500), at(450)};
  Mapper mapper(single);
  for (int ms = 0; ms < 600; ms += 10) {
    if (ms >= 300) mapper.addPoses(ms, ms);
    mapper.addSteady(0, ms, ms + 10);
    mapper.takeAll();
  }
  mapper.end();
  EXPECT_EQ(mapper.counts().total().used, 100U);
  EXPECT_EQ(mapper.counts().total().dropped, 0U);
  EXPECT_EQ(mapper.counts().total().without_pose, 309U) << "before and after the poses";
}

TEST(FusionMapper, WindowsWithoutEventsMakeNoKeyframes) {
  FusionMapperOptions left_only = period();
  left_only.cameras = {0};
  Mapper mapper(left_only, 2);
  mapper.addPoses(0, 3000);
  mapper.addSteady(0, 0, 250);
  mapper.coverUntil(0, at(3000));
  mapper.addSteady(1, 0, 2001);
  EXPECT_EQ(mapper.end().size(), 3U) << "the third one has events in its first half";
  EXPECT_EQ(mapper.counts().windows_without_events, 17U);
}

TEST(FusionMapper, AGapOfYearsCostsNoTime) {
  Mapper mapper(period(0.001, 0.001));
  constexpr std::int64_t kYears_ms = -kStart_ns / kMs;
  for (const std::int64_t from_ms : {kYears_ms, std::int64_t{0}}) {
    mapper.addPoses(from_ms, from_ms + 20);
    mapper.addSteady(0, from_ms, from_ms + 5);
  }
  EXPECT_EQ(mapper.end().size(), 9U);
  EXPECT_GT(mapper.counts().windows_without_events, 1'600'000'000'000U);
}

TEST(FusionMapper, EventsAndWindowsStayWithinTheLimits) {
  for (const int recorded_ms : {400, 1000}) {
    FusionMapperOptions limited = period();
    limited.limits = {at(50), at(350)};
    Mapper mapper(limited);
    mapper.addPoses(0, 1200);
    mapper.addSteady(0, 0, recorded_ms);
    const auto keyframes = mapper.end();
    ASSERT_EQ(keyframes.size(), 3U) << "for any length of the recording";
    EXPECT_EQ(keyframes.front().window.t0_ns, at(50));
    EXPECT_EQ(keyframes.back().window.t1_ns, at(350));
    const EventCounts total = mapper.counts().total();
    EXPECT_EQ(total.read, static_cast<std::uint64_t>(recorded_ms));
    EXPECT_EQ(total.outside_window, static_cast<std::uint64_t>(recorded_ms - 300));
  }
}

TEST(FusionMapper, InvalidOptionsAreNamed) {
  using test::expectRefused;
  const FusionMapperOptions valid = period();
  expectRefused(
      "cameras = 0: must be there once",
      [](auto& o) {
        o.cameras = {0, 1, 0};
      },
      valid);
  expectRefused(
      "cameras = -1", [](auto& o) { o.cameras = {-1}; }, valid);
  expectRefused(
      "must be after",
      [](auto& o) {
        o.limits = {20, 10};
      },
      valid);
  FusionMapperOptions wrong = period();
  wrong.cameras = {-1};
  EXPECT_THROW(FusionMapper{wrong}, std::invalid_argument);
}

TEST(FusionMapper, ACameraThatIsNotThereIsAnError) {
  FusionMapperOptions third = period();
  third.cameras = {0, 2};
  Mapper mapper(third, 2);
  mapper.addPoses(0, 300);
  mapper.addSteady(0, 0, 200);
  mapper.finish();
  EXPECT_THAT([&] { mapper.next(); }, ThrowsMessage<std::invalid_argument>(
                                          AllOf(HasSubstr("cameras = 2"), HasSubstr("0 to 1"))));
}

}  // namespace
}  // namespace efm::fusion_mapper_test
