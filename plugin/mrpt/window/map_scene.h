// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/opengl/COpenGLScene.h>
#include <Eigen/Core>

#include <filesystem>
#include <memory>

#include "plugin/engine/map_watcher.h"

namespace efm {

/// A growing map as a scene of MRPT: the points in colours of their height (blue is low, red is
/// high), the trajectory and the frustum of the newest keyframe. At the side are the depth map and
/// the confidence of this keyframe, and counts and rates as text. The scene's z axis is upwards.
///
/// The view is from behind and above the newest camera, sways slowly and shows the whole map.
class MapScene {
 public:
  /// The maximum number of drawn points. A larger map is subsampled: every n-th point is drawn.
  static constexpr std::size_t kMaxPoints = 1'000'000;

  MapScene();
  void show(const WatchedMap& snapshot);
  /// Returns the scene, which each `show` changes. Not thread-safe.
  mrpt::opengl::COpenGLScene::Ptr scene() const { return scene_; }

 private:
  void showPoints(const WatchedMap& snapshot);
  void showCameras(const WatchedMap& snapshot);
  void showPictures(const WatchedMap& snapshot);
  void turnView(const WatchedMap& snapshot);
  /// Returns the position in the frame of the scene, metres.
  Eigen::Vector3d inScene(const Eigen::Vector3d& p_world) const {
    return R_scene_world_ * (p_world - origin_world_);
  }

  mrpt::opengl::COpenGLScene::Ptr scene_;
  Eigen::Vector3d origin_world_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_scene_world_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();   // of the map, in the frame of the scene
  double radius_m_ = 0;                                // of the map
  Eigen::Vector2d heading_ = Eigen::Vector2d::Zero();  // of the newest cameras, from above
  int shown_ = 0;
};

/// Draws a growing map without a screen: frame_000001.png, … of 1280 x 720 pixels, one per
/// keyframe. All calls must come from the thread that made the result.
/// @param folder folder of the frames, made if it is missing. Frames of an earlier run are removed
/// before the first frame is written.
/// @param force true: writes into a folder that holds other files.
/// @throws std::runtime_error naming the folder if it holds other files or cannot be made, or if
/// nothing can be rendered on this machine.
std::unique_ptr<MapWatcher> recordFrames(const std::filesystem::path& folder, bool force);

}  // namespace efm
