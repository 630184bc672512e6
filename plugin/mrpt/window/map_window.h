// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>

#include "plugin/mrpt/window/watched_map.h"

namespace efm {

/// A window with the growing map. It draws copies in threads of its own, at most ten a second, and
/// asks for a snapshot so seldom that exporting the map takes less than a twentieth of the time.
/// The mouse turns the view, moves and zooms it; from then on the view follows the map no more.
class MapWindow : public MapWatcher {
 public:
  /// Opens a window. The library with MRPT's windows is loaded by this call alone.
  /// @throws std::runtime_error if there is no display, or the window does not appear.
  static std::unique_ptr<MapWindow> open();

  /// Whether the user has not closed it.
  virtual bool isOpen() = 0;
  /// Draws the last snapshot and returns when the user closes the window or presses a key in it, or
  /// as soon as `stop` is true.
  virtual void wait(const std::function<bool()>& stop) = 0;
};

}  // namespace efm
