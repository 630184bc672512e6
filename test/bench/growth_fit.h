// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

namespace efm::bench {

/// The exponent k of time = a * size^k: the slope of the least-squares line through the logarithms.
/// @param sizes, times equally many, above 0; at least two different sizes.
/// @throws std::invalid_argument where they are not.
double fittedExponent(const std::vector<double>& sizes, const std::vector<double>& times);

}  // namespace efm::bench
