// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/survey/pose_hypotheses.h"

#include <algorithm>
#include <array>

namespace efm {
namespace {

/// All 23 rotations other than none that map axes to axes.
std::vector<Eigen::Matrix3d> axisRotations() {
  std::vector<Eigen::Matrix3d> rotations;
  std::array<int, 3> order{0, 1, 2};
  do {
    for (unsigned signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d rotation = Eigen::Matrix3d::Zero();
      for (int row = 0; row < 3; ++row) {
        rotation(row, order[static_cast<std::size_t>(row)]) = (signs >> row) % 2 == 0 ? 1 : -1;
      }
      if (rotation.determinant() > 0 && !rotation.isIdentity()) rotations.push_back(rotation);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return rotations;
}

}  // namespace

std::vector<PoseHypothesis> poseHypotheses() {
  std::vector<PoseHypothesis> all;
  all.push_back({PoseMistake::kInverted, [](const Rigid3& pose) { return pose.inverse(); }});
  all.push_back({PoseMistake::kQuaternionOrder, [](const Rigid3& pose) {
                   const Eigen::Quaterniond& q = pose.rotation;
                   return Rigid3{{q.x(), q.y(), q.z(), q.w()}, pose.translation};
                 }});
  for (const Eigen::Matrix3d& rotation : axisRotations()) {
    const Rigid3 T_body_rig{Eigen::Quaterniond(rotation), Eigen::Vector3d::Zero()};
    all.push_back({PoseMistake::kAxes,
                   [T_body_rig](const Rigid3& pose) { return pose * T_body_rig; }, rotation});
  }
  return all;
}

}  // namespace efm
