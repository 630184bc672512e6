// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>

#include "mapping/geometry/rigid3.h"

namespace efm {

/// Rotations and transforms from the numbers of files, which are rounded.

/// The rotation nearest to a matrix R. R * R^T may differ from the identity by 1e-3 in a number.
/// @return nothing for other matrices, reflections and numbers that are not finite.
std::optional<Eigen::Quaterniond> rotationNear(const Eigen::Matrix3d& R_a_b);
/// The transform nearest to a matrix: its rotation as above. The last row may differ from 0 0 0 1
/// by 1e-3 in a number.
std::optional<Rigid3> transformNear(const Eigen::Matrix4d& T_a_b);
/// The rotation of a quaternion whose length is 1 within 1 %; nothing for other lengths.
std::optional<Eigen::Quaterniond> rotationNear(const Eigen::Quaterniond& rotation);

}  // namespace efm
