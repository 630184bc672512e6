// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace mrpt::opengl {
class CSetOfObjects;
}

namespace efm {

class CObservationEvents;

/// A packet with more events is drawn with this many, evenly spaced in it.
inline constexpr std::size_t kMaxDrawnEvents = 50'000;
/// Where the image plane is drawn. A viewer for vehicles shows some twenty metres at first.
inline constexpr double kDrawnPlaneM = 3;

/// Draws a packet where its camera stands on the rig: the axes of the camera, its pyramid of view
/// up to the image plane at z = kDrawnPlaneM, and there a point for each event, red where it became
/// brighter and blue where it became darker. The image is the sensor's own: it is not undistorted.
void drawEvents(const CObservationEvents& packet, mrpt::opengl::CSetOfObjects& out);

}  // namespace efm
