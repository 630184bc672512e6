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

/// Snapshot of a map right after a keyframe.
struct WatchedMap {
  KeyframeDepthMap keyframe;            ///< The newest keyframe.
  DepthPlanesOptions planes;            ///< The limits of the depths.
  MapCloud::ConstPtr points;            ///< Points of the whole map.
  std::vector<StampedPose> trajectory;  ///< T_world_ref of all keyframes; not empty.
  std::vector<std::string> lines;       ///< Counts and rates, as text.
};

/// Shows how a map grows.
class MapWatcher {
 public:
  virtual ~MapWatcher() = default;
  /// Returns whether it wants a snapshot now. A snapshot costs an export of the map.
  /// @param is_last true in the additional call after the last keyframe.
  virtual bool due(bool is_last) = 0;
  /// @throws std::runtime_error if the snapshot cannot be shown. This ends the mapping.
  virtual void show(WatchedMap snapshot) = 0;
};

/// Window with the growing map. It draws copies in threads of its own, at most ten a second. It
/// asks for few snapshots: exporting the map takes less than a twentieth of the time. The mouse
/// turns, moves and zooms the view; after that, the view does not follow the map any more.
class MapWindow : public MapWatcher {
 public:
  /// Returns false after the user closed the window.
  virtual bool isOpen() = 0;
  /// Draws the last snapshot. Returns when the user closes the window or presses a key in it, or
  /// when `stop` returns true.
  virtual void wait(const std::function<bool()>& stop) = 0;
};

}  // namespace efm
