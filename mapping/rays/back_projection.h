// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/geometry/plane_transfer.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/undistortion.h"
#include "mapping/rays/pose_packets.h"

namespace efm {

/// One camera's events as rays of the reference view: each by its pixel on the plane at infinity,
/// from which a scale and an offset lead to any other plane (`transferToPlane`).
///
/// This is the first step of the transfer of Rebecq et al. (IJCV 2018, Eq. 15) with the plane at
/// infinity for Z0: no camera centre can lie on it. Rays parallel to the planes get non-finite
/// coordinates and are never inside a view.
struct RayBundle {
  std::vector<float> x_inf;  ///< Pixels of the reference view.
  std::vector<float> y_inf;
  std::vector<RayPacket> packets;

  std::size_t size() const { return x_inf.size(); }
};

/// One camera's rays, one bundle per slot: a slot is a sub-interval of one group of events
/// (`EventGroups`). All cameras of a sweep have the same number of slots.
using CameraRays = std::vector<RayBundle>;

/// Back-projects the events of the packets. Events between packets and outside the lens are left
/// out. All events lie inside the sensor.
RayBundle backProject(EventSpan events, const PosePackets& packets,
                      const UndistortionTable& undistortion, const ReferenceView& view);

}  // namespace efm
