// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/faults/tracker_process.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>

#include "mapping/depth/peak_fit.h"
#include "mapping/geometry/timestamp.h"
#include "tracking_stub/random/random_numbers.h"

namespace efm {
namespace {

/// The time in which the size of errors is stated: the step of the random walk, and travel.
constexpr double kStepS = 0.2;
constexpr double kDefaultDepthM = 2;
/// The parameters were fitted to trackers with about 100 poses a second. Noise of each pose would
/// be something else at a higher rate.
constexpr std::int64_t kMinStepNs = 10'000'000;

/// Parameters of a class. Errors of the position are fractions of the speed, or of the travel in
/// 0.2 s; times are seconds.
struct Parameters {
  double walk;         // median step of the random walk in 0.2 s
  double velocity_s;   // correlation time of the walk's velocity
  double return_s;     // time in which the walk returns to 0
  double coupled;      // correlation of the rotation with the walk, 0 to 1
  double burst_sigma;  // of the logarithm of the bursts
  double burst_s;      // correlation time of the bursts
  double scale_bias;   // relative error of the travel
  double scale_sigma;
  double direction_rad;
  double travel_s;  // correlation time of scale and direction
  double jitter;    // noise of each pose
  double rotation;  // size of the rotation about x and y, of what keeps the image aligned
  double roll;      // size of the rotation about z, relative to the others
  double wander;    // slow error of the position
  double jitter_deg;
  double wander_deg;  // slow error of the rotation
};

Parameters parametersOf(TrackerClass tracker) {
  switch (tracker) {
    case TrackerClass::kGood:
      return {0.019, 0.02, 1.0,   0.85, 0.4, 0.3, -0.01, 0.010,
              0.008, 1.0,  0.007, 0.85, 0.5, 0.0, 0.025, 0.3};
    case TrackerClass::kTypical:
      return {0.105, 0.02, 0.5,   0.9, 0.75, 0.3,  -0.03, 0.03,
              0.02,  1.0,  0.018, 1.0, 0.7,  0.03, 0.065, 0.5};
    case TrackerClass::kPoor:
      return {0.24, 0.05, 1.0,   0.85, 1.0, 0.4, -0.05, 0.06,
              0.04, 1.0,  0.015, 0.75, 0.7, 0.0, 0.03,  1.2};
    default:
      return {0.020, 0.05, 0.4,    0.7, 0.6, 0.4, -0.015, 0.017,
              0.012, 1.5,  0.0016, 0.6, 0.5, 0.0, 0.008,  0.35};
  }
}

/// Three independent Ornstein-Uhlenbeck processes with a standard deviation of 1.
class Correlated {
 public:
  Correlated(double tau_s, double dt_s, RandomNumbers random)
      : random_(random), keep_(std::exp(-dt_s / tau_s)), value_(normalVector(random_)) {}

  Eigen::Vector3d next() {
    const Eigen::Vector3d value = value_;
    value_ = keep_ * value_ + std::sqrt(1 - keep_ * keep_) * normalVector(random_);
    return value;
  }

 private:
  RandomNumbers random_;
  double keep_;
  Eigen::Vector3d value_;
};

/// A random walk that returns to 0: the leaky integral of a correlated velocity.
class LeakyWalk {
 public:
  LeakyWalk(const Parameters& of, double dt_s, RandomNumbers random)
      : dt_s_(dt_s), keep_(std::exp(-dt_s / of.return_s)), velocity_(of.velocity_s, dt_s, random) {}

  /// Forgets the start.
  void warmUp(const Parameters& of, double speed) {
    for (double t_s = 0; t_s < 5 * of.return_s; t_s += dt_s_) next(speed);
  }
  Eigen::Vector3d next(double speed) {
    value_ = keep_ * value_ + speed * dt_s_ * velocity_.next();
    return value_;
  }

 private:
  double dt_s_;
  double keep_;
  Correlated velocity_;
  Eigen::Vector3d value_ = Eigen::Vector3d::Zero();
};

/// Returns the median step in 0.2 s of the walk at a speed of 1.
double stepOf(const Parameters& parameters, double dt_s) {
  LeakyWalk walk(parameters, dt_s, RandomNumbers(7));
  walk.warmUp(parameters, 1);
  const auto lag = static_cast<std::size_t>(std::max(1.0, std::round(kStepS / dt_s)));
  std::vector<Eigen::Vector3d> values;
  for (double t_s = 0; t_s < 60 + kStepS || values.size() <= lag; t_s += dt_s) {
    values.push_back(walk.next(1));
  }
  std::vector<double> steps;
  for (std::size_t i = lag; i < values.size(); ++i) {
    steps.push_back((values[i] - values[i - lag]).norm());
  }
  return upperMedian(steps);
}

/// Returns the means over windows of `length` values around each value; the ends are repeated.
std::vector<double> smoothed(const std::vector<double>& values, std::size_t length) {
  const auto last = static_cast<std::ptrdiff_t>(values.size()) - 1;
  const auto before = static_cast<std::ptrdiff_t>(length / 2);
  const auto at = [&](std::ptrdiff_t i) {
    return values[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(i, 0, last))];
  };
  double sum = 0;
  for (std::ptrdiff_t i = -before; i < static_cast<std::ptrdiff_t>(length) - before; ++i) {
    sum += at(i);
  }
  std::vector<double> means;
  for (std::ptrdiff_t i = 0; i <= last; ++i) {
    means.push_back(sum / static_cast<double>(length));
    sum += at(i + static_cast<std::ptrdiff_t>(length) - before) - at(i - before);
  }
  return means;
}

std::int64_t medianStepOf(const std::vector<StampedPose>& poses) {
  std::vector<double> steps_ns;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    steps_ns.push_back(static_cast<double>(poses[i].t_ns - poses[i - 1].t_ns));
  }
  return static_cast<std::int64_t>(upperMedian(steps_ns));
}

}  // namespace

std::vector<StampedPose> withTrackerProcess(const std::vector<StampedPose>& poses,
                                            const TrackerProcessOptions& options,
                                            double max_pose_gap_s, std::int64_t tick_ns,
                                            std::uint64_t seed) {
  if (!options.any()) return poses;
  Trajectory truth(TrajectoryOptions{1e6});
  for (const StampedPose& pose : poses) truth.add(pose);
  if (truth.poses().size() < 2) {
    throw std::invalid_argument("tracker = " + std::string(nameOf(options.tracker)) +
                                ": expected at least two poses: there are " +
                                std::to_string(truth.poses().size()));
  }
  const std::int64_t first_ns = truth.poses().front().t_ns;
  const std::int64_t last_ns = truth.poses().back().t_ns;
  const std::int64_t dt_ns =
      std::max(tick_ns, (std::max(kMinStepNs, medianStepOf(truth.poses())) + tick_ns / 2) /
                            tick_ns * tick_ns);
  const double dt_s = secondsBetween(0, dt_ns);
  const std::int64_t max_gap_ns = durationFromSeconds(max_pose_gap_s);
  constexpr std::int64_t kMaxPoses = 50'000'000;  // 10 GB
  if ((last_ns - first_ns) / dt_ns > kMaxPoses) {
    throw std::invalid_argument("tracker = " + std::string(nameOf(options.tracker)) +
                                ": the poses at their median distance of " + formatSeconds(dt_ns) +
                                " s from " + formatSeconds(first_ns) + " to " +
                                formatSeconds(last_ns) +
                                " s would be too many: expected poses at even times");
  }
  const Parameters of = parametersOf(options.tracker);

  // The errors go on in a gap, but the tracker has no poses there.
  std::vector<Rigid3> T_world_cam;
  std::vector<bool> in_gap;
  std::size_t cursor = 0;
  for (std::int64_t t_ns = first_ns; t_ns <= last_ns; t_ns += dt_ns) {
    const auto segment = truth.segmentAt(t_ns, cursor);
    T_world_cam.push_back(segment ? segment->poseAt(t_ns) * options.T_body_cam
                                  : T_world_cam.back());
    in_gap.push_back(!segment || (t_ns != segment->first.t_ns && t_ns != segment->last.t_ns &&
                                  segment->last.t_ns - segment->first.t_ns > max_gap_ns));
  }
  const std::size_t count = T_world_cam.size();
  std::vector<Eigen::Vector3d> velocities_cam;  // of the camera, in its own frame
  std::vector<double> speeds;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t from = i == 0 ? 0 : i - 1, to = std::min(i + 1, count - 1);
    const Eigen::Vector3d path_world = T_world_cam[to].translation - T_world_cam[from].translation;
    const double seconds = dt_s * static_cast<double>(std::max<std::size_t>(to - from, 1));
    velocities_cam.push_back(T_world_cam[i].rotation.conjugate() * path_world / seconds);
    speeds.push_back(velocities_cam.back().norm());
  }
  speeds = smoothed(speeds, std::max<std::size_t>(1, static_cast<std::size_t>(0.5 / dt_s)));
  std::vector<double> sorted = speeds;
  const double usual_speed = upperMedian(sorted);
  for (double& speed : speeds) speed = std::max(speed, 0.2 * usual_speed);

  std::uint64_t stream = 0;
  const auto numbers = [&] { return RandomNumbers(seed, 0x7470726fU + stream++); };
  const auto walk = [&] {
    LeakyWalk made(of, dt_s, numbers());
    made.warmUp(of, speeds.front());
    return made;
  };
  LeakyWalk shift = walk(), turn = walk(), roll = walk();
  Correlated burst(of.burst_s, dt_s, numbers()), scale(of.travel_s, dt_s, numbers());
  Correlated direction(of.travel_s, dt_s, numbers());
  constexpr double kWanderS = 4;
  Correlated slow_shift(kWanderS, dt_s, numbers()), slow_turn(kWanderS, dt_s, numbers());
  RandomNumbers noise = numbers();
  const double amplitude = of.walk * kStepS / stepOf(of, dt_s);
  const double travel_m = kStepS * usual_speed;
  const double depth_m = options.depth_m.value_or(kDefaultDepthM);
  const double uncoupled = std::sqrt(1 - of.coupled * of.coupled);

  std::vector<StampedPose> moved;
  Eigen::Vector3d drift_world = Eigen::Vector3d::Zero();
  const Rigid3 T_cam_body = options.T_body_cam.inverse();
  for (std::size_t i = 0; i < count; ++i) {
    const Rigid3& T = T_world_cam[i];
    const double speed = speeds[i] * std::exp(of.burst_sigma * burst.next().x() -
                                              0.25 * of.burst_sigma * of.burst_sigma);
    const Eigen::Vector3d e_cam = amplitude * shift.next(speed);
    const Eigen::Vector3d aligned = of.coupled * e_cam + uncoupled * amplitude * turn.next(speed);
    const double about_z = of.roll * amplitude * roll.next(speed).z();
    // Turning about y moves the image as a shift along x does, at the depth of the scene.
    Eigen::Vector3d rotation_rad =
        of.rotation / depth_m * Eigen::Vector3d(aligned.y(), -aligned.x(), about_z);
    const double scale_error = of.scale_bias + of.scale_sigma * scale.next().x();
    const Eigen::Vector3d direction_rad = of.direction_rad * direction.next();
    const Eigen::Vector3d& velocity = velocities_cam[i];
    drift_world += T.rotation * (scale_error * velocity + direction_rad.cross(velocity)) * dt_s;
    Eigen::Vector3d offset_cam = e_cam + of.wander * travel_m * slow_shift.next() +
                                 of.jitter * travel_m / std::sqrt(3.0) * normalVector(noise);
    rotation_rad += kRadiansPerDegree * (of.jitter_deg * normalVector(noise) +
                                         of.wander_deg / std::sqrt(3.0) * slow_turn.next());
    const std::int64_t t_ns = first_ns + static_cast<std::int64_t>(i) * dt_ns;
    if (in_gap[i]) continue;
    const Rigid3 T_moved = {(T.rotation * rotationBy(rotation_rad)).normalized(),
                            T.translation + drift_world + T.rotation * offset_cam};
    moved.push_back({t_ns, T_moved * T_cam_body});
  }
  return moved;
}

}  // namespace efm
