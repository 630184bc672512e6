// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace efm {

/// The parabola through the values of a DSI column at its peak, on the plane before it and on the
/// plane after it. A negative value says that there is no such plane: the peak lies on the first or
/// the last plane.

/// Position of the parabola's top, in planes, at most half a plane from the peak. The peak's own
/// plane where there is no curvature or a neighbour is missing.
double peakPosition(int plane, float before, float peak, float after);

/// peak / (2 peak - before - after), planes^2: the variance of a Gaussian with the curvature of the
/// parabola. Infinite where there is no curvature or a neighbour is missing.
float peakWidthSquared(float before, float peak, float after);

/// Variance of the errors of the peak's position, planes^2: a fraction of the squared width.
double peakVariance(float before, float peak, float after);

}  // namespace efm
