// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/checks/health_checks.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <random>
#include <set>

#include "mapping/geometry/rigid3.h"
#include "plugin/recordings/calibration/calibration_formats.h"
#include "test/paths.h"
#include "test/plugin/session/synthetic_recording.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

using Names = std::multiset<std::string>;

Names namesOf(const std::vector<Warning>& warnings) {
  Names names;
  for (const Warning& warning : warnings) names.insert(warning.name);
  return names;
}

RecordingStatistics statisticsOf(const SyntheticRecording& recording,
                                 const StatisticsOptions& options = {}) {
  RecordingStatistics statistics(options);
  statistics.setCameras({recording.cameras}, {});
  for (const StampedPose& pose : recording.poses) {
    statistics.addPose({{PoseKind::kPose, "pose"}, pose.t_ns, pose.T_world_rig, {}});
  }
  for (std::size_t c = 0; c < recording.cameras.size(); ++c) {
    statistics.addEvents({static_cast<int>(c), CheckedEvents(recording.events[c])});
  }
  return statistics;
}

std::vector<Warning> warningsOf(const SyntheticRecording& recording,
                                const StatisticsOptions& options = {}) {
  return warningsOf(Findings{statisticsOf(recording, options), {}});
}

/// Rotates pose i by `rate` radians per second.
void rotate(SyntheticRecording& recording, double rate) {
  double angle = 0;
  for (StampedPose& pose : recording.poses) {
    pose.T_world_rig.rotation = rotationBy({0, angle, 0});
    angle += 0.01 * rate;
  }
}

void turnAtRest(SyntheticRecording& recording, double rate) {
  for (StampedPose& pose : recording.poses) pose.T_world_rig.translation.setZero();
  rotate(recording, rate);
}

/// Returns two seconds with about 2,000 events per camera.
SyntheticRecording soundRecording() {
  static const SyntheticRecording recording(2.0);
  return recording;
}

/// Returns each warning as "name: text".
std::vector<std::string> linesOf(const std::vector<Warning>& warnings) {
  std::vector<std::string> lines;
  for (const Warning& warning : warnings) lines.push_back(warning.name + ": " + warning.text);
  return lines;
}

/// Expects one warning that starts with `begin`, or no warning if `begin` is empty.
void expectWarning(const std::vector<Warning>& warnings, const std::string& begin,
                   const std::string& what) {
  if (begin.empty()) {
    EXPECT_THAT(linesOf(warnings), IsEmpty()) << what;
  } else {
    EXPECT_THAT(linesOf(warnings), ElementsAre(StartsWith(begin))) << what;
  }
}

struct Fault {
  const char* what;
  std::function<void(SyntheticRecording&)> make;
  const char* expected;
};

void multiply(SyntheticRecording& recording, double factor) {
  for (StampedPose& pose : recording.poses) pose.T_world_rig.translation *= factor;
}
void delay(SyntheticRecording& recording, std::int64_t delay_ns) {
  for (StampedPose& pose : recording.poses) pose.t_ns += delay_ns;
}

const std::vector<Fault> kFaults = {
    {"poses a second late", [](auto& r) { delay(r, 1'000'000'000); },
     "clock-overlap: the poses cover 50.1 % of the events' time: events from 10.002000000 to "},
    {"a tenth late", [](auto& r) { delay(r, 204'000'000); },
     "clock-overlap: the poses cover 89.9 % of the events' time: "},
    {"not quite a tenth late", [](auto& r) { delay(r, 200'000'000); }, ""},
    {"a tracker that starts late, in a short recording",
     [](auto& r) {
       r = SyntheticRecording(0.5);
       r.poses.erase(r.poses.begin(), r.poses.begin() + 8);
     },
     ""},
    {"4.99 mm in a second", [](auto& r) { multiply(r, 0.00499 / 0.8); },
     "no-motion: the poses move by at most 0.00499 m and 0 degrees within a window: depth needs a "
     "shift of 0.005 m or more for points at 0.5 m;"},
    {"5.01 mm in a second", [](auto& r) { multiply(r, 0.00501 / 0.8); }, ""},
    {"under a degree in a second", [](auto& r) { turnAtRest(r, 0.0174); },
     "no-motion: the poses move by at most 0 m and 0.997 degrees"},
    {"over a degree in a second", [](auto& r) { turnAtRest(r, 0.0176); }, "rotation-only: "},
    {"49.9 m/s", [](auto& r) { multiply(r, 49.9 / 0.8); }, ""},
    {"50.1 m/s", [](auto& r) { multiply(r, 50.1 / 0.8); },
     "speed: the poses move at up to 50.1 m/s"},
    {"19.9 rad/s", [](auto& r) { rotate(r, 19.9); }, ""},
    {"20.1 rad/s", [](auto& r) { rotate(r, 20.1); },
     "rotation-rate: the poses rotate at up to 20.1 rad/s: expected at most 20;"},
    {"no poses", [](auto& r) { r.poses.clear(); }, "no-poses: "},
    {"no events", [](auto& r) { r.events.assign(2, {}); }, "no-events: "},
    {"no calibration", [](auto& r) { r.cameras[1].model.fx = 0; },
     "no-calibration: camera 1 has no calibration"},
};

TEST(HealthChecks, EachFaultHasItsWarningAndNoOther) {
  for (const Fault& fault : kFaults) {
    SyntheticRecording recording = soundRecording();
    ASSERT_GT(recording.events[0].size(), 2000U);
    fault.make(recording);
    expectWarning(warningsOf(recording), fault.expected, fault.what);
  }
}

TEST(HealthChecks, OtherUnitsOfTimeAreGuessed) {
  double factor = 1;
  for (const char* unit : {"ms", "us", "ns"}) {
    factor *= 1000;
    for (const bool of_events : {true, false}) {
      SyntheticRecording recording(0.5);
      const auto change = [&](std::int64_t& t_ns, bool in_unit) {
        t_ns -= 9'990'000'000;  // so no unit exceeds the range of times
        if (in_unit) t_ns = std::llround(factor * static_cast<double>(t_ns));
      };
      for (auto& events : recording.events) {
        for (Event& event : events) change(event.t_ns, of_events);
      }
      for (StampedPose& pose : recording.poses) change(pose.t_ns, !of_events);
      const std::string expected =
          of_events
              ? fmt::format("; they fit if the events' times are in {0}: --time-unit {0} (", unit)
              : fmt::format(
                    "; they fit if the poses' times are in {0}: --pose-time-unit {0}; or the "
                    "events' times are in a larger unit",
                    unit);
      EXPECT_THAT(linesOf(warningsOf(recording)), Contains(HasSubstr(expected)));
    }
  }
}

std::vector<Warning> cameraWarnings(const RecordingStatistics& statistics) {
  std::vector<Warning> warnings;
  checkCameras({statistics, {}}, warnings);
  return warnings;
}

/// Returns the warnings about cameras that have no events.
std::vector<Warning> warningsOf(const std::vector<RigCamera>& cameras) {
  RecordingStatistics statistics;
  statistics.setCameras({cameras}, {});
  return cameraWarnings(statistics);
}

TEST(HealthChecks, CamerasHaveLimits) {
  struct Row {
    std::function<void(RigCamera&)> change;  // change of camera 1 of three
    const char* expected;
  };
  const auto distort = [](RigCamera& camera, DistortionModel model, double k1) {
    camera.model.distortion = model;
    camera.model.coefficients = {k1, 0, 0, 0};
  };
  const Row rows[] = {
      {[](auto&) {}, ""},
      {[](auto& c) {
         c.T_rig_cam.translation = {0, 0.005, 0};
       },
       ""},
      {[](auto& c) {
         c.T_rig_cam.translation = {0, 0, 0.0049};
       },
       "baseline: cameras 0 and 1 are 0.0049 m apart: expected 0.005 to 20 m;"},
      {[](auto& c) {
         c.T_rig_cam.translation = {19.5, 0, 0};
       },
       ""},
      {[](auto& c) {
         c.T_rig_cam.translation = {20.1, 0, 0};
       },
       "baseline: cameras 0 and 1 are 20.1 m apart"},
      {[](auto& c) { c.model.fx = 1370; }, ""},
      {[](auto& c) { c.model.fx = 1380; },
       "focal-length: camera 1: a focal length of 1380 px and 120 columns are a field of view of "
       "4.98 degrees: expected 5 to 170;"},
      {[](auto& c) { c.model.fx = 5.3; }, ""},
      {[](auto& c) { c.model.fx = 5.2; },
       "focal-length: camera 1: a focal length of 5.2 px and 120 columns are "
       "a field of view of 170 degrees"},
      {[&](auto& c) {  // a camera whose corners have rays
         c.model = {120, 40, 40, 40, 59.5, 20, DistortionModel::kNone, {}};
         distort(c, DistortionModel::kEquidistant, 0);
       },
       ""},
      {[](auto& c) { c.model.cx = 30, c.model.cy = 22.5; }, ""},
      {[](auto& c) { c.model.cx = 90, c.model.cy = 67.5; }, ""},
      {[](auto& c) { c.model.cx = 29.9, c.model.cy = 45; },
       "principal-point: camera 1: the principal point (29.9, 45) lies outside "
       "the middle half of the 120x90 pixels"},
      {[](auto& c) { c.model.cx = 90.1, c.model.cy = 45; }, "principal-point: "},
      {[](auto& c) { c.model.cx = 60, c.model.cy = 22.4; }, "principal-point: "},
      {[](auto& c) { c.model.cx = 60, c.model.cy = 67.6; }, "principal-point: "},
      {[&](auto& c) { distort(c, DistortionModel::kRadtan, -1.5); },
       "lens: camera 1: the lens model has no viewing ray for 72 % of the pixels; are the "
       "coefficients in the order of the model 'radtan'?"},
      {[&](auto& c) { distort(c, DistortionModel::kRadtan, -0.3); }, ""},
  };
  for (const Row& row : rows) {
    std::vector<RigCamera> cameras = SyntheticRecording(0.01, 3).cameras;
    cameras[2].T_rig_cam.translation = {10, 0, 0};
    row.change(cameras[1]);
    expectWarning(warningsOf(cameras), row.expected, row.expected);
  }
  std::vector<RigCamera> cameras = SyntheticRecording(0.01, 3).cameras;
  cameras[1].T_rig_cam = cameras[2].T_rig_cam;
  expectWarning(warningsOf(cameras), "baseline: cameras 1 and 2 are 0 m apart", "the last two");
}

TEST(HealthChecks, ActivityOfCamerasIsCompared) {
  struct Row {
    std::vector<std::size_t> events;  // per camera
    std::size_t positive;             // number of positive events of camera 2
    const char* expected;
  };
  const Row rows[] = {
      {{1000, 100, 999}, 1, ""},
      {{1000, 100, 0}, 0, "silent-camera: camera 2 has no event;"},
      {{1000, 99, 500},
       1,
       "few-events: camera 1 has 99 events, another one 1000: is its lens covered"},
      {{999, 5, 999}, 1, ""},
      {{1000, 1000, 999}, 999, ""},
      {{1000, 1000, 1001}, 1001, "polarity: all 1001 events of camera 2 have the polarity 1:"},
      {{1000, 1000, 1001}, 0, "polarity: all 1001 events of camera 2 have the polarity 0:"},
      {{1000, 1000, 1001}, 1000, ""},
      {{0, 0, 0}, 0, ""},
  };
  for (const Row& row : rows) {
    RecordingStatistics statistics;
    statistics.setCameras({SyntheticRecording(0.01, 3).cameras}, {});
    for (std::size_t c = 0; c < 3; ++c) {
      std::vector<Event> events;
      for (std::size_t i = 0; i < row.events[c]; ++i) {
        const bool positive = c == 2 ? i < row.positive : i % 2 == 0;
        const std::size_t pixel = 7 * i + c;  // each camera has other pixels, all over the sensor
        events.push_back({static_cast<std::int64_t>(i), static_cast<std::uint16_t>(pixel % 120),
                          static_cast<std::uint16_t>(pixel / 120 % 90), positive});
      }
      statistics.addEvents({static_cast<int>(c), CheckedEvents(std::move(events))});
    }
    expectWarning(cameraWarnings(statistics), row.expected, row.expected);
  }
}

TEST(RecordingStatistics, CountsByTheTimesOfEventsAndPoses) {
  RecordingStatistics statistics;
  Rig rig{SyntheticRecording(0.01).cameras};
  rig.cameras[1].time_offset_ns = 5;
  statistics.setCameras(rig, {});
  const auto add_events = [&](int c, const std::vector<std::int64_t>& times_ns) {
    std::vector<Event> events;
    for (const std::int64_t t_ns : times_ns) events.push_back({t_ns, 3, 2, t_ns % 20 == 0});
    statistics.addEvents({c, CheckedEvents(std::move(events))});
  };
  const PoseSourceId wheels{PoseKind::kOdometry, "wheels"};
  const PoseSourceId tracker{PoseKind::kPose, "tracker"};
  const auto add_pose = [&](const PoseSourceId& source, std::int64_t t_ns) {
    statistics.addPose({source, t_ns, {}, {}});
  };
  add_events(0, {10, 20, 30});
  add_pose(wheels, 20);
  add_events(1, {12, 100});  // 5 ns later because of the time offset
  EXPECT_EQ(statistics.eventsBeforePoses(), 2U);
  EXPECT_EQ(statistics.eventsAfterPoses(), 2U);
  add_pose(tracker, 60);
  add_pose(tracker, 40);
  EXPECT_EQ(statistics.eventsAfterPoses(), 1U);
  add_events(0, {55, 60, 61});
  EXPECT_EQ(statistics.eventsBeforePoses(), 2U);
  EXPECT_EQ(statistics.eventsAfterPoses(), 2U);
  const StreamStatistics& stream = statistics.cameras().at(0).events;
  EXPECT_EQ(stream.count, 6U);
  EXPECT_EQ(stream.max_gap_ns, 25);
  EXPECT_EQ(stream.max_gap_start_ns, 30);
  EXPECT_NEAR(stream.rate(), 6 / 51e-9, 1);
  EXPECT_EQ(statistics.cameras().at(0).positive, 2U);
  EXPECT_EQ(statistics.cameras().at(0).pixels.at(2 * 120 + 3), 6U);
  EXPECT_EQ(statistics.eventSpan()->first_ns, 10);
  EXPECT_EQ(statistics.eventSpan()->last_ns, 105);
  EXPECT_EQ(statistics.usedPoses()->poses.count, 2U) << "the better kind";
  EXPECT_NEAR(overlapOf(*statistics.eventSpan(), {40, 60}), 20.0 / 95, 1e-9);
}

TEST(RecordingStatistics, SpeedsAreThoseOverTenMilliseconds) {
  PoseStatistics poses;
  const double x_m[] = {0, 0.01, 0.5, 0.02, 0.05, 0.06};
  const std::int64_t t_ms[] = {0, 10, 15, 20, 30, 29};  // 15 is jitter; 29 is too late
  for (int i = 0; i < 6; ++i) {
    Rigid3 T_world_rig{rotationBy({0, 0, 2 * x_m[i]}), {0, x_m[i], 0}};
    poses.add({t_ms[i] * 1'000'000, T_world_rig}, 20'000'000);
  }
  EXPECT_EQ(poses.poses.count, 6U);
  EXPECT_NEAR(poses.path_m, 0.05, 1e-12);
  EXPECT_NEAR(poses.max_speed, 3, 1e-9);
  EXPECT_NEAR(poses.max_rotation_rate, 6, 1e-9);
  EXPECT_NEAR(poses.max_shift_m, 0.5, 1e-12);
  EXPECT_NEAR(poses.max_rotation_rad, 1, 1e-9);
}

TEST(HealthChecks, CountWithTheOptionsOfTheMap) {
  SyntheticRecording recording = soundRecording();
  recording.events[1].clear();
  StatisticsOptions options;
  options.cameras = {0};
  EXPECT_THAT(warningsOf(recording, options), IsEmpty()) << "the silent camera takes no part";

  recording = soundRecording();
  for (StampedPose& pose : recording.poses) pose.t_ns += 1'000'000'000;
  for (RigCamera& camera : recording.cameras) camera.time_offset_ns = 1'000'000'000;
  EXPECT_THAT(warningsOf(recording), IsEmpty()) << "the clocks differ by this";

  const RecordingStatistics statistics = statisticsOf(soundRecording());
  Findings findings{statistics, {}};
  findings.max_pose_gap_s = 0.005;
  EXPECT_EQ(namesOf(warningsOf(findings)), Names{"pose-gap"});
  EXPECT_EQ(namesOf(warningsOf(Findings{statistics, {}, kMaxTimeNs, 100, 200})),
            Names{"no-motion"});

  recording = soundRecording();  // like the poses of a run that was stopped after one second
  recording.poses.resize(recording.poses.size() / 2);
  EXPECT_EQ(namesOf(warningsOf(recording)), Names{"clock-overlap"});
  const RecordingStatistics half = statisticsOf(recording);
  EXPECT_THAT(warningsOf(Findings{half, {}, SyntheticRecording::kStartNs + 1'000'000'000}),
              IsEmpty());
}

TEST(HealthChecks, TheRigsOfDataSetsAreSound) {
  for (const char* file : {"dsec.yaml", "mvsec.yaml", "tumvie_a.yaml", "tumvie_b.yaml"}) {
    const Rig rig = readCamchain(std::string(EFM_SOURCE_DIR "/config/calibration/") + file);
    SyntheticRecording recording = soundRecording();
    recording.cameras = rig.cameras;
    for (std::vector<Event>& events : recording.events) {  // all over the sensor
      for (Event& event : events) {
        event.x = static_cast<std::uint16_t>(event.x * rig.cameras[0].model.width / 120);
        event.y = static_cast<std::uint16_t>(event.y * rig.cameras[0].model.height / 90);
      }
    }
    EXPECT_THAT(namesOf(warningsOf(recording)), IsEmpty()) << file;
  }
}

TEST(HealthChecks, DepthsAtALimitAreSeen) {
  DepthPlanesOptions planes;  // 0.5 to 5 m: inverse depths of 2 to 0.2 per metre
  std::vector<ChosenOption> chosen;
  double voxel_m = 0.01;  // as a pixel at 1 m
  const auto warningsAt = [&](float depth_m, int percent, int depths = 500) {
    cv::Mat_<float> depth(20, 50, 0.0F);
    for (int i = 0; i < depths; ++i) {
      depth(i / 50, i % 50) = i * 100 < percent * depths ? depth_m : 1.0F;
    }
    DepthStatistics statistics(planes, chosen);
    KeyframeDepthMap keyframe;
    keyframe.map.depth = depth;
    keyframe.view.fx = 100;
    statistics.add(keyframe);
    return statistics.warnings(voxel_m);
  };
  EXPECT_THAT(warningsAt(0.508F, 10).at(0).text,
              AllOf(HasSubstr("10 % of the depths lie at the nearest plane"), HasSubstr("0.5 m")));
  EXPECT_THAT(warningsAt(4.4F, 10).at(0).text, HasSubstr("farthest plane, 5 m"));
  EXPECT_THAT(warningsAt(0.508F, 4), IsEmpty());
  EXPECT_THAT(warningsAt(0.52F, 10), IsEmpty());
  EXPECT_THAT(warningsAt(4.0F, 10), IsEmpty());
  EXPECT_THAT(warningsAt(0.508F, 10, 90), IsEmpty());
  EXPECT_THAT(warningsAt(4.4F, 10).at(0).text, HasSubstr("goes on beyond it ([dsi] max_depth_m)"));
  chosen = {{"num_planes", 100, "why not"}, {"max_depth_m", 5, "the scene lies at 1 to 4 m"}};
  EXPECT_THAT(warningsAt(4.4F, 10).at(0).text,
              HasSubstr("5 m: auto chose it, because the scene lies at 1 to 4 m; where the scene "
                        "goes on beyond it, [dsi] max_depth_m sets another one"));
  EXPECT_THAT(warningsAt(0.508F, 10).at(0).text, HasSubstr("beyond it ([dsi] min_depth_m)"));
  planes.num_planes = 40;
  EXPECT_THAT(warningsAt(0.508F, 10), IsEmpty());
  for (const auto& [size_m, warns] : {std::pair(0.00051, false), std::pair(0.00049, true),
                                      std::pair(0.099, false), std::pair(0.101, true)}) {
    voxel_m = size_m;
    const std::vector<Warning> warnings = warningsAt(1, 100);
    ASSERT_EQ(warnings.size(), warns ? 1U : 0U) << size_m;
    if (!warns) continue;
    EXPECT_EQ(warnings[0].name, "voxel-size");
    EXPECT_THAT(warnings[0].text, HasSubstr("--set map.voxel_size_m=0.01 fits the scene"));
  }
}

TEST(HealthChecks, AMistakeOfThePosesExplainsTheirBlur) {
  std::vector<Warning> warnings = {{"sorted-events", ""}, {"poses-blur", ""}};
  dropExplainedBlur(warnings);
  EXPECT_EQ(warnings.size(), 2U);
  warnings.push_back({"scale", ""});
  dropExplainedBlur(warnings);
  ASSERT_EQ(warnings.size(), 2U);
  EXPECT_EQ(warnings[1].name, "scale");
}

TEST(HealthChecks, ASessionSaysWhatItDidNotUse) {
  const SessionStatus sound = [] {
    SessionStatus status;
    status.counts.cameras = {{70, 60, 5, 5, 0, 0}, {30, 0, 15, 15, 0, 0}};
    status.counts.keyframes = 7;
    status.silent_keyframes = {0, 0};
    status.pose_source = PoseSourceId{PoseKind::kPose, "pose"};
    return status;
  }();
  const auto warnings_of = [](const SessionStatus& status, const FusionMapperOptions& options) {
    std::vector<Warning> warnings;
    checkSession({RecordingStatistics(), {}, kMaxTimeNs, 0.5, 5, 0.25, &status, &options},
                 warnings);
    return warnings;
  };
  struct Row {
    std::function<void(SessionStatus&, FusionMapperOptions&)> make;
    const char* expected;
  };
  const auto unused = [](EventFate kind, std::uint64_t events, std::uint64_t drop,
                         const std::function<void(FusionMapperOptions&)>& change = {}) {
    return [=](SessionStatus& status, FusionMapperOptions& options) {
      status.counts.cameras[0][kind] = events;
      status.counts.cameras[1][EventFate::kUnselected] = drop;
      if (change) change(options);
    };
  };
  const auto refined = [](const std::function<void(RefinementState&)>& change) {
    return [change](SessionStatus& status, auto&) {
      status.refinement.emplace().counts.registered = 6;
      change(*status.refinement);
    };
  };
  const auto live = [](const std::function<void(SessionStatus&)>& change) {
    return [change](SessionStatus& status, auto&) {
      status.live.emplace().cameras[1].received = 200;
      change(status);
    };
  };
  const auto blurred = [](std::size_t cameras, std::uint64_t known, double px,
                          std::uint64_t corrected) {
    return [=](SessionStatus& status, auto&) {
      status.rig.cameras.resize(cameras);
      const auto count = static_cast<double>(known);
      status.counts.motion = {known, corrected, px * count,
                              std::log(2) * static_cast<double>(corrected)};
    };
  };
  const Row rows[] = {
      {[](auto&, auto&) {}, ""},
      {unused(EventFate::kWithoutPose, 35, 0), ""},
      {unused(EventFate::kWithoutPose, 36, 0),
       "events-without-pose: 51 of 100 events have no pose"},
      {unused(EventFate::kWithoutPose, 26, 20),
       "events-without-pose: 41 of 80 events have no pose"},
      {unused(EventFate::kOutsideWindow, 35, 0), ""},
      {unused(EventFate::kOutsideWindow, 36, 0),
       "events-outside-windows: 51 of 100 events lie in no window that was mapped"},
      {unused(EventFate::kOutsideWindow, 36, 0, [](auto& o) { o.limits.t0_ns = 5; }), ""},
      {unused(EventFate::kOutsideWindow, 36, 0, [](auto& o) { o.limits.t1_ns = 5; }), ""},
      {unused(EventFate::kOutsideWindow, 36, 0, [](auto& o) { o.only_window = Window{}; }), ""},
      {unused(EventFate::kOutsideWindow, 36, 0, [](auto& o) { o.policy.stride_s = 9; }), ""},
      {unused(EventFate::kOutsideWindow, 36, 0,
              [](auto& o) {
                o.policy.stride_s = 9;
                o.policy.policy = KeyframePolicyKind::kEvents;
              }),
       "events-outside-windows: 51 of 100"},
      {[](auto& s, auto& o) {
         s.silent_keyframes[1] = 2;
         o.keyframe.exclude_silent = true;
       },
       "silent-keyframes: camera 1 had no event in 2 of 7 keyframes: the others were fused "
       "without"},
      {[](auto& s, auto&) {
         s.other_poses[{PoseKind::kOdometry, "wheels"}] = 5;
       },
       "unused-poses: 5 poses were not used: odometry 'wheels', beside poses 'pose' ("},
      {refined([](auto&) {}), ""},
      {refined([](auto& r) { r.counts.registered = 4; }),
       "unregistered-keyframes: 2 of 7 keyframes found no place"},
      {refined([](auto& r) {
         r.failures = 2;
         r.last_error = "why";
       }),
       "refinement-failures: the refinement failed 2 times, the last time with: why;"},
      {refined([](auto& r) { r.counts.failed_solves = 3; }), "failed-solves: 3 failed solves of"},
      {blurred(2, 5, 0.5, 0), ""},
      {blurred(2, 4, 1.5, 2), ""},
      {blurred(2, 4, 0.5, 4), ""},
      {blurred(2, 4, 1.5, 3),
       "poses-blur: the poses blur the events by 1.5 pixels within a window, and the motion of 3 "
       "of "
       "7 keyframes was corrected ([refinement] correct_motion): they are 2.00 times as sharp; "
       "their own poses have such errors, too: --set refinement.enabled=true corrects them"},
      {blurred(1, 3, 0.5, 0), ""},
      {blurred(1, 1, 1.2, 0), ""},
      {blurred(1, 3, 1.2, 0),
       "poses-blur: the poses blur the events by 1.2 pixels within a window: with one camera this "
       "cannot be corrected, because wrong depths explain a wrong motion"},
      {[](auto& s, auto&) {
         s.scene_unknown = true;
         s.events = s.poses = TimeSpan{0, 1};
       },
       "no-scene: "},
      {[](auto& s, auto&) { s.scene_unknown = true; }, ""},  // there is no input
      {live([](auto&) {}), ""},
      {live([](auto& s) {
         QueueCounts& camera = s.live->cameras[1];
         camera.held = 40;  // like queued and paused events, held events are not lost
         camera.queued = 20;
         camera.lost = 10;
         camera.fates[QueueFate::kPaused] = 80;
         camera.fates[QueueFate::kRejected] = 1;
         camera.fates[QueueFate::kAfterEnd] = 2;
         s.counts.dropped_windows[DropReason::kJump] = 3;
       }),
       "events-lost: 6.5 % of the events were lost; 3 windows dropped: 3 "},
      {live([](auto& s) { s.live->cameras[1].fates[QueueFate::kSubsampled] = 1; }),
       "events-lost: 0.5 % of the events were lost; 0 windows dropped; 1 events were more than "
       "[live] max_event_rate lets pass"},
      {live([](auto& s) {
         s.live->cameras[1].fates[QueueFate::kSubsampled] = 1;
         s.live->too_large = "a window needs 5 events";
       }),
       "events-lost: 0.5 % of the events were lost; 0 windows dropped; 1 events were more than "
       "[live] max_event_rate lets pass; a window needs 5 events"},
      {live([](auto& s) { s.live->cameras[1].fates[QueueFate::kQueueFull] = 3; }),
       "events-lost: 1.5 % of the events were lost; 0 windows dropped; the machine is too slow"},
      {live([](auto& s) {
         s.counts.dropped_windows[DropReason::kOverload] = 2;
         s.counts.dropped_windows[DropReason::kError] = 1;
       }),
       "events-lost: 0 % of the events were lost; 3 windows dropped: "},
      {live([](auto& s) {
         s.live->cameras[1].fates[QueueFate::kRejected] = 1;
         s.live->rejected_poses = 2;
       }),
       "events-lost: 0.5 % of the events were lost; 0 windows dropped; 1 events and 2 poses were "
       "late, or had wrong times or places"},
      {live([](auto& s) {
         s.live->errors = 2;
         s.live->last_error = "why";
       }),
       "mapping-errors: 2 errors while mapping, the last one: why"},
  };
  for (const Row& row : rows) {
    SessionStatus status = sound;
    FusionMapperOptions options;
    row.make(status, options);
    expectWarning(warnings_of(status, options), row.expected, row.expected);
  }
  SessionStatus none = sound;  // if there is no keyframe, the error says why
  none.counts.keyframes = 0;
  none.counts.cameras[0][EventFate::kWithoutPose] = none.counts.windows_without_events = 60;
  none.counts.keyframes_without_pose = 1;
  EXPECT_THAT(linesOf(warnings_of(none, {})), IsEmpty());
}

TEST(SessionStatus, IsSaidInWords) {
  SessionStatus status;
  DroppedWindows& windows = status.counts.dropped_windows;
  EXPECT_EQ(asText(windows), "0 windows dropped");
  windows[DropReason::kOverload] = 2;
  windows[DropReason::kNoPose] = 1;
  EXPECT_EQ(asText(windows), "3 windows dropped: 2 for overload, 1 without poses");
  status.chosen = {{"window_s", 0.5, "why"}, {"num_planes", 60, "so"}};
  EXPECT_EQ(choiceText(status),
            "options chosen from the data: window_s = 0.5 (why); num_planes = 60 (so)");
}

TEST(PoseWarning, SaysWhatMendsTheMistake) {
  using Mistake = PoseMistake;
  Rig rig;
  rig.cameras.resize(2);
  rig.cameras[1].time_offset_ns = 2'000'000;
  PoseFinding finding;
  const auto text = [&](Mistake mistake, double shift_s = 0) {
    finding.mistake = mistake;
    finding.shift_s = shift_s;
    return linesOf({poseWarning(finding, rig)}).at(0);
  };
  EXPECT_THAT(text(Mistake::kUnknown), StartsWith("poses-unexplained: the poses do not explain"));
  EXPECT_THAT(text(Mistake::kTimeShift, -0.0125),
              HasSubstr("with the poses 0.013 s later; --set rig.time_offsets_s=-0.013,-0.011"));
  EXPECT_THAT(text(Mistake::kTimeShift, 0.25),
              HasSubstr("with the poses 0.250 s earlier; --set rig.time_offsets_s=0.250,0.252 "));
}

TEST(PoseWarning, SaysHowDepthsDiffer) {
  const auto text = [](double scale, double agreeing) {
    const auto warning = agreementWarning({scale, agreeing});
    return warning ? warning->name + ": " + warning->text : "";
  };
  for (const double scale : {0.85, 1.0, 1.17}) EXPECT_EQ(text(scale, 0.46), "") << scale;
  EXPECT_THAT(text(1.19, 0.46), StartsWith("scale: the depths from the motion are 1.19 times"));
  EXPECT_THAT(text(0.84, 0.46), StartsWith("scale: the depths from the motion are 0.84 times"));
  EXPECT_THAT(text(2, 0.44), AllOf(StartsWith("depths-disagree: "), HasSubstr("in 44 % of the")));
}

TEST(PoseWarning, SaysTwoMistakesOfOneNameApart) {
  PoseFinding finding;
  finding.mistake = PoseMistake::kCamerasSwapped;
  finding.alternatives = {PoseMistake::kCamerasSwapped, PoseMistake::kStereoInverted};
  EXPECT_THAT(poseWarning(finding, Rig{}).text,
              AllOf(HasSubstr("with the events of cameras 0 and 1 exchanged"),
                    HasSubstr("; or the transform between cameras 0 and 1 is inverted, which")));
  finding.mistake = PoseMistake::kUnknown;
  finding.alternatives.push_back(PoseMistake::kAxes);
  EXPECT_EQ(poseWarning(finding, Rig{}).name, "poses-unexplained");
  EXPECT_THAT(poseWarning(finding, Rig{}).text, HasSubstr("(cameras-swapped, axis-convention)"));
}

}  // namespace
}  // namespace efm
