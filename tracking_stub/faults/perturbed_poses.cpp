// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/faults/perturbed_poses.h"

#include <stdexcept>
#include <utility>

#include "mapping/base/named_choice.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"
#include "tracking_stub/random/random_numbers.h"

namespace efm {
namespace {

/// Each kind of error has its own seed: one option does not change the random numbers of another.
enum class Kind { kPose = 0x706f, kKeyframe, kDrift };

std::uint64_t seedOf(Kind kind, std::uint64_t seed) {
  return RandomNumbers(seed, static_cast<std::uint64_t>(kind)).next();
}

bool isUsable(const StampedPose& pose) {
  return pose.T_world_rig.translation.allFinite() &&
         pose.T_world_rig.rotation.coeffs().allFinite() && pose.t_ns > -kEndOfTimeNs &&
         pose.t_ns < kEndOfTimeNs;
}

}  // namespace

bool PosePerturbationOptions::any() const {
  return noise_m > 0 || noise_rad > 0 || keyframe.any() || drift.any();
}

void PosePerturbationOptions::validate() const {
  requireOption(noise_m >= 0 && noise_m <= 1e3, "noise_m", noise_m, "0 to 1e3");
  requireOption(noise_rad >= 0 && noise_rad <= 3.2, "noise_rad", noise_rad, "0 to 3.2");
  keyframe.validate();
  drift.validate();
  TrajectoryOptions{max_pose_gap_s}.validate();
  requireOption(tick_ns >= 1 && tick_ns < 1'000'000, "tick_ns", tick_ns, "1 to 999999");
}

PerturbedPoses::PerturbedPoses(std::unique_ptr<PoseSource> source,
                               const PosePerturbationOptions& options)
    : source_(std::move(source)),
      options_(options),
      drift_(options.drift, seedOf(Kind::kDrift, options.seed)) {
  requireOption(source_ != nullptr, "source", "none", "given");
  options_.validate();
}

std::optional<StampedPose> PerturbedPoses::next() {
  if (ready_.empty()) {
    const std::optional<StampedPose> pose = source_->next();
    if (!pose) return std::nullopt;
    perturb(*pose);
  }
  const StampedPose pose = ready_.front();
  ready_.pop_front();
  return pose;
}

/// Appends a pose, and the poses that are inserted before it.
void PerturbedPoses::perturb(const StampedPose& pose) {
  if (!isUsable(pose)) {
    ready_.push_back(pose);
    return;
  }
  if (before_ && pose.t_ns < before_->t_ns) {
    throw std::invalid_argument("the pose at " + formatSeconds(pose.t_ns) +
                                " s comes after one at " + formatSeconds(before_->t_ns) +
                                " s: poses that are perturbed must come in time order");
  }
  NoisyPose noisy = {pose.t_ns, pose.T_world_rig, drawNoise(pose.t_ns)};
  if (options_.drift.any()) noisy.T_world_rig = drift_.drifted(pose.T_world_rig);
  if (options_.keyframe.any()) insertJumps(noisy);
  append(noisy);
  before_ = noisy;
}

Rigid3 PerturbedPoses::drawNoise(std::int64_t t_ns) const {
  RandomNumbers random(seedOf(Kind::kPose, options_.seed), static_cast<std::uint64_t>(t_ns));
  const Eigen::Vector3d shift_world = options_.noise_m * normalVector(random);
  return {rotationBy(options_.noise_rad * normalVector(random)), shift_world};
}

/// Enters the interval of a pose. Inserts poses at each interval that begins before the pose.
void PerturbedPoses::insertJumps(const NoisyPose& pose) {
  if (!keyframe_noise_) {
    keyframe_noise_.emplace(options_.keyframe, KeyframeNoise::Clock{pose.t_ns, options_.tick_ns},
                            seedOf(Kind::kKeyframe, options_.seed));
  }
  const std::int64_t last = keyframe_noise_->intervalAt(pose.t_ns);
  const bool gap =
      !before_ || pose.t_ns - before_->t_ns > durationFromSeconds(options_.max_pose_gap_s);
  if (gap) {
    if (!before_ || last != interval_) enterInterval(last, pose);
    return;
  }
  const auto between = [&](std::int64_t t_ns) {
    const double fraction =
        static_cast<double>(t_ns - before_->t_ns) / static_cast<double>(pose.t_ns - before_->t_ns);
    return NoisyPose{t_ns, interpolate(before_->T_world_rig, pose.T_world_rig, fraction),
                     interpolate(before_->noise, pose.noise, fraction)};
  };
  while (interval_ < last) {
    const std::int64_t begin_ns = keyframe_noise_->beginNs(interval_ + 1);
    if (begin_ns - options_.tick_ns > before_->t_ns) append(between(begin_ns - options_.tick_ns));
    const bool inserted = begin_ns < pose.t_ns;
    const NoisyPose first = inserted ? between(begin_ns) : pose;
    enterInterval(interval_ + 1, first);
    if (inserted) append(first);
  }
}

/// @param pose the first pose of the interval.
void PerturbedPoses::enterInterval(std::int64_t interval, const NoisyPose& pose) {
  interval_ = interval;
  error_ = keyframe_noise_->errorOf(interval, pose.T_world_rig.translation);
}

void PerturbedPoses::append(const NoisyPose& pose) {
  Rigid3 T_world_rig = pose.T_world_rig;
  if (options_.keyframe.any()) T_world_rig = error_ * T_world_rig;
  if (options_.noise_m > 0) T_world_rig.translation += pose.noise.translation;
  if (options_.noise_rad > 0) {
    T_world_rig.rotation = (T_world_rig.rotation * pose.noise.rotation).normalized();
  }
  ready_.push_back({pose.t_ns, T_world_rig});
}

}  // namespace efm
