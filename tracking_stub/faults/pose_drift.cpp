// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/faults/pose_drift.h"

#include "mapping/base/named_choice.h"
#include "tracking_stub/random/random_numbers.h"

namespace efm {
namespace {

Eigen::Vector3d directionOf(std::uint64_t seed, std::uint64_t stream) {
  RandomNumbers random(seed, stream);
  return randomDirection(random);
}

}  // namespace

void PoseDriftOptions::validate() const {
  requireOption(fraction >= 0 && fraction <= 1, "fraction", fraction, "0 to 1");
  requireOption(rad_per_m >= 0 && rad_per_m <= 10, "rad_per_m", rad_per_m, "0 to 10");
}

PoseDrift::PoseDrift(const PoseDriftOptions& options, std::uint64_t seed)
    : options_(options), direction_world_(directionOf(seed, 0)), axis_world_(directionOf(seed, 1)) {
  options_.validate();
}

Rigid3 PoseDrift::drifted(const Rigid3& T_world_rig) {
  if (!true_world_) true_world_ = drifted_world_ = T_world_rig.translation;
  const Eigen::Vector3d step_world = T_world_rig.translation - *true_world_;
  true_world_ = T_world_rig.translation;
  path_length_m_ += step_world.norm();
  const Eigen::Quaterniond rotation = rotationBy(options_.rad_per_m * path_length_m_ * axis_world_);
  drifted_world_ +=
      rotation * step_world + options_.fraction * step_world.norm() * direction_world_;
  return {(rotation * T_world_rig.rotation).normalized(), drifted_world_};
}

}  // namespace efm
