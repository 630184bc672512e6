// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/rig.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "mapping/base/option_check.h"
#include "mapping/geometry/timestamp.h"

namespace efm {

void RigCamera::validate() const {
  model.validate();
  constexpr double kMaxRounding = 1e-6;
  const double norm = T_rig_cam.rotation.norm();
  requireOption(std::abs(norm - 1) <= kMaxRounding, "T_rig_cam: length of the rotation quaternion",
                norm, "1");
  const Eigen::Vector3d& at = T_rig_cam.translation;
  requireOption(std::isfinite(at.x()), "T_rig_cam: x", at.x(), "finite (metres)");
  requireOption(std::isfinite(at.y()), "T_rig_cam: y", at.y(), "finite (metres)");
  requireOption(std::isfinite(at.z()), "T_rig_cam: z", at.z(), "finite (metres)");
  requireOption(time_offset_ns >= -kEndOfTimeNs && time_offset_ns <= kEndOfTimeNs, "time offset",
                formatSeconds(time_offset_ns), "within " + formatSeconds(kEndOfTimeNs) + " s");
}

bool isSelected(int camera, const std::vector<int>& selection) {
  return selection.empty() ||
         std::find(selection.begin(), selection.end(), camera) != selection.end();
}

std::vector<int> selectedCameras(const Rig& rig, const std::vector<int>& selection) {
  if (!selection.empty()) return selection;
  std::vector<int> all(rig.cameras.size());
  std::iota(all.begin(), all.end(), 0);
  return all;
}

}  // namespace efm
