// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/opengl/COpenGLScene.h>
#include <Eigen/Core>

#include <filesystem>
#include <memory>

#include "plugin/session/map_watcher.h"

namespace efm {

/// A growing map as a scene of MRPT: the points in colours of their height (blue is low, red is
/// high), the trajectory, the frustum of the newest keyframe; beside it that keyframe's depth map
/// and confidence; counts and rates as text. The scene's z axis is upwards.
///
/// The view comes from behind and above the newest camera, sways slowly, and has the whole map in
/// it.
class MapScene {
 public:
  /// The scene draws at most so many points: every n-th of a larger map.
  static constexpr std::size_t kMaxPoints = 1'000'000;

  MapScene();
  void show(const WatchedMap& snapshot);
  /// The scene changes with each `show`; not thread-safe.
  mrpt::opengl::COpenGLScene::Ptr scene() const { return scene_; }

 private:
  void showPoints(const WatchedMap& snapshot);
  void showCameras(const WatchedMap& snapshot);
  void showPictures(const WatchedMap& snapshot);
  void turnView(const WatchedMap& snapshot);
  /// In the frame of the scene, metres.
  Eigen::Vector3d inScene(const Eigen::Vector3d& p_world) const {
    return R_scene_world_ * (p_world - origin_world_);
  }

  mrpt::opengl::COpenGLScene::Ptr scene_;
  Eigen::Vector3d origin_world_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_scene_world_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();   // of the map, frame of the scene
  double radius_m_ = 0;                                // of the map
  Eigen::Vector2d heading_ = Eigen::Vector2d::Zero();  // of the newest cameras, from above
  int shown_ = 0;
};

/// Draws a growing map without a screen: frame_000001.png, … of 1280 x 720 pixels, one per
/// keyframe. It draws in the thread that made it.
/// @param folder is made if it is missing; frames of an earlier run are removed
/// before the first one.
/// @param force write into a folder that holds other files.
/// @throws std::runtime_error naming the folder if it holds other files or cannot be made, or if
/// nothing can be rendered on this machine.
std::unique_ptr<MapWatcher> recordFrames(const std::filesystem::path& folder, bool force);

}  // namespace efm
