// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mapping/geometry/rigid3.h"
#include "maps/refinement/pose_refinement.h"

namespace mrpt::poses {
class CPose3D;
class CPose3DPDFGaussian;
}  // namespace mrpt::poses

namespace efm {

/// Converts to and from MRPT's poses, exact to about 1e-15 at any rotation: through MRPT's rotation
/// matrix and quaternion, not through its angles.
Rigid3 rigidFrom(const mrpt::poses::CPose3D& pose);
mrpt::poses::CPose3D mrptPoseFrom(const Rigid3& T_a_b);

/// A pose with covariance. MRPT's covariance is of x, y, z, yaw, pitch and roll.
/// @param covariance of a small motion of the pose: a translation along the axes of a, then a
/// rotation vector about them, as `poseCovariance` returns it.
mrpt::poses::CPose3DPDFGaussian mrptPoseFrom(const Rigid3& T_a_b, const Matrix6d& covariance);

}  // namespace efm
