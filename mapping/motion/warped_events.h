// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/geometry/depth_planes.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/geometry/undistortion.h"
#include "mapping/motion/nearest_depths.h"
#include "mapping/motion/velocity_correction.h"

namespace efm {

/// An event carried to the reference view at the depth of what it saw, and how it moves there with
/// a correction of the rig's velocity and of that depth: to the first order, which is good to 0.02
/// pixels for turns of half a degree at a focal length of 300 pixels.
struct WarpedEvent {
  Eigen::Vector2f pixel;  ///< Of the reference view, without a correction.
  /// Derivative of the pixel by (linear in m/s, angular in rad/s).
  Eigen::Matrix<float, 2, 6> by_velocity;
  Eigen::Vector2f by_inverse_depth;  ///< Derivative of the pixel by inverse depth in 1/m.
};

/// A depth plane, as rays are searched.
struct InversePlane {
  float inverse_depth = 0;  ///< 1/m.
  float half_step = 0;      ///< Half the distance to its neighbours, 1/m.
};
std::vector<InversePlane> inversePlanes(const DepthPlanes& planes);

/// What events are warped to.
struct WarpTarget {
  Rigid3 T_ref_world;
  ReferenceView view;
  std::vector<InversePlane> planes;       ///< Depths that are tried.
  const NearestDepths* depths = nullptr;  ///< Of the view; not owned.
  std::int64_t t_ref_ns = 0;
};

/// One camera's events that saw something whose depth is known: along an event's ray the place
/// whose depth is that of a pixel near by, the nearest of them. The others are left out.
/// @param every takes one event of so many, the middle one.
std::vector<WarpedEvent> warpEvents(EventSpan events, std::size_t every, const RigCamera& camera,
                                    const UndistortionTable& undistortion,
                                    const Trajectory& trajectory, const WarpTarget& target);

}  // namespace efm
