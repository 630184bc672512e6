// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "test/bench/performance_row.h"

namespace efm::bench {

/// Stand in the place of a kernel: what the others are held against.
inline constexpr const char* kYardstick = "yardstick";  ///< voteBilinear on one plane, nothing else.
inline constexpr const char* kUnfused = "unfused";      ///< A keyframe over whole volumes.

// Groups that are held against one another.
inline constexpr const char* kVoting = "voting";                    ///< Up to ray densities.
inline constexpr const char* kOneCameraSweep = "one-camera sweep";  ///< With binning and peaks.

/// Adds to the rows what follows from several of them, how many times as fast each is:
///   times_yardstick   as the yardstick at the same size, by CPU time;
///   times_unfused     as the unfused keyframe at the same size, by CPU time, with one thread;
///   times_one_thread  as itself with one thread, by real time.
void addRatios(std::vector<PerformanceRow>& rows);

/// Adds a row "growth" for each thing that a keyframe grows with and each kernel: the exponent that
/// fits the rows with a quantity "size" and that name before the slash.
void addExponents(std::vector<PerformanceRow>& rows);

}  // namespace efm::bench
