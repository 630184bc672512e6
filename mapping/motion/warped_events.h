// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "mapping/events/window_input.h"
#include "mapping/geometry/depth_planes.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/motion/nearest_depths.h"
#include "mapping/motion/velocity_correction.h"

namespace efm {

/// An event warped to the reference view at its depth, and its derivatives by a correction of the
/// rig's velocity and of the depth. First order: exact to 0.02 pixels for rotations of half a
/// degree at a focal length of 300 pixels.
struct WarpedEvent {
  Eigen::Vector2f pixel;  ///< In the reference view, without a correction.
  /// Derivative of the pixel by (linear in m/s, angular in rad/s).
  Eigen::Matrix<float, 2, 6> by_velocity;
  Eigen::Vector2f by_inverse_depth;  ///< Derivative of the pixel by inverse depth in 1/m.
};

/// A depth plane in inverse depth.
struct InversePlane {
  float inverse_depth = 0;  ///< 1/m.
  float half_step = 0;      ///< Half the distance to its neighbours, 1/m.
};
std::vector<InversePlane> inversePlanes(const DepthPlanes& planes);

/// The view and the depths that events are warped to.
struct WarpTarget {
  Rigid3 T_ref_world;
  ReferenceView view;
  std::vector<InversePlane> planes;       ///< Candidate depths.
  const NearestDepths* depths = nullptr;  ///< Of the view; not owned.
  std::int64_t t_ref_ns = 0;
};

/// Warps one camera's events along a trajectory. The depth of an event is that of a pixel near its
/// ray. Events without such a pixel, without a pose or outside the lens are left out.
/// @param every of each `every` consecutive events, the middle one is warped.
std::vector<WarpedEvent> warpEvents(const CameraEvents& camera, std::size_t every,
                                    const Trajectory& trajectory, const WarpTarget& target);

}  // namespace efm
