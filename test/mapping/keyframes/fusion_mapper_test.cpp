// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframes/fusion_mapper.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <opencv2/core.hpp>
#include <random>
#include <stdexcept>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "test/mapping/keyframes/random_scene.h"
#include "test/plugin/temporary_folder.h"

namespace efm::fusion_mapper_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;
constexpr int kPlanes = 4;

std::int64_t at(std::int64_t ms) { return kStart_ns + ms * kMs; }

FusionMapperOptions period(double window_s = 0.1, double stride_s = 0.1) {
  FusionMapperOptions options;
  options.policy.window_s = window_s;
  options.policy.stride_s = stride_s;
  options.keyframe.planes.num_planes = kPlanes;
  options.keyframe.sweep.threads = 1;
  options.filter.hot_pixels = false;  // most of these recordings have one pixel only
  options.fill_last_window = false;
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
  void addEvents(int camera, std::vector<Event> events) {
    FusionMapper::addEvents(camera, CheckedEvents(std::move(events)));
  }
  /// Adds a pose every 10 ms, including one at `to_ms`.
  void addPoses(std::int64_t from_ms, std::int64_t to_ms) {
    for (std::int64_t ms = from_ms; ms <= to_ms; ms += 10) {
      addPose({at(ms), {Eigen::Quaterniond::Identity(), {1e-3 * static_cast<double>(ms), 0, 0}}});
    }
  }
  /// Adds one packet with an event every millisecond.
  void addSteady(int camera, std::int64_t from_ms, std::int64_t to_ms) {
    std::vector<Event> events;
    for (std::int64_t ms = from_ms; ms < to_ms; ++ms) events.push_back(eventAt(at(ms)));
    addEvents(camera, events);
  }
  std::vector<KeyframeDepthMap> takeAll() {
    std::vector<KeyframeDepthMap> keyframes;
    while (auto keyframe = next()) keyframes.push_back(std::move(*keyframe));
    return keyframes;
  }
  /// Returns the remaining keyframes at the end of the recording. Checks the sums of the counts.
  std::vector<KeyframeDepthMap> end() {
    finish();
    std::vector<KeyframeDepthMap> keyframes = takeAll();
    const MapperCounts all = counts();
    for (const EventCounts& c : all.cameras) {
      EXPECT_EQ(c.read, c.fates.total());
    }
    EXPECT_EQ(all.votes.total(), all.event_uses * kPlanes);
    return keyframes;
  }
};

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
  EXPECT_EQ(mapper.counts().total()[EventFate::kWithoutPose], 99U);
  EXPECT_EQ(mapper.counts().total()[EventFate::kOutsideWindow], 50U);
}

/// A plan finds the windows and the counts of a mapping. Some of these windows alone, with the
/// events of `interval` alone, make the same keyframes: the filters remember no earlier event.
TEST(FusionMapper, PlannedWindowsNeedNoEventBeforeTheirInterval) {
  FusionMapperOptions options = period(0.1, 0.07);
  options.filter.hot_pixels = true;
  options.filter.hot_pixel.min_events = 20;
  options.filter.hot_pixel.period_s = 0.15;
  options.filter.background_activity_s = 0.01;
  std::mt19937 random(5);
  std::vector<std::vector<Event>> events(2);
  for (std::vector<Event>& of_camera : events) {
    for (int ms = 0; ms < 2000; ++ms) {
      const auto pixel = [&] { return static_cast<std::uint16_t>(random() % 16); };
      for (int i = 0; i < 3; ++i) of_camera.push_back({at(ms), pixel(), pixel(), true});
      if (ms / 300 % 2 == 0) of_camera.push_back({at(ms), 7, 7, true});  // hot at times
    }
  }
  const auto mapped = [&](const FusionMapperOptions& with, MapperCounts& counts) {
    Mapper mapper(with, 2);
    mapper.addPoses(0, 2100);
    for (int camera = 0; camera < 2; ++camera) {
      std::vector<Event> part;
      std::copy_if(events[camera].begin(), events[camera].end(), std::back_inserter(part),
                   [&](const Event& event) { return with.interval().contain(event.t_ns); });
      mapper.addEvents(camera, part);
    }
    std::vector<KeyframeDepthMap> keyframes = mapper.end();
    counts = mapper.counts();
    return keyframes;
  };
  MapperCounts counts, planned_counts;
  const std::vector<KeyframeDepthMap> all = mapped(options, counts);
  ASSERT_GT(all.size(), 20U);
  EXPECT_GT(counts.total()[EventFate::kFiltered], 1000U);

  FusionMapperOptions planning = options;
  std::vector<Window> windows;
  planning.on_planned = [&](const Window& window, std::uint64_t of_window) {
    const auto& made = all.at(windows.size());
    EXPECT_EQ(of_window, made.events[0] + made.events[1]);
    windows.push_back(window);
  };
  EXPECT_TRUE(mapped(planning, planned_counts).empty());
  ASSERT_EQ(windows.size(), all.size());
  EXPECT_EQ(planned_counts.cameras, counts.cameras);

  for (const std::size_t begin : {std::size_t{0}, std::size_t{7}, all.size() - 2}) {
    FusionMapperOptions part = options;
    part.planned_windows.assign(windows.begin() + static_cast<std::ptrdiff_t>(begin),
                                windows.end());
    const std::vector<KeyframeDepthMap> made = mapped(part, planned_counts);
    ASSERT_EQ(made.size(), all.size() - begin);
    for (std::size_t i = 0; i < made.size(); ++i) {
      EXPECT_EQ(made[i].events, all[begin + i].events);
      EXPECT_EQ(cv::countNonZero(made[i].map.depth != all[begin + i].map.depth), 0);
    }
  }
}

TEST(FusionMapper, NoTimeOverflowsWithTheOffsetOfItsCamera) {
  for (const std::int64_t sign : {-1, 1}) {
    Mapper mapper(period(), 0);
    mapper.addCamera({test::smallCamera(), {}, sign * kEndOfTimeNs});
    mapper.setCompleteUntil(0, sign * kMaxTimeNs);
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
  mapper.addCamera({test::foldingCamera(), {}, 0});  // not selected
  mapper.addPoses(0, 300);
  for (int camera = 0; camera < 3; ++camera) {
    std::vector<Event> events;
    for (int ms = 0; ms < 250; ++ms) {
      events.push_back({at(ms), 0, 0, true});  // hot pixel
      events.push_back({at(ms), 23, static_cast<std::uint16_t>(10 + ms % 16), true});
    }
    mapper.addEvents(camera, events);
  }
  EXPECT_EQ(mapper.end().size(), 2U);
  const std::vector<EventCounts> counts = mapper.counts().cameras;
  EXPECT_EQ(counts[0][EventFate::kOutsideLens], 0U);
  EXPECT_EQ(counts[0][EventFate::kFiltered], 211U);
  EXPECT_EQ(counts[1][EventFate::kOutsideLens], 250U);
  EXPECT_EQ(counts[1][EventFate::kUsed], 200U);
  EXPECT_EQ(counts[1][EventFate::kFiltered], 0U);
  EXPECT_EQ(counts[2][EventFate::kOutsideLens], 0U);
  EXPECT_EQ(counts[2][EventFate::kUnselected], 500U);
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
    EXPECT_EQ(mapper.counts().total()[EventFate::kUsed], 100U);
  }
}

TEST(FusionMapper, WindowsWithoutEventsMakeNoKeyframes) {
  FusionMapperOptions left_only = period();
  left_only.cameras = {0};
  Mapper mapper(left_only, 2);
  mapper.addPoses(0, 3000);
  mapper.addSteady(0, 0, 250);
  mapper.setCompleteUntil(0, at(3000));
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

TEST(FusionMapper, InvalidOptionsAreNamed) {
  FusionMapperOptions wrong = period();
  for (const int last : {-1, 0, 1, 2}) {
    wrong.cameras = {1, 0, last};
    EXPECT_EQ(messageOf([&] { FusionMapper{wrong}; }).find("cameras = ") == 0, last != 2) << last;
  }
  wrong.cameras = {};
  wrong.keyframe.reference_camera = -1;
  EXPECT_EQ(messageOf([&] { FusionMapper{wrong}; }), "reference_camera = -1: must be 0 or above");
  wrong = period();
  for (const std::int64_t t1_ns : {10, 20}) {
    wrong.limits = {20, t1_ns};
    EXPECT_THAT([&] { wrong.validate(); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("must be after t0")));
    wrong.limits = {};
    wrong.only_window = Window{20, t1_ns, 20};
    EXPECT_THAT([&] { FusionMapper{wrong}; },
                ThrowsMessage<std::invalid_argument>(HasSubstr("must end after it begins")));
  }
}

TEST(FusionMapper, InputThatIsNotValidIsRejectedAndNoneOfIt) {
  Mapper mapper;
  mapper.addEvents(0, {eventAt(20 * kMs), eventAt(10 * kMs)});
  const auto rejected = [&](const std::vector<Event>& events, const auto& message) {
    EXPECT_THAT([&] { mapper.addEvents(0, events); },
                ThrowsMessage<std::invalid_argument>(message));
    EXPECT_EQ(mapper.counts().total().read, 2U);
  };
  rejected({eventAt(10 * kMs - 1)},
           AllOf(HasSubstr("event at 0.009999999 s"), HasSubstr("that at 0.020000000 s")));

  mapper.addPoses(5000, 5000);
  mapper.addPoses(4000, 4000);
  EXPECT_THAT([&] { mapper.addPoses(3999, 3999); },
              ThrowsMessage<std::invalid_argument>(
                  AllOf(HasSubstr("1700000003.999000000 s"), HasSubstr("1700000005.000000000 s"))));
  mapper.addPoses(4000, 4000);
  EXPECT_EQ(mapper.counts().duplicate_poses, 1U);

  RigCamera wrong{test::smallCamera(), {}, 0};
  wrong.model.fx = 0;
  EXPECT_THROW(mapper.addCamera(wrong), std::invalid_argument);
  EXPECT_EQ(mapper.rig().cameras.size(), 1U);
}

TEST(FusionMapper, ASinglePoseMakesNoWindowExceptTheOnlyWindow) {
  for (const bool asked_for : {false, true}) {
    for (const auto policy : {KeyframePolicyKind::kPeriod, KeyframePolicyKind::kEvents,
                              KeyframePolicyKind::kBaseline}) {
      FusionMapperOptions one_pose = period();
      one_pose.policy.policy = policy;
      one_pose.policy.window_events = 1;
      if (asked_for) one_pose.only_window = Window{at(0), at(100), at(50)};
      Mapper mapper(one_pose);
      mapper.addPoses(50, 50);
      mapper.addEvents(
          0, {eventAt(at(50) - 1), eventAt(at(50)), eventAt(at(50)), eventAt(at(50) + 1)});
      ASSERT_EQ(mapper.end().size(), asked_for ? 1U : 0U);
      const EventCounts total = mapper.counts().total();
      EXPECT_EQ(total[EventFate::kWithoutPose], 2U);
      EXPECT_EQ(total[EventFate::kUsed], asked_for ? 2U : 0U);
      EXPECT_EQ(total[EventFate::kOutsideWindow], asked_for ? 0U : 2U);
    }
  }
}

TEST(FusionMapper, SensorsDownToOnePixelAreMapped) {
  for (const auto extraction : {ExtractionMethod::kPaper, ExtractionMethod::kAggregated}) {
    for (const cv::Size& size :
         {cv::Size(16, 16), {5, 5}, {4, 7}, {3, 3}, {2, 2}, {1, 9}, {1, 1}}) {
      SCOPED_TRACE(testing::Message() << size);
      FusionMapperOptions small = period();
      small.keyframe.extraction.extraction = extraction;
      small.keyframe.extraction.neighbours = true;
      small.keyframe.camera_maps = true;
      small.keyframe.event_images = true;
      test::RandomScene random(1);
      Mapper mapper(small, 0);
      const CameraModel model{size.width,
                              size.height,
                              0.9 * size.width,
                              0.9 * size.width,
                              0.5 * (size.width - 1),
                              0.5 * (size.height - 1),
                              {},
                              {}};
      const Trajectory motion = random.motion(kStart_ns, 0.2, 1.0, 1.0);
      for (const StampedPose& pose : motion.poses()) mapper.addPose(pose);
      for (int c = 0; c < 2; ++c) {
        mapper.addCamera({model, random.pose(0.05, 0.05), 0});
        mapper.addEvents(c, random.events(model, 3000, kStart_ns, 110 * kMs));
      }
      const auto keyframes = mapper.end();
      ASSERT_EQ(keyframes.size(), 1U);
      EXPECT_EQ(keyframes[0].map.depth.size(), size);
      EXPECT_EQ(keyframes[0].camera_maps.at(1).map.depth.size(), size);
      EXPECT_EQ(keyframes[0].event_images.at(1).counts.size(), size);
      const MapperCounts counts = mapper.counts();
      EXPECT_GT(counts.event_uses, 0U);
      EXPECT_EQ(counts.votes.cast > 0, size.width > 1) << "a vote needs two columns";
      if (size.width < 5) {
        EXPECT_EQ(cv::countNonZero(keyframes[0].map.depth), 0) << "all frame, no picture";
      }
      if (size.width == 16 && extraction == ExtractionMethod::kPaper) {
        EXPECT_GT(cv::countNonZero(keyframes[0].map.depth), 0);
      }
    }
  }
}

TEST(FusionMapper, TheLastWindowIsFullAndEndsWithTheRecording) {
  struct Case {
    const char* what;
    double window_s, stride_s;
    int poses_ms, events_ms;  // ends of the poses (every 10 ms) and events (every 1 ms)
    std::int64_t limit_ms;    // of the time; 0: none
    std::size_t keyframes;
    int last_begin_ms, last_end_ms;  // the events of the last window
    std::uint64_t used;
  };
  for (const Case& c :
       {Case{"moved back", 0.1, 0.1, 400, 270, 0, 3, 170, 270, 270},
        {"a tenth is new", 0.1, 0.1, 400, 211, 0, 3, 111, 211, 211},
        {"less than a tenth is new", 0.1, 0.1, 400, 210, 0, 2, 100, 200, 200},
        {"the strides fit", 0.1, 0.1, 400, 201, 200, 2, 100, 200, 200},
        {"overlapping windows", 0.1, 0.04, 400, 305, 0, 7, 205, 305, 305},
        {"overlapping windows, less is new", 0.1, 0.04, 400, 304, 0, 6, 200, 300, 300},
        {"overlapping windows that fit", 0.1, 0.05, 400, 301, 300, 5, 200, 300, 300},
        {"windows apart, in the third", 0.05, 0.1, 400, 230, 0, 3, 180, 230, 150},
        {"windows apart, between them", 0.05, 0.1, 400, 195, 0, 2, 100, 150, 100},
        {"poses end first", 0.1, 0.1, 250, 330, 0, 3, 150, 250, 250},
        {"a limit", 0.1, 0.1, 400, 330, 260, 3, 160, 260, 260},
        {"shorter than a window", 0.1, 0.1, 400, 99, 0, 0, 0, 0, 0}}) {
    FusionMapperOptions options = period(c.window_s, c.stride_s);
    options.fill_last_window = true;
    if (c.limit_ms > 0) options.limits.t1_ns = at(c.limit_ms);
    Mapper mapper(options);
    std::vector<KeyframeDepthMap> keyframes;
    const auto take = [&](std::vector<KeyframeDepthMap> more) {
      for (auto& keyframe : more) keyframes.push_back(std::move(keyframe));
    };
    for (int ms = 0; ms < std::max(c.poses_ms + 10, c.events_ms); ++ms) {
      if (ms % 10 == 0 && ms <= c.poses_ms) mapper.addPoses(ms, ms);
      if (ms < c.events_ms) mapper.addSteady(0, ms, ms + 1);
      take(mapper.takeAll());
    }
    take(mapper.end());
    ASSERT_EQ(keyframes.size(), c.keyframes) << c.what;
    EXPECT_EQ(mapper.counts().total()[EventFate::kUsed], c.used) << c.what;
    if (keyframes.empty()) continue;
    const Window last = keyframes.back().window;
    const auto length_ms = static_cast<int>(1e3 * c.window_s);
    EXPECT_EQ(last.t1_ns - last.t0_ns, length_ms * kMs) << c.what;
    EXPECT_EQ(keyframes.back().events[0], static_cast<std::uint64_t>(length_ms)) << c.what;
    // The window ends right after its last event or at a multiple of the stride.
    EXPECT_GT(last.t1_ns, at(c.last_end_ms - 1)) << c.what;
    EXPECT_LE(last.t1_ns, at(c.last_end_ms)) << c.what;
    EXPECT_GT(last.t0_ns, at(c.last_begin_ms - 1)) << c.what;
    EXPECT_LE(last.t0_ns, at(c.last_begin_ms)) << c.what;
  }
}

TEST(FusionMapper, TheLastWindowReachesNotIntoEventsThatWereDropped) {
  for (const auto& [until_ms, keyframes] : {std::pair{150, 1U}, std::pair{190, 0U}}) {
    FusionMapperOptions options = period();
    options.fill_last_window = true;
    Mapper mapper(options);
    mapper.addPoses(0, 400);
    mapper.addSteady(0, 0, 280);
    ASSERT_TRUE(mapper.nextWindow());
    mapper.dropWindowsBefore(at(until_ms), DropReason::kOverload);
    EXPECT_EQ(mapper.end().size(), keyframes) << until_ms;
  }
}

/// Returns all numbers in their order.
std::vector<std::uint64_t> numbersOf(const MapperCounts& counts) {
  std::vector<std::uint64_t> numbers = {counts.cameras.at(0).read};
  const auto& fates = counts.cameras.at(0).fates.counts;
  const auto& dropped = counts.dropped_windows.counts;
  numbers.insert(numbers.end(), fates.begin(), fates.end());
  numbers.insert(numbers.end(),
                 {counts.event_uses, counts.votes.cast, counts.votes.interpolated,
                  counts.votes.outside_view, counts.votes.behind_camera, counts.keyframes,
                  counts.keyframes_without_pose, counts.windows_without_events});
  numbers.insert(numbers.end(), dropped.begin(), dropped.end());
  numbers.insert(numbers.end(),
                 {counts.silent_subintervals, counts.sorted_events, counts.duplicate_poses});
  return numbers;
}

TEST(MapperCounts, AddUpNumberByNumber) {
  const MapperCounts counts{{{1, {2, 3, 4, 5, 6, 7, 8, 9, 10}}},
                            11,
                            {12, 13, 14, 15},
                            16,
                            17,
                            18,
                            {19, 20, 21, 22, 23, 24, 25, 26},
                            27,
                            28,
                            29,
                            {33, 34, 0.5, std::log(2)}};
  MapperCounts sum = counts;
  sum += counts;
  const std::vector<std::uint64_t> numbers = numbersOf(sum);
  ASSERT_EQ(numbers.size(), 29U);
  for (std::size_t i = 0; i < numbers.size(); ++i) EXPECT_EQ(numbers[i], 2 * (i + 1));
  EXPECT_EQ(counts.dropped_windows.total(), 19U + 20 + 21 + 22 + 23 + 24 + 25 + 26);
  sum.cameras.resize(2);
  EXPECT_EQ(sum.motion.known, 66U);
  EXPECT_EQ(sum.motion.corrected, 68U);
  EXPECT_DOUBLE_EQ(sum.motion.blur_px, 1);
  EXPECT_DOUBLE_EQ(sum.motion.log_gain, 2 * std::log(2));
  sum += {{{}, {1, 1, 1, 1, 1, 1, 1, 1, 1, 1}}, 0, {}, 0, 0, 0, {}, 0, 0, 0, {}};
  EXPECT_EQ(sum.total()[EventFate::kOverBudget], 21U);
  EXPECT_EQ(sum.total().read, 3U);
}

}  // namespace
}  // namespace efm::fusion_mapper_test
