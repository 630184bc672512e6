// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

namespace efm::bench {

/// The exponent k of time = a * size^k: the slope of the least-squares line through the logarithms.
/// @param sizes, times of equal number, above 0, with at least two different sizes.
/// @throws std::invalid_argument for other sizes and times.
double fittedExponent(const std::vector<double>& sizes, const std::vector<double>& times);

}  // namespace efm::bench
