// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace efm {

inline constexpr double kPi = 3.14159265358979323846;

/// Angles are radians everywhere but in files and option keys (`_deg`).
inline constexpr double kRadiansPerDegree = kPi / 180;

}  // namespace efm
