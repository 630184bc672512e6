// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/keyframe_depth_map.h"
#include "maps/cloud/map_point.h"

namespace efm {

/// A map right after a keyframe.
struct WatchedMap {
  KeyframeDepthMap keyframe;            ///< The newest one.
  DepthPlanesOptions planes;            ///< The limits of its depths.
  MapCloud::ConstPtr points;            ///< Of the whole map.
  std::vector<StampedPose> trajectory;  ///< T_world_ref of all keyframes; not empty.
  std::vector<std::string> lines;       ///< Counts and rates, as text.
};

/// Shows how a map grows.
class MapWatcher {
 public:
  virtual ~MapWatcher() = default;
  /// Whether it wants a snapshot now. A snapshot costs an export of the map.
  /// @param is_last asked once more after the last keyframe.
  virtual bool due(bool is_last) = 0;
  /// @throws std::runtime_error if it cannot be shown; that ends the mapping.
  virtual void show(WatchedMap snapshot) = 0;
};

/// A window with the growing map. It draws copies in threads of its own, at most ten a second, and
/// asks for a snapshot so seldom that exporting the map takes less than a twentieth of the time.
/// The mouse turns the view, moves and zooms it; from then on the view follows the map no more.
class MapWindow : public MapWatcher {
 public:
  /// Whether the user has not closed it.
  virtual bool isOpen() = 0;
  /// Draws the last snapshot and returns when the user closes the window or presses a key in it, or
  /// as soon as `stop` is true.
  virtual void wait(const std::function<bool()>& stop) = 0;
};

}  // namespace efm
