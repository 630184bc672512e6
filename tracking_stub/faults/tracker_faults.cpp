// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/faults/tracker_faults.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tracking_stub/random/random_numbers.h"

namespace efm {
namespace {

/// A time interval [begin, end).
struct TimeGap {
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = 0;
};

std::vector<StampedPose> withoutLost(const std::vector<StampedPose>& poses,
                                     const PoseDropoutOptions& options) {
  RandomNumbers single(options.seed, 0);
  RandomNumbers waits(options.seed, 1);
  const auto gap_after = [&](std::int64_t from_ns) {
    constexpr double kMaxWaitS = 1e9;  // longer than any recording; sums fit 64 bits
    const double wait_s = -std::log(1 - waits.uniform()) / options.random_gaps_hz;
    const std::int64_t begin_ns = from_ns + durationFromSeconds(std::min(wait_s, kMaxWaitS));
    return TimeGap{begin_ns, begin_ns + durationFromSeconds(options.random_gap_s)};
  };
  std::optional<TimeGap> random_gap;  // the current gap or the next one
  std::vector<StampedPose> kept;
  for (const StampedPose& pose : poses) {
    // A number is drawn for every pose, lost or not, so that a gap does not change other losses.
    bool lost = single.uniform() < options.drop_probability;
    if (options.random_gaps_hz > 0) {
      if (!random_gap) random_gap = gap_after(pose.t_ns);
      while (pose.t_ns >= random_gap->end_ns) random_gap = gap_after(random_gap->end_ns);
      lost |= pose.t_ns >= random_gap->begin_ns;
    }
    if (!lost) kept.push_back(pose);
  }
  return kept;
}

/// Moves poses, one after the other.
class Perturbation {
 public:
  explicit Perturbation(const PosePerturbationOptions& options) : options_(options) {
    RandomNumbers direction(seedOf(Kind::kDrift), 0);
    RandomNumbers axis(seedOf(Kind::kDrift), 1);
    direction_world_ = randomDirection(direction);
    axis_world_ = randomDirection(axis);
  }

  void add(const StampedPose& pose) {
    const Rigid3& T_world_rig = pose.T_world_rig;
    if (!T_world_rig.translation.allFinite() || !T_world_rig.rotation.coeffs().allFinite() ||
        pose.t_ns <= -kEndOfTimeNs || pose.t_ns >= kEndOfTimeNs) {
      moved.push_back(pose);
      return;
    }
    if (before_ && pose.t_ns < before_->t_ns) {
      throw std::invalid_argument("the pose at " + formatSeconds(pose.t_ns) +
                                  " s comes after one at " + formatSeconds(before_->t_ns) +
                                  " s: poses that are perturbed must come in time order");
    }
    NoisyPose noisy = {pose.t_ns, T_world_rig,
                       noiseOf(Kind::kPose, pose.t_ns, options_.noise_m, options_.noise_rad)};
    if (options_.drift.any()) noisy.T_world_rig = drifted(T_world_rig);
    if (options_.keyframe.any()) insertJumps(noisy);
    append(noisy);
    before_ = noisy;
  }

  std::vector<StampedPose> moved;

 private:
  /// Each kind of error has its own seed, so an option does not change the other kinds' numbers.
  enum class Kind { kPose = 0x706f, kKeyframe, kDrift };

  /// A pose without noise, and the noise to add.
  struct NoisyPose {
    std::int64_t t_ns = 0;
    Rigid3 T_world_rig;
    Rigid3 noise;
  };

  std::uint64_t seedOf(Kind kind) const {
    return RandomNumbers(options_.seed, static_cast<std::uint64_t>(kind)).next();
  }

  /// @param number time of a pose, or number of an interval.
  Rigid3 noiseOf(Kind kind, std::int64_t number, double noise_m, double noise_rad) const {
    RandomNumbers random(seedOf(kind), static_cast<std::uint64_t>(number));
    const Eigen::Vector3d shift_world = noise_m * normalVector(random);
    return {rotationBy(noise_rad * normalVector(random)), shift_world};
  }

  Rigid3 drifted(const Rigid3& T_world_rig) {
    const Eigen::Vector3d rig_world = T_world_rig.translation;
    if (!before_) true_world_ = rig_world;
    const Eigen::Vector3d step_world = rig_world - true_world_;
    true_world_ = rig_world;
    path_length_m_ += step_world.norm();
    const Eigen::Quaterniond turn =
        rotationBy(options_.drift.rad_per_m * path_length_m_ * axis_world_);
    const Eigen::Vector3d drifted_step_world =
        turn * step_world + options_.drift.fraction * step_world.norm() * direction_world_;
    return {(turn * T_world_rig.rotation).normalized(),
            (before_ ? before_->T_world_rig.translation : rig_world) + drifted_step_world};
  }

  /// Enters the interval of a pose. Inserts poses at each interval that begins before the pose.
  void insertJumps(const NoisyPose& pose) {
    if (!before_) start_ns_ = options_.keyframe.start_ns.value_or(pose.t_ns);
    const std::int64_t last = intervalAt(pose.t_ns);
    if (!before_ || pose.t_ns - before_->t_ns > durationFromSeconds(options_.max_pose_gap_s)) {
      if (!before_ || last != interval_) enterInterval(last, pose);
      return;
    }
    const auto between = [&](std::int64_t t_ns) {
      const double fraction = static_cast<double>(t_ns - before_->t_ns) /
                              static_cast<double>(pose.t_ns - before_->t_ns);
      return NoisyPose{t_ns, interpolate(before_->T_world_rig, pose.T_world_rig, fraction),
                       interpolate(before_->noise, pose.noise, fraction)};
    };
    while (interval_ < last) {
      const std::int64_t begin_ns = beginNs(interval_ + 1);
      if (begin_ns - options_.tick_ns > before_->t_ns) append(between(begin_ns - options_.tick_ns));
      const bool inserted = begin_ns < pose.t_ns;
      const NoisyPose first = inserted ? between(begin_ns) : pose;
      enterInterval(interval_ + 1, first);
      if (inserted) append(first);
    }
  }

  std::int64_t beginNs(std::int64_t interval) const {
    const std::int64_t begin_ns = start_ns_ + interval * *options_.keyframe.length_ns;
    return floorDivide(begin_ns, options_.tick_ns) * options_.tick_ns;
  }

  std::int64_t intervalAt(std::int64_t t_ns) const {
    const std::int64_t interval = floorDivide(t_ns - start_ns_, *options_.keyframe.length_ns);
    return t_ns >= beginNs(interval + 1) ? interval + 1 : interval;  // beginnings are rounded down
  }

  static std::int64_t floorDivide(std::int64_t value, std::int64_t by) {
    return value / by - (value % by < 0 ? 1 : 0);
  }

  /// Sets the error: a rotation about the rig and a shift. @param pose first pose of the interval.
  void enterInterval(std::int64_t interval, const NoisyPose& pose) {
    const KeyframeNoiseOptions& keyframe = options_.keyframe;
    const Rigid3 noise = noiseOf(Kind::kKeyframe, interval, keyframe.noise_m, keyframe.noise_rad);
    const Eigen::Vector3d& rig_world = pose.T_world_rig.translation;
    error_ = {noise.rotation, rig_world - noise.rotation * rig_world + noise.translation};
    interval_ = interval;
  }

  void append(const NoisyPose& pose) {
    Rigid3 T_world_rig = pose.T_world_rig;
    if (options_.keyframe.any()) T_world_rig = error_ * T_world_rig;
    if (options_.noise_m > 0) T_world_rig.translation += pose.noise.translation;
    if (options_.noise_rad > 0) {
      T_world_rig.rotation = (T_world_rig.rotation * pose.noise.rotation).normalized();
    }
    moved.push_back({pose.t_ns, T_world_rig});
  }

  PosePerturbationOptions options_;
  Eigen::Vector3d direction_world_;  // of the drift of the position
  Eigen::Vector3d axis_world_;       // of the drift of the heading
  double path_length_m_ = 0;
  Eigen::Vector3d true_world_;       // the previous position without drift
  std::optional<NoisyPose> before_;  // the previous pose, with drift
  std::int64_t start_ns_ = 0;        // begin of interval 0
  std::int64_t interval_ = 0;        // interval of the previous pose
  Rigid3 error_;                     // error of that interval
};

}  // namespace

void TrackerFaults::validate() const {
  const auto& [noise_m, noise_rad, length_ns, start_ns] = perturbation.keyframe;
  requireOption(!perturbation.keyframe.any() || length_ns, "length_ns of keyframes", "nothing",
                "given where there is noise per keyframe");
  // A short length may come from the stride of keyframes instead of `keyframe_s`.
  requireOption(!length_ns || (*length_ns >= 1'000'000 && *length_ns <= 1'000'000'000'000'000),
                "length_ns of keyframes", length_ns.value_or(0), "1e6 to 1e15");
  requireOption(!start_ns || (*start_ns > -kEndOfTimeNs && *start_ns < kEndOfTimeNs),
                "start_ns of keyframes", start_ns.value_or(0), "within 4.6e18 of 0");
  requireFields(*this);
  TrajectoryOptions{perturbation.max_pose_gap_s}.validate();
  const std::int64_t tick_ns = perturbation.tick_ns;
  requireOption(tick_ns >= 1 && tick_ns < 1'000'000, "tick_ns", tick_ns, "1 to 999999");
}

std::vector<StampedPose> withFaults(const std::vector<StampedPose>& poses,
                                    const TrackerFaults& faults) {
  faults.validate();
  const PosePerturbationOptions& options = faults.perturbation;
  std::vector<StampedPose> kept =
      withoutLost(withTrackerProcess(poses, faults.process, options.max_pose_gap_s, options.tick_ns,
                                     options.seed),
                  faults.dropouts);
  if (!faults.perturbation.any()) return kept;
  Perturbation perturbation(faults.perturbation);
  for (const StampedPose& pose : kept) perturbation.add(pose);
  return perturbation.moved;
}

}  // namespace efm
