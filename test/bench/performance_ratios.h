// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "test/bench/performance_row.h"

namespace efm::bench {

/// References for the ratios, in the column of the kernel.
inline constexpr const char* kYardstick =
    "yardstick";                                    ///< voteBilinear on one plane, nothing else.
inline constexpr const char* kUnfused = "unfused";  ///< A keyframe over whole volumes.

// Groups that are compared.
inline constexpr const char* kVoting = "voting";                    ///< Up to ray densities.
inline constexpr const char* kOneCameraSweep = "one-camera sweep";  ///< With binning and peaks.

inline constexpr const char* kAsShipped = "keyframe as shipped";
inline constexpr const char* kAsPaper = "keyframe with the paper's options";

/// Adds the speed of each row relative to a reference:
///   times_yardstick   to the yardstick at the same size, by CPU time;
///   times_unfused     to the unfused keyframe at the same size, by CPU time, with one thread;
///   times_plain       to the plain kernel, for keyframes as shipped and with the paper's options;
///   times_plain_paper as shipped, to the plain kernel with the paper's options;
///   times_one_thread  to the same case with one thread, by real time.
/// And over_paper: the time as shipped over that with the paper's options, same kernel.
void addRatios(std::vector<PerformanceRow>& rows);

/// Adds a row "growth" for each growth and kernel: the fitted exponent of the rows with a quantity
/// "size" and the same name before the slash.
void addExponents(std::vector<PerformanceRow>& rows);

}  // namespace efm::bench
