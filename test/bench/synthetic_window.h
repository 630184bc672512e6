// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <optional>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/events/window.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "mapping/rays/rays.h"
#include "mapping/sweep/space_sweep.h"

namespace efm::bench {

/// A motion of constant speed during a window, around the pose at the middle of the window.
struct WindowMotion {
  const char* name = "";
  Eigen::Vector3d travel_m = Eigen::Vector3d::Zero();
  double turn_deg = 0;  ///< Rotation to the right.
  /// Distance from the rig to a point in front of it. The rig circles this point and looks at it.
  /// If 0, the rig turns on the spot.
  double circled_m = 0;
};

/// The nearest plane of all windows.
inline constexpr double kNearLimit_m = 0.8;

struct SyntheticWindowOptions {
  int width = 346;
  int height = 260;
  std::size_t events_per_camera = 235'000;
  int cameras = 2;  ///< Cameras side by side, 0.1 m apart.
  double duration_s = 0.2;
  unsigned seed = 1;
  std::optional<WindowMotion> motion = {};  ///< If empty: hand-held.
  /// A wide lens with strong radial distortion. Events keep the pixels of the pinhole model: run
  /// times are realistic, depths are wrong.
  bool strong_lens = false;
};

/// A window of events of a rig that looks at straight edges 1 to 6 m away. The edges in a part of
/// the view lie on one surface, as in a real scene. Every tenth event is noise. Events are computed
/// from the edges without images: millions of events in less than a second, with positions and
/// times like real events.
struct SyntheticWindow {
  Rig rig;
  Trajectory trajectory;
  Window window;
  std::vector<std::vector<Event>> events;  ///< Per camera, in time order.
  KeyframeMapperOptions options;  ///< 100 planes, 0.8 to 8 m, the paper's fusion and depths.
};

SyntheticWindow makeSyntheticWindow(const SyntheticWindowOptions& options);

/// The input of a sweep: the rays of events.
struct SweepInput {
  ReferenceView view;
  DepthPlanes planes;
  std::vector<CameraRays> cameras;
  std::vector<PosePackets> packets;  ///< The packets of each camera.
};

/// Back-projects the window's cameras into the view of the first camera.
SweepInput makeSweepInput(const SyntheticWindow& made, int planes);

}  // namespace efm::bench
