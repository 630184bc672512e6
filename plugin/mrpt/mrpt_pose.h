// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mapping/geometry/rigid3.h"
#include "maps/refinement/pose_difference.h"

namespace mrpt::poses {
class CPose3D;
class CPose3DPDFGaussian;
}  // namespace mrpt::poses

namespace efm {

/// MRPT keeps a pose as a rotation matrix beside angles, and stores it as a quaternion: both ways
/// are exact to some 1e-15, at any rotation.
Rigid3 rigidFrom(const mrpt::poses::CPose3D& pose);
mrpt::poses::CPose3D mrptPoseFrom(const Rigid3& T_a_b);

/// A pose with the covariance of a small motion of it: a translation along the axes of a, then a
/// rotation vector about them, as `poseCovariance` gives it. MRPT's is that of x, y, z, yaw, pitch
/// and roll.
mrpt::poses::CPose3DPDFGaussian mrptPoseFrom(const Rigid3& T_a_b, const Matrix6d& covariance);

}  // namespace efm
