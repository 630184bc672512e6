// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/pose_difference.h"

namespace efm {

Vector6d differenceOf(const Rigid3& T_a_b) {
  const Eigen::AngleAxisd rotation(T_a_b.rotation);  // 0 to pi, for either sign of the quaternion
  Vector6d difference;
  difference << T_a_b.translation, rotation.angle() * rotation.axis();
  return difference;
}

Rigid3 rigidFromDifference(const Vector6d& difference) {
  return {rotationBy(difference.tail<3>()), difference.head<3>()};
}

}  // namespace efm
