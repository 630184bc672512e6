// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/poses/poses_file.h"

#include <stdexcept>

#include "tracking_stub/poses/tum_trajectory.h"

namespace efm {

std::vector<StampedPose> readPosesFile(const std::filesystem::path& file) {
  std::vector<StampedPose> poses = readTumTrajectory(file);
  if (poses.empty()) {
    throw std::runtime_error(file.string() +
                             ": no poses: expected at least one line t tx ty tz qx qy qz qw");
  }
  return poses;
}

}  // namespace efm
