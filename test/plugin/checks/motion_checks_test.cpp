// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/checks/health_checks.h"
#include "plugin/recordings/open/recording_formats.h"

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <random>
#include <set>

#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/geometry/trajectory.h"
#include "test/paths.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;

using Names = std::multiset<std::string>;

constexpr std::int64_t kBeginNs = 1'000'000'000'000;
constexpr double kLengthS = 4;
// With the focal length below, 1 cm is two pixels.
constexpr double kDepthM = 1;

Names motionNames(const std::vector<Warning>& warnings) {
  Names names;
  for (const Warning& warning : warnings) names.insert(warning.name);
  return names;
}

std::vector<Warning> warningsOf(const std::vector<StampedPose>& poses,
                                const std::vector<Event>& events, double focal_px, double depth_m) {
  RecordingStatistics statistics;
  RigCamera camera;
  camera.model = {120, 90, focal_px, focal_px, 59.5, 44.5, DistortionModel::kNone, {}};
  statistics.setCameras({{camera}}, {});
  for (const StampedPose& pose : poses) {
    statistics.addPose({{PoseKind::kPose, "pose"}, pose.t_ns, pose.T_world_rig, {}});
  }
  statistics.addEvents({0, CheckedEvents(events)});
  std::vector<Warning> warnings;
  checkMotion({statistics, {}, kMaxTimeNs, depth_m, depth_m}, warnings);
  return warnings;
}

/// A hand-held camera: its poses and its event rate.
struct Hand {
  double rate_hz = 100;
  std::vector<StampedPose> poses;
  std::function<double(double)> events = [](double) { return 5'000.0; };  // events per second at t

  /// @param motion T_world_rig(t).
  explicit Hand(double pose_rate_hz = 100, const std::function<Rigid3(double)>& motion = swing) {
    for (int i = 0; i <= kLengthS * pose_rate_hz; ++i) {
      const double t_s = i / pose_rate_hz;
      poses.push_back({kBeginNs + std::llround(1e9 * t_s), motion(t_s)});
    }
  }

  /// Swings at up to 0.5 m/s and 0.5 rad/s, three times within two seconds.
  static Rigid3 swing(double t_s) {
    const double phase = 2 * kPi * 1.5 * t_s;
    Rigid3 T_world_rig;
    T_world_rig.translation = {0.05 * std::sin(phase), 0.02 * std::cos(phase), 0.1 * t_s};
    T_world_rig.rotation = rotationBy({0.05 * std::cos(phase), 0.05 * std::sin(phase), 0});
    return T_world_rig;
  }
  static Rigid3 straight(double t_s) {
    Rigid3 T_world_rig;
    T_world_rig.translation = {0.5 * t_s, 0, 0};
    return T_world_rig;
  }
  /// Rests between 1 and 3 s.
  static Rigid3 pause(double t_s) { return straight(t_s < 1 ? t_s : std::max(1.0, t_s - 2)); }

  static double secondsOf(const StampedPose& pose) { return secondsBetween(kBeginNs, pose.t_ns); }
  template <typename Change>
  Hand& within(double from_s, double until_s, Change change) {
    for (StampedPose& pose : poses) {
      const double t_s = secondsOf(pose);
      if (t_s >= from_s - 1e-6 && t_s < until_s - 1e-6) change(pose);
    }
    return *this;
  }
  Hand& freeze(double from_s, double until_s, const std::function<Rigid3(double)>& motion = swing) {
    return within(from_s, until_s, [&](auto& pose) { pose.T_world_rig = motion(from_s); });
  }
  Hand& shift(double from_s, double until_s, double x_m) {
    return within(from_s, until_s, [&](auto& pose) { pose.T_world_rig.translation.x() += x_m; });
  }
  Hand& turn(double from_s, double until_s, double y_rad) {
    return within(from_s, until_s, [&](auto& pose) {
      pose.T_world_rig.rotation = rotationBy({0, y_rad, 0}) * pose.T_world_rig.rotation;
    });
  }
  /// Removes the poses between both times.
  Hand& cut(double from_s, double until_s) {
    std::vector<StampedPose> kept;
    for (const StampedPose& pose : poses) {
      const double t_s = secondsOf(pose);
      if (t_s <= from_s + 1e-6 || t_s >= until_s - 1e-6) kept.push_back(pose);
    }
    poses = kept;
    return *this;
  }
  Hand& shake(double sigma_m, double sigma_rad) {
    std::mt19937 random(3);
    const auto noise = [&](double sigma) {  // a sum of uniform numbers is equal on every platform
      double sum = 0;
      for (int i = 0; i < 12; ++i) sum += static_cast<double>(random()) / 4294967296.0;
      return sigma * (sum - 6);
    };
    for (StampedPose& pose : poses) {
      pose.T_world_rig.translation.x() += noise(sigma_m);
      pose.T_world_rig.rotation = rotationBy({0, noise(sigma_rad), 0}) * pose.T_world_rig.rotation;
    }
    return *this;
  }
  Hand& withEvents(double from_s, double until_s, double share) {
    events = [=](double t_s) { return t_s >= from_s && t_s < until_s ? 5'000 * share : 5'000; };
    return *this;
  }

  std::vector<Warning> warnings() const {
    std::vector<Event> all;
    double due = 0;
    for (double t_s = 0; t_s < kLengthS; t_s += 1e-3) {
      for (due += 1e-3 * events(t_s); due >= 1; --due) {
        all.push_back({kBeginNs + std::llround(1e9 * t_s), 5, 5, true});
      }
    }
    return warningsOf(poses, all, 200, kDepthM);
  }
  Names names() const { return motionNames(warnings()); }
};

struct HandRow {
  const char* what;
  Hand hand;
  Names expected;
};

void expectNames(const std::vector<HandRow>& rows) {
  for (const HandRow& row : rows) EXPECT_EQ(row.hand.names(), row.expected) << row.what;
}

Hand straightHand() { return Hand(100, Hand::straight); }
Hand pausing(double share) { return Hand(100, Hand::pause).withEvents(1, 3, share); }

const Names kFrozen = {"poses-frozen"};
const Names kFrozenJump = {"poses-frozen", "pose-jump"};
const Names kJump = {"pose-jump"};
const Names kGap = {"pose-interpolation"};

TEST(MotionChecks, PosesThatRepeatWhileEventsComeAreFrozen) {
  Hand early;  // its tracker begins later, at 0.5 s
  early.freeze(0, 0.5, [](double) { return Hand::swing(0.5); });
  expectNames({
      {"a hand", Hand(), {}},
      {"a hand, a pose every millisecond", Hand(1000), {}},
      {"a jittery tracker", Hand().shake(0.002, 0.003), {}},
      {"0.5 s", straightHand().freeze(1.5, 2, Hand::straight), kFrozenJump},
      {"40 ms: 4 pixels", straightHand().freeze(1.5, 1.55, Hand::straight), kFrozenJump},
      {"10 ms: 1 pixel", straightHand().freeze(1.5, 1.52, Hand::straight), {}},
      {"the second of two, at rest in the first", pausing(0.02).freeze(3.4, 3.5, Hand::pause),
       kFrozenJump},
      {"to the end", Hand().freeze(3, 5), kFrozen},
      {"until the tracker begins", early, kFrozen},
      {"at rest, hardly an event", pausing(0.02), {}},
      {"at rest, without events", pausing(0), {}},
      {"at rest, much noise", pausing(0.45), {}},
      {"at rest by the poses alone", pausing(0.55), kFrozen},
      {"no motion at all", Hand(100, [](double) { return Rigid3(); }), {}},
  });
  Hand steps(100, [](double t_s) { return Hand::straight(0.04 * std::floor(t_s / 0.04 + 1e-6)); });
  EXPECT_THAT(steps.names(), testing::Contains("poses-frozen")) << "each pose four times";
  for (const bool faster_after : {false, true}) {
    const auto motion = [&](double t_s) {
      const double before = faster_after ? 0.25 : 0.5;
      const double after = faster_after ? 0.5 : 0.25;
      return Rigid3{Eigen::Quaterniond::Identity(),
                    {before * std::min(t_s, 2.0) + after * std::max(t_s - 2, 0.0), 0, 0}};
    };
    EXPECT_THAT(Hand(100, motion).freeze(1.5, 2, motion).warnings().at(0).text,
                HasSubstr("the poses repeat for 0.49 s, after 1001.500000000 s (+1.5 s), while "
                          "events come at 100 % of their mean rate: at the speed " +
                          std::string(faster_after ? "after" : "before") +
                          " it the image moves by 49 pixels in this time;"));
  }
}

TEST(MotionChecks, MotionThatIsInterpolatedOverMoreThanATenthOfASecondIsSeen) {
  const auto pan = [](double t_s) {
    Rigid3 T_world_rig;
    T_world_rig.rotation = rotationBy({0, 0.1 * std::sin(2 * kPi * 1.5 * t_s), 0});
    return T_world_rig;
  };
  Hand resting = pausing(0.02);
  Hand bend = straightHand();
  bend.within(2, kLengthS, [](StampedPose& pose) {
    pose.T_world_rig.translation.y() += std::pow(Hand::secondsOf(pose) - 2, 2);
  });
  expectNames({
      {"0.1 s", Hand().cut(1, 1.1), {}},
      {"0.11 s", Hand().cut(1.2, 1.31), kGap},
      {"0.24 s", Hand().cut(1, 1.24), kGap},
      {"over max_pose_gap_s: a warning of its own", Hand().cut(1, 1.26), {}},
      {"the second one, in a bend", bend.cut(1, 1.2).cut(3, 3.2), kGap},
      {"straight motion", straightHand().cut(1, 1.2), {}},
      {"at rest", resting.cut(1.5, 1.7), {}},
      {"rotation alone", Hand(100, pan).cut(1, 1.15), kGap},
      {"ten poses a second, with jitter", Hand(1 / 0.1009), {}},
      {"five poses a second", Hand(5), kGap},
      {"at the beginning, without poses before it", Hand().cut(0, 0.2), kGap},
      {"before the events", Hand().cut(1, 1.2).withEvents(0, 2, 0), {}},
  });
  EXPECT_THAT(Hand().cut(1, 1.2).cut(2, 2.15).warnings().at(0).text,
              AllOf(HasSubstr("poses are 0.2 s apart, 2 times, the worst, after 1001.000000000 s"),
                    HasSubstr("rig.max_pose_gap_s=0.1")));
}

TEST(MotionChecks, AStepThatATrackerOtherwiseDoesNotMakeIsAJump) {
  const double end = 2 * kLengthS;
  expectNames({
      {"12 mm, to stay", Hand().shift(2, end, 0.012), kJump},
      {"12 mm, back", Hand().shift(2, end, -0.012), kJump},
      {"8 mm: under 2 pixels", Hand().shift(2, end, 0.008), {}},
      {"0.012 rad", Hand().turn(2, end, 0.012), kJump},
      {"-0.012 rad", Hand().turn(2, end, -0.012), kJump},
      {"0.008 rad", Hand().turn(2, end, 0.008), {}},
      {"both", Hand().turn(2, end, 0.02).shift(1, end, 0.02), kJump},
      {"one pose alone", Hand().shift(2, 2.01, 0.05), kJump},
      {"near the beginning", Hand().shift(0.1, end, 0.05), kJump},
      {"near the end", Hand().shift(3.9, end, 0.05), kJump},
      {"after 50 ms without poses", Hand().cut(2, 2.05).shift(2.05, end, 0.05), kJump},
      {"of a jittery tracker, as its jitter", Hand().shake(0.003, 0).shift(2, end, 0.02), {}},
      {"of a jittery tracker", Hand().shake(0.003, 0).shift(2, end, 0.3), kJump},
      {"ten a second: a car", Hand(10, Hand::straight).shake(0.005, 0).shift(2, end, 0.5), kJump},
      {"ten a second: as usual", Hand(10, Hand::straight).shake(0.005, 0), {}},
      {"seven of 36 steps: as usual",
       Hand(10, [](double t_s) { return Hand::straight(t_s + std::floor(2 * t_s + 1e-6)); }),
       {}},
      {"before the events", Hand().shift(1, end, 0.05).withEvents(0, 1.5, 0), {}},
  });
  EXPECT_THAT(
      Hand().shift(1, end, 0.03).shift(3, end, -0.06).warnings().at(0).text,
      AllOf(
          HasSubstr("jump by 0.0602 m after 1002.990000000 s (+2.99 s), the largest of 2: 12 pix"),
          HasSubstr("--poses")));
  EXPECT_THAT(straightHand().turn(2, end, -0.02).warnings().at(0).text,
              HasSubstr("jump by 1.15 degrees after 1001.990000000 s (+1.99 s): 4 pixels, at 115 "
                        "degrees/s beside"));
}

/// Returns the warnings for measured poses with a constant event rate.
Names namesOf(const std::vector<StampedPose>& poses, double focal_px, double depth_m) {
  std::vector<Event> events;
  for (std::int64_t t_ns = poses.front().t_ns; t_ns < poses.back().t_ns; t_ns += 5'000'000) {
    events.push_back({t_ns, 5, 5, true});
  }
  return motionNames(warningsOf(poses, events, focal_px, depth_m));
}

TEST(MotionChecks, MeasuredTrajectoriesHaveNoFaultButThoseThatAreMade) {
  const std::filesystem::path folder = EFM_SHARED_DATA "/trajectories";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no trajectories in " << folder;
  struct Measured {
    const char* file;
    double focal_px;
    double depth_m;  // typical depth in this data set
    double jump_m;   // smallest jump found
  };
  for (const Measured& row : {Measured{"rpg_eccv18_desk.txt", 200, 1.5, 0.05},
                              Measured{"tumvie_desk2.txt", 600, 1.5, 0.02},
                              Measured{"mvsec_indoor_flying1.txt", 226, 1.5, 0.5},
                              Measured{"dsec_zurich_city_04.txt", 555, 10, 0.5}}) {
    const std::vector<StampedPose> poses = readPoses(folder / row.file);
    EXPECT_EQ(namesOf(poses, row.focal_px, row.depth_m), Names()) << row.file;
    std::vector<StampedPose> jump = poses;
    for (std::size_t i = poses.size() / 3; i < poses.size(); ++i) {
      jump[i].T_world_rig.translation.z() -= row.jump_m;
    }
    EXPECT_EQ(namesOf(jump, row.focal_px, row.depth_m), kJump) << row.file;
    std::vector<StampedPose> frozen = poses;
    for (std::size_t i = 1; i < frozen.size(); ++i) {
      const double t_s = secondsBetween(poses[0].t_ns, poses[i].t_ns);
      if (t_s > 8 && t_s < 8.5) frozen[i].T_world_rig = frozen[i - 1].T_world_rig;
    }
    const Names names = namesOf(frozen, row.focal_px, row.depth_m);
    EXPECT_EQ(names.count("poses-frozen"), 1U) << row.file;
  }
}

TEST(MotionChecks, LongRecordingsAreSeenWithTheSameMemory) {
  PoseMotion motion;
  const std::int64_t step_ns = 100'000'000;
  for (std::int64_t i = 0; i < 40'000; ++i) {  // more than an hour
    Rigid3 T_world_rig = Hand::straight(0.1 * static_cast<double>(i));
    if (i >= 33'333) T_world_rig.translation.y() += 1;
    motion.add({kBeginNs + i * step_ns, T_world_rig});
  }
  const std::vector<PoseMotion::Bin> bins = motion.completed().bins();
  EXPECT_LE(bins.size(), 1024U);
  const auto largest = std::max_element(bins.begin(), bins.end(), [](auto& a, auto& b) {
    return a.step_m.deviation < b.step_m.deviation;
  });
  EXPECT_EQ(largest->step_m.t0_ns, kBeginNs + 33'332 * step_ns);
  EXPECT_NEAR(largest->step_m.deviation, 10, 0.1);
  EXPECT_NEAR(motion.meanSpeed().m, 0.5, 0.01);
}

}  // namespace
}  // namespace efm
