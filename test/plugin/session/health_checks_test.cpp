// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/health_checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <random>
#include <set>
#include <string>
#include <utility>

#include "mapping/geometry/angle.h"
#include "plugin/calibration/camchain.h"
#include "plugin/session/pose_warning.h"
#include "plugin/session/session_warnings.h"
#include "test/paths.h"
#include "test/plugin/session/synthetic_recording.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

using Names = std::multiset<std::string>;

Names namesOf(const std::vector<Warning>& warnings) {
  Names names;
  for (const Warning& warning : warnings) names.insert(warning.name);
  return names;
}

RecordingStatistics statisticsOf(const SyntheticRecording& recording,
                                 const StatisticsOptions& options = {}) {
  RecordingStatistics statistics(options);
  for (const StampedPose& pose : recording.poses) {
    statistics.addPose({PoseKind::kPose, "pose"}, pose.t_ns, pose.T_world_rig, {});
  }
  for (std::size_t c = 0; c < recording.cameras.size(); ++c) {
    statistics.addEvents(static_cast<int>(c), "cam", recording.cameras[c], recording.events[c]);
  }
  return statistics;
}

std::vector<Warning> warningsOf(const SyntheticRecording& recording,
                                const StatisticsOptions& options = {}) {
  const RecordingStatistics statistics = statisticsOf(recording, options);
  std::vector<Warning> warnings = missingParts(statistics);
  for (const Warning& warning : healthWarnings(statistics, {})) warnings.push_back(warning);
  return warnings;
}

/// Turns pose i by `rate` radians per second.
void rotate(SyntheticRecording& recording, double rate) {
  double angle = 0;
  for (StampedPose& pose : recording.poses) {
    pose.T_world_rig.rotation = rotationBy({0, angle, 0});
    angle += 0.01 * rate;
  }
}

void keepStill(SyntheticRecording& recording) {
  for (StampedPose& pose : recording.poses) pose.T_world_rig.translation.setZero();
}

/// Two seconds; some 2,000 events of each camera.
SyntheticRecording soundRecording() {
  static const SyntheticRecording recording(2.0);
  return recording;
}

struct Fault {
  const char* what;
  std::function<void(SyntheticRecording&)> make;
  Names expected;
};

const std::vector<Fault> kFaults = {
    {"none", [](auto&) {}, {}},
    {"a baseline of 90 m",
     [](auto& r) {
       r.cameras[1].T_rig_cam.translation = {90, 0, 0};
     },
     {"baseline"}},
    {"a baseline of 0.1 mm",
     [](auto& r) {
       r.cameras[1].T_rig_cam.translation = {1e-4, 0, 0};
     },
     {"baseline"}},
    {"a telescope", [](auto& r) { r.cameras[0].model.fx = 3000; }, {"focal-length"}},
    {"a focal length of 2 px", [](auto& r) { r.cameras[1].model.fx = 2; }, {"focal-length"}},
    {"a fisheye lens of 150 degrees",
     [](auto& r) {
       r.cameras[0].model.distortion = DistortionModel::kEquidistant;
       r.cameras[0].model.coefficients = {0, 0, 0, 0};
       r.cameras[0].model.fx = r.cameras[0].model.fy = 48;
     },
     {}},
    {"fx and cx swapped",
     [](auto& r) { std::swap(r.cameras[0].model.fx, r.cameras[0].model.cx); },
     {"principal-point"}},
    {"cy of another resolution", [](auto& r) { r.cameras[0].model.cy = 400; }, {"principal-point"}},
    {"coefficients that fold the image over",
     [](auto& r) {
       r.cameras[0].model.distortion = DistortionModel::kRadtan;
       r.cameras[0].model.coefficients = {-1.5, 0, 0, 0};
     },
     {"lens"}},
    {"poses a second late",
     [](auto& r) {
       for (StampedPose& pose : r.poses) pose.t_ns += 1'000'000'000;
     },
     {"clock-overlap"}},
    {"a tracker that starts late, in a short recording",
     [](auto& r) {
       r = SyntheticRecording(0.5);
       r.poses.erase(r.poses.begin(), r.poses.begin() + 8);
     },
     {}},
    {"poses of another clock",
     [](auto& r) {
       for (StampedPose& pose : r.poses) pose.t_ns += 1'700'000'000'000'000'000;
     },
     {"clock-overlap"}},
    {"a lost tracker",
     [](auto& r) { r.poses.erase(r.poses.begin() + 50, r.poses.begin() + 90); },
     {"pose-gap"}},
    {"no motion", keepStill, {"no-motion"}},
    {"rotation alone",
     [](auto& r) {
       keepStill(r);
       rotate(r, 0.5);
     },
     {"rotation-only"}},
    {"positions in millimetres",
     [](auto& r) {
       for (StampedPose& pose : r.poses) pose.T_world_rig.translation *= 1000;
     },
     {"speed"}},
    {"a rotation of 30 rad/s", [](auto& r) { rotate(r, 30); }, {"rotation-rate"}},
    {"a silent camera", [](auto& r) { r.events[1].clear(); }, {"silent-camera"}},
    {"a covered lens", [](auto& r) { r.events[1].resize(100); }, {"few-events"}},
    {"one polarity",
     [](auto& r) {
       for (Event& event : r.events[0]) event.polarity = true;
     },
     {"polarity"}},
    {"no polarity",
     [](auto& r) {
       for (Event& event : r.events[1]) event.polarity = false;
     },
     {"polarity"}},
    {"one column of hot pixels",
     [](auto& r) {
       for (Event& event : r.events[0]) event.x = 7;
     },
     {"hot-pixels"}},
    {"a camera with a clock 2 s ahead, and poses of both times",
     [](auto& r) {
       for (Event& event : r.events[1]) event.t_ns += 2'000'000'000;
       const std::vector<StampedPose> poses = r.poses;
       for (StampedPose pose : poses) {
         pose.t_ns += 2'000'000'000;
         pose.T_world_rig.translation += poses.back().T_world_rig.translation;
         r.poses.push_back(pose);
       }
     },
     {"camera-clocks"}},
    {"one file of events twice", [](auto& r) { r.events[1] = r.events[0]; }, {"same-events"}},
    {"no poses", [](auto& r) { r.poses.clear(); }, {"no-poses"}},
    {"no events", [](auto& r) { r.events.assign(2, {}); }, {"no-events"}},
    {"no calibration", [](auto& r) { r.cameras[1].model.fx = 0; }, {"no-calibration"}},
};

TEST(HealthChecks, EachFaultHasItsWarningAndNoOther) {
  for (const Fault& fault : kFaults) {
    SyntheticRecording recording = soundRecording();
    ASSERT_GT(recording.events[0].size(), 2000U);
    fault.make(recording);
    EXPECT_EQ(namesOf(warningsOf(recording)), fault.expected) << fault.what;
  }
}

TEST(HealthChecks, CountWithTheOptionsOfTheMap) {
  SyntheticRecording recording = soundRecording();
  recording.events[1].clear();
  StatisticsOptions options;
  options.cameras = {0};
  EXPECT_THAT(warningsOf(recording, options), IsEmpty()) << "the silent camera takes no part";

  recording = soundRecording();
  for (StampedPose& pose : recording.poses) pose.t_ns += 1'000'000'000;
  options = {};
  options.limits.t0_ns = SyntheticRecording::kStartNs + 1'000'000'000;
  EXPECT_THAT(warningsOf(recording, options), IsEmpty()) << "earlier events do not count";
  options = {};
  options.time_offsets_ns = {1'000'000'000, 1'000'000'000};
  EXPECT_THAT(warningsOf(recording, options), IsEmpty()) << "the clocks differ by this";

  recording = soundRecording();
  keepStill(recording);
  rotate(recording, 0.5);
  options = {};
  options.T_body_rig = Rigid3{Eigen::Quaterniond::Identity(), {0, 0, 1}};
  EXPECT_THAT(warningsOf(recording, options), IsEmpty()) << "an arm of a metre turns";

  const RecordingStatistics statistics = statisticsOf(soundRecording());
  EXPECT_EQ(namesOf(healthWarnings(statistics, {100, 200, 0.25})), Names{"no-motion"});
  EXPECT_EQ(namesOf(healthWarnings(statistics, {0.5, 5, 0.005})), Names{"pose-gap"});
}

TEST(HealthChecks, SaysTheValuesAndTheOption) {
  SyntheticRecording recording = soundRecording();
  for (StampedPose& pose : recording.poses) pose.t_ns += 1'000'000'000;
  EXPECT_THAT(warningsOf(recording).at(0).text,
              AllOf(HasSubstr("the poses cover 50.1 % of the events' time"),
                    HasSubstr("poses from 11.000000000 to 13.000000000 s"), HasSubstr("--poses")));
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

/// A camera of 120x90 pixels, and events in a rectangle of them.
struct Sensor {
  std::vector<std::uint16_t> counts = std::vector<std::uint16_t>(120 * 90, 0);

  /// @param columns, rows: the first and the one after the last.
  Sensor& fill(std::pair<int, int> columns, std::pair<int, int> rows, double share = 0.5,
               std::uint16_t events = 3) {
    std::mt19937 random(1);
    for (int y = rows.first; y < rows.second; ++y) {
      for (int x = columns.first; x < columns.second; ++x) {
        if (static_cast<double>(random()) / 4294967296.0 >= share) continue;
        counts[static_cast<std::size_t>(120 * y + x)] = events;
      }
    }
    return *this;
  }
  std::vector<Warning> warnings() const {
    std::vector<Event> events;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const Event event{1000, static_cast<std::uint16_t>(i % 120),
                        static_cast<std::uint16_t>(i / 120), i % 2 == 0};
      events.insert(events.end(), counts[i], event);
    }
    RecordingStatistics statistics;
    statistics.addEvents(0, "cam", SyntheticRecording(0.01).cameras[0], events);
    return healthWarnings(statistics, {});
  }
};

TEST(HealthChecks, EventsThatOccupyAPartOfTheSensorAreSeen) {
  const std::pair<int, int> all_columns = {0, 120}, all_rows = {0, 90};
  struct Row {
    const char* what;
    Sensor sensor;
    const char* area;  // in the warning; empty: none
  };
  Sensor fading;  // a scene that ends within the motion of its image
  for (int x = 0; x < 120; ++x) fading.fill({x, x + 1}, all_rows, std::min(1.0, 0.02 * x));
  const std::vector<Row> rows = {
      {"all", Sensor().fill(all_columns, all_rows), ""},
      {"cropped at the right", Sensor().fill({0, 80}, all_rows), "columns 0 to 79 of 0 to 119"},
      {"cropped at the left", Sensor().fill({40, 120}, all_rows), "columns 40 to 119 of 0"},
      {"at both sides", Sensor().fill({20, 100}, all_rows), "columns 20 to 99 of 0 to 119"},
      {"below", Sensor().fill(all_columns, {0, 70}), "rows 0 to 69 of 0 to 89"},
      {"above", Sensor().fill(all_columns, {20, 90}), "rows 20 to 89 of 0 to 89"},
      {"by 9 columns", Sensor().fill({0, 111}, all_rows), "columns 0 to 110 of"},
      {"by 8 columns", Sensor().fill({0, 112}, all_rows), ""},
      {"binned", Sensor().fill({0, 60}, {0, 45}), "columns 0 to 59 of 0 to 119 and rows 0 to 44 "},
      {"binned, with stray events",
       Sensor().fill(all_columns, all_rows, 0.003).fill({0, 60}, {0, 45}),
       "columns 0 to 59 of 0 to 119 and rows 0 to 44 "},
      {"with noise on the other side",
       Sensor().fill(all_columns, all_rows, 0.02).fill({0, 60}, all_rows), ""},
      {"with hot pixels on the other side",
       Sensor().fill({100, 101}, {10, 12}, 1, 60'000).fill({0, 60}, all_rows),
       "columns 0 to 59 of"},
      {"hot pixels have most events",
       Sensor().fill(all_columns, all_rows).fill({100, 102}, {10, 20}, 1, 60'000), ""},
      {"short: edges of the scene alone", Sensor().fill({0, 80}, all_rows, 0.18), ""},
      {"a little longer", Sensor().fill({0, 80}, all_rows, 0.25), "columns 0 to 79 of"},
      {"a few events", Sensor().fill({0, 30}, {0, 30}, 0.9), ""},
      {"fading", fading, ""},
  };
  for (const Row& row : rows) {
    std::string text;
    for (const Warning& warning : row.sensor.warnings()) {
      if (warning.name == "sensor-area") text = warning.text;
    }
    EXPECT_THAT(text, HasSubstr(row.area)) << row.what;
    EXPECT_EQ(text.empty(), std::string(row.area).empty()) << row.what << ": " << text;
  }
}

TEST(HealthChecks, DepthsAtALimitAreSeen) {
  DepthPlanesOptions planes;  // 0.5 to 5 m: 2 and 0.2 in inverse depth
  std::vector<ChosenOption> chosen;
  const auto warningsAt = [&](float depth_m, int percent, int depths = 500) {
    cv::Mat_<float> depth(20, 50, 0.0F);
    for (int i = 0; i < depths; ++i) {
      depth(i / 50, i % 50) = i * 100 < percent * depths ? depth_m : 1.0F;
    }
    DepthStatistics statistics(planes, chosen);
    statistics.add(depth);
    return statistics.warnings();
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
}

TEST(HealthChecks, ASessionSaysWhatItDidNotUse) {
  FusionMapperOptions options;
  SessionStatus sound;
  sound.counts.cameras = {{100, 60, 20, 20, 0, 0}};
  sound.counts.keyframes = 3;
  sound.silent_keyframes = {0};
  sound.pose_source = PoseSourceId{PoseKind::kPose, "pose"};
  EXPECT_THAT(sessionWarnings(sound, options), IsEmpty());

  struct Row {
    const char* expected;
    std::function<void(SessionStatus&)> make;
  };
  const auto refined = [](const std::function<void(RefinementState&)>& change) {
    return [change](SessionStatus& status) {
      status.refinement.emplace().counts.registered = 2;
      change(*status.refinement);
    };
  };
  const std::vector<Row> rows = {
      {"sorted-events", [](auto& s) { s.counts.sorted_events = 1; }},
      {"outside-lens", [](auto& s) { s.counts.cameras[0].outside_lens = 1; }},
      {"events-without-pose", [](auto& s) { s.counts.cameras[0].without_pose = 60; }},
      {"events-outside-windows", [](auto& s) { s.counts.cameras[0].outside_window = 60; }},
      {"silent-keyframes", [](auto& s) { s.silent_keyframes[0] = 1; }},
      {"silent-subintervals", [](auto& s) { s.counts.silent_subintervals = 1; }},
      {"unused-poses",
       [](auto& s) {
         s.other_poses[{PoseKind::kOdometry, "wheels"}] = 5;
       }},
      {"duplicate-poses", [](auto& s) { s.counts.duplicate_poses = 1; }},
      {"unregistered-keyframes", [](auto& s) { s.refinement.emplace(); }},
      {"refinement-failures", refined([](auto& r) { r.failures = 1; })},
      {"failed-solves", refined([](auto& r) { r.counts.failed_solves = 1; })},
      {"windows-without-pose", [](auto& s) { s.counts.keyframes_without_pose = 1; }},
      {"windows-without-events", [](auto& s) { s.counts.windows_without_events = 1; }},
  };
  for (const Row& row : rows) {
    SessionStatus status = sound;
    row.make(status);
    EXPECT_EQ(namesOf(sessionWarnings(status, options)), Names{row.expected});
  }
  sound.counts.cameras[0].outside_window = 60;
  options.limits.t0_ns = 5;
  EXPECT_THAT(sessionWarnings(sound, options), IsEmpty()) << "they were left out by a limit";
}

TEST(PoseWarning, SaysTwoMistakesOfOneNameApart) {
  PoseFinding finding;
  finding.mistake = PoseMistake::kCamerasSwapped;
  finding.alternatives = {PoseMistake::kStereoInverted, PoseMistake::kInverted};
  EXPECT_THAT(poseWarning(finding, Rig{}).text,
              AllOf(HasSubstr("with the events of cameras 0 and 1 exchanged"),
                    HasSubstr("; or the transform between cameras 0 and 1 is inverted, which"),
                    HasSubstr("; or it is poses-inverted, which")));
}

}  // namespace
}  // namespace efm
