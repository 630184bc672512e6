// SPDX-License-Identifier: BSD-3-Clause
#include "test/tracking_stub/faults/tum_replay.h"

#include <algorithm>
#include <utility>

#include "mapping/geometry/trajectory.h"

namespace efm {

TumReplay::TumReplay(std::vector<StampedPose> poses) : poses_(std::move(poses)) {
  std::stable_sort(poses_.begin(), poses_.end(),
                   [](const StampedPose& a, const StampedPose& b) { return a.t_ns < b.t_ns; });
}

TumReplay::TumReplay(const std::filesystem::path& file) : TumReplay(readTumTrajectory(file)) {}

std::optional<StampedPose> TumReplay::next() {
  if (ended()) return std::nullopt;
  return poses_[next_++];
}

}  // namespace efm
