// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/faults/pose_drift.h"

#include "mapping/geometry/rigid3.h"
#include "mapping/options/option_check.h"
#include "tracking_stub/random/random_vectors.h"

namespace efm {
namespace {

Eigen::Vector3d directionOf(std::uint64_t seed, std::uint64_t stream) {
  RandomNumbers random(seed, stream);
  return randomDirection(random);
}

}  // namespace

void PoseDriftOptions::validate() const {
  requireOption(share >= 0 && share <= 1, "share", share, "0 to 1");
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
  way_m_ += step_world.norm();
  const Eigen::Quaterniond turned = rotationBy(options_.rad_per_m * way_m_ * axis_world_);
  drifted_world_ += turned * step_world + options_.share * step_world.norm() * direction_world_;
  return {(turned * T_world_rig.rotation).normalized(), drifted_world_};
}

}  // namespace efm
