// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/peak_fit.h"

#include <algorithm>
#include <limits>

namespace efm {
namespace {

/// A ridge of votes is wider than the errors of its top. With this fraction of the squared width,
/// 73 to 78 % of the depths of a simulated desk lie within one standard deviation of the truth and
/// 98 % within two, before the median filter, which halves the remaining errors.
constexpr double kErrorOfWidth = 0.17;

/// The negative second difference; 0 where a neighbour is missing.
template <typename Real>
Real curvatureOf(float before, float peak, float after) {
  if (before < 0 || after < 0) return 0;
  return Real{2} * Real{peak} - Real{before} - Real{after};
}

}  // namespace

double peakPosition(int plane, float before, float peak, float after) {
  const auto curvature = curvatureOf<double>(before, peak, after);
  if (!(curvature > 0)) return plane;
  const double offset = 0.5 * (double{after} - double{before}) / curvature;
  return plane + std::clamp(offset, -0.5, 0.5);
}

float peakWidthSquared(float before, float peak, float after) {
  const auto curvature = curvatureOf<float>(before, peak, after);
  return curvature > 0 ? peak / curvature : std::numeric_limits<float>::infinity();
}

double peakVariance(float before, float peak, float after) {
  const auto curvature = curvatureOf<double>(before, peak, after);
  if (!(curvature > 0)) return std::numeric_limits<double>::infinity();
  return kErrorOfWidth * peak / curvature;
}

}  // namespace efm
