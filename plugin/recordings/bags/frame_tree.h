// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/trajectory.h"
#include "plugin/recordings/bags/ros_messages.h"

namespace efm {

/// The transforms between the frames of a recording: /tf and /tf_static of ROS.
class FrameTree {
 public:
  void add(const FrameTransform& transform);

  /// Returns "world->odom (constant), odom->base"; "none" without transforms.
  std::string names() const;

  /// Returns T_world_body: one moving transform on the way from `world` to `body`, and constant
  /// ones before and after it.
  /// @param frames "world->body".
  /// @throws std::runtime_error without the file's name: for other frames, and for wrong numbers.
  std::vector<StampedPose> posesOf(const std::string& frames) const;

 private:
  std::map<std::string, Rigid3> connectedTo(const std::string& frame) const;

  using Stamped = std::pair<std::int64_t, PoseNumbers>;  // time and T_parent_child
  struct Transforms {
    bool moving = false;
    std::vector<Stamped> stamped;  // at least one
  };
  using Frames = std::pair<std::string, std::string>;  // parent and child
  static Rigid3 rigidAt(const Frames& frames, const Stamped& transform);

  std::map<Frames, Transforms> transforms_;
};

}  // namespace efm
