// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/opengl/CFBORender.h>

#include <filesystem>
#include <memory>
#include <vector>

#include "plugin/mrpt/window/map_scene.h"

namespace efm {

/// Draws a growing map without a screen: frame_000001.png, … of 1280 x 720 pixels, one per
/// keyframe. It draws in the thread that made it.
class MapFrames : public MapWatcher {
 public:
  /// @param folder is made if it is missing; frames of an earlier run are removed
  /// before the first one.
  /// @param force write into a folder that holds other files.
  /// @throws std::runtime_error naming the folder if it holds other files or cannot be made, or if
  /// nothing can be rendered on this machine.
  MapFrames(const std::filesystem::path& folder, bool force);

  bool due(bool is_last) override { return !is_last; }
  /// @throws std::runtime_error naming the file if it cannot be written.
  void show(WatchedMap snapshot) override;

 private:
  std::filesystem::path folder_;
  std::vector<std::filesystem::path> earlier_;
  MapScene scene_;
  std::unique_ptr<mrpt::opengl::CFBORender> renderer_;
  int frames_ = 0;
};

}  // namespace efm
