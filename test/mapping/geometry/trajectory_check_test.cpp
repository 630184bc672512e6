// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/trajectory_check.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

/// A hand-held body: some 1 m/s and 2 rad/s.
StampedPose handHeld(double t_s, const Eigen::Vector3d& start_m = Eigen::Vector3d::Zero()) {
  const Eigen::Vector3d rotation(0.2 * std::sin(9 * t_s), 0.3 * std::sin(5 * t_s), 0.4 * t_s);
  const Eigen::Vector3d position(0.1 * std::sin(8 * t_s), 0.05 * std::cos(11 * t_s), 0.3 * t_s);
  return {durationFromSeconds(t_s), {rotationBy(rotation), start_m + position}};
}

/// Poses of one body, at a rate, for 10 s.
std::vector<StampedPose> posesAt(double rate_hz, double first_s = 0,
                                 const Eigen::Vector3d& start_m = Eigen::Vector3d::Zero()) {
  std::vector<StampedPose> poses;
  for (double t_s = first_s; t_s < 10; t_s += 1 / rate_hz) poses.push_back(handHeld(t_s, start_m));
  return poses;
}

std::vector<StampedPose> joined(std::vector<StampedPose> a, const std::vector<StampedPose>& b) {
  a.insert(a.end(), b.begin(), b.end());
  std::stable_sort(a.begin(), a.end(),
                   [](const auto& x, const auto& y) { return x.t_ns < y.t_ns; });
  return a;
}

std::optional<TrajectoryConflict> conflictOf(const std::vector<StampedPose>& poses) {
  TrajectoryCheck check;
  for (const StampedPose& pose : poses) check.add(pose);
  return check.conflict();
}

TEST(TrajectoryCheck, FindsASecondBodyOfAnyRate) {
  for (const double rate_hz : {10.0, 30.0, 200.0, 1000.0}) {
    for (const double part : {1.0, 0.5, 0.1, 0.04}) {            // of the rate
      for (const double first_s : {0.0, 3e-5, 0.4 / rate_hz}) {  // after the first body
        for (const double apart_m : {0.2, 1.0, 20.0}) {
          // Between two poses of a body it moves by up to a quarter of the distance.
          if (rate_hz * part < 5 || apart_m < 9 / (rate_hz * part)) continue;
          // Between two bodies at these times there may be a motion.
          if (2 * apart_m < 600 * first_s * first_s) continue;
          const auto second = posesAt(rate_hz * part, first_s, {0, 0, apart_m});
          EXPECT_TRUE(conflictOf(joined(posesAt(rate_hz), second)))
              << rate_hz << " Hz, " << part << ", " << first_s << " s, " << apart_m << " m";
        }
      }
    }
  }
  std::vector<StampedPose> many;
  for (int body = 0; body < 8; ++body) {
    many = joined(many, posesAt(20, body * 0.006, {0, 1.0 * body, 0}));
    if (body > 0) {
      EXPECT_TRUE(conflictOf(many)) << body + 1 << " bodies";
    }
  }
  std::vector<StampedPose> turned = posesAt(100, 0.004);
  for (StampedPose& pose : turned) {
    pose.T_world_rig.rotation = pose.T_world_rig.rotation * rotationBy({0, 0.5, 0});
  }
  const auto conflict = conflictOf(joined(posesAt(100), turned));
  ASSERT_TRUE(conflict) << "one body in two frames";
  EXPECT_FALSE(conflict->equal_times);
  EXPECT_NEAR(conflict->angle_rad, 0.5, 0.05);
}

TEST(TrajectoryCheck, TakesTheFaultsOfATrackerForOneBody) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto some = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  for (const double rate_hz : {10.0, 30.0, 200.0, 1000.0}) {
    const struct {
      std::string name;
      std::function<void(std::size_t i, StampedPose& pose)> change;
    } faults[] = {
        {"none", [](std::size_t, StampedPose&) {}},
        {"noise of 3 cm",
         [&](std::size_t, StampedPose& pose) {
           pose.T_world_rig.translation += 0.03 * some();
           pose.T_world_rig.rotation = pose.T_world_rig.rotation * rotationBy(0.02 * some());
         }},
        {"whole centimetres",
         [](std::size_t, StampedPose& pose) {
           pose.T_world_rig.translation =
               (100 * pose.T_world_rig.translation).array().round() / 100;
         }},
        {"single outliers at 10 %",
         [&](std::size_t i, StampedPose& pose) {
           if (i % 10 == 5) pose.T_world_rig.translation += some();
         }},
        {"single identities at 10 %",
         [](std::size_t i, StampedPose& pose) {
           if (i % 10 == 5) pose.T_world_rig = {};
         }},
        {"single places of a lost tracker at 10 %",
         [](std::size_t i, StampedPose& pose) {
           if (i % 10 < 1) pose.T_world_rig = {{0.8, 0.6, 0, 0}, {1, 2, 3}};
         }},
        {"noise of 10 cm without rotation",
         [&](std::size_t, StampedPose& pose) {
           pose.T_world_rig = {{1, 0, 0, 0}, {0.1 * some()}};
         }},
        {"noise of 0.6 degrees of a rig at rest",
         [&](std::size_t, StampedPose& pose) {
           pose.T_world_rig = {rotationBy(0.01 * some()), 0.001 * some()};
         }},
        {"outliers in bursts of ten",
         [&](std::size_t i, StampedPose& pose) {
           if (i % 100 < 10) pose.T_world_rig.translation += some();
         }},
        {"lost now and then, at the origin",
         [](std::size_t i, StampedPose& pose) {
           if (i % 300 < 20) pose.T_world_rig = {};
         }},
        {"a jump each second",
         [](std::size_t, StampedPose& pose) {
           pose.T_world_rig.translation.x() += static_cast<double>(pose.t_ns / 1'000'000'000 % 2);
         }},
        {"shaken at 8 Hz",
         [](std::size_t, StampedPose& pose) {
           const double t_s = 1e-9 * static_cast<double>(pose.t_ns);
           pose.T_world_rig.translation.y() += 0.05 * std::sin(50 * t_s);
         }},
        {"shaken at 15 Hz, well sampled",
         [&](std::size_t, StampedPose& pose) {
           const double phase = 94e-9 * static_cast<double>(pose.t_ns);
           if (rate_hz < 60) return;
           pose.T_world_rig.translation.y() += 0.01 * std::sin(phase);
           pose.T_world_rig.rotation =
               pose.T_world_rig.rotation * rotationBy({0, 0, 0.05 * std::sin(phase)});
         }},
        {"times that repeat",
         [&](std::size_t i, StampedPose& pose) {
           if (i % 250 == 1) pose.t_ns -= std::int64_t(1e9 / rate_hz);
         }},
    };
    for (const auto& fault : faults) {
      std::vector<StampedPose> poses = posesAt(rate_hz);
      for (std::size_t i = 0; i < poses.size(); ++i) fault.change(i, poses[i]);
      EXPECT_FALSE(conflictOf(poses)) << fault.name << ", " << rate_hz << " Hz";
    }
  }
}

TEST(TrajectoryCheck, PosesOfOneTimeMayDifferAtOnePercentOfTheTimes) {
  for (const auto& [apart_m, apart_rad, differs] : std::vector<std::tuple<double, double, bool>>{
           {0.9e-3, 0, false}, {1.1e-3, 0, true}, {0, 1.7e-3, false}, {0, 1.8e-3, true}}) {
    for (const int each : {50, 100, 101}) {  // of 1000
      std::vector<StampedPose> poses;
      for (int i = 0; i < 1010; ++i) {
        poses.push_back(handHeld(0.01 * i));
        if (i % each != 0 || i == 0) continue;
        poses.push_back(poses.back());
        Rigid3& T_world_rig = poses.back().T_world_rig;
        T_world_rig = {T_world_rig.rotation * rotationBy({apart_rad, 0, 0}),
                       T_world_rig.translation + Eigen::Vector3d(0, apart_m, 0)};
        if (i == each) poses.push_back(poses.back());  // a third one counts no more
      }
      const auto conflict = conflictOf(poses);
      EXPECT_EQ(conflict.has_value(), differs && each == 50) << apart_m << " " << apart_rad;
      if (!conflict) continue;
      EXPECT_TRUE(conflict->equal_times);
      EXPECT_EQ(conflict->count, 20U);
      EXPECT_EQ(conflict->of, 1010U);
      EXPECT_EQ(conflict->first, 50U);
      EXPECT_EQ(conflict->second, 51U);
      EXPECT_NEAR(conflict->distance_m, apart_m, 1e-9);
    }
  }
}

}  // namespace
}  // namespace efm
