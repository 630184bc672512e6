// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mapping/rigid3.h"

namespace mrpt::poses {
class CPose3D;
}

namespace efm {

/// MRPT keeps a pose as a rotation matrix beside angles, and stores it as a quaternion: both ways
/// are exact to some 1e-15, at any rotation.
Rigid3 rigidFrom(const mrpt::poses::CPose3D& pose);
mrpt::poses::CPose3D mrptPoseFrom(const Rigid3& T_a_b);

}  // namespace efm
