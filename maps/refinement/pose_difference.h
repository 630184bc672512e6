// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mapping/geometry/rigid3.h"
#include "maps/refinement/small_matrices.h"

namespace efm {

/// The motion T_a_b as six numbers: the translation in metres, then the rotation vector (axis times
/// angle, at most pi) in radians. Covariances and informations of poses have the same order.
Vector6d differenceOf(const Rigid3& T_a_b);

/// The inverse of `differenceOf`.
Rigid3 rigidFromDifference(const Vector6d& difference);

}  // namespace efm
