// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace mrpt::opengl {
class CSetOfObjects;
}

namespace efm {

class CObservationEvents;

/// The maximum number of drawn events of a packet. Of more events, an even selection is drawn.
inline constexpr std::size_t kMaxDrawnEvents = 50'000;
/// The distance of the drawn image plane, for a viewer whose first view spans some twenty metres.
inline constexpr double kDrawnPlaneM = 3;

/// Draws a packet at its camera's pose on the rig: the axes of the camera, its view frustum up to
/// the image plane at z = kDrawnPlaneM, and a point on this plane for each event: ON red, OFF blue.
/// The image is not undistorted.
void drawEvents(const CObservationEvents& packet, mrpt::opengl::CSetOfObjects& out);

}  // namespace efm
