// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/trajectory.h"
#include "plugin/recordings/bags/ros_messages.h"
#include "plugin/session/sample.h"

namespace efm {

/// One transform T_a_b of a chain of transforms.
struct FrameMotion {
  std::vector<StampedPose> moves;  ///< T_a_b at its times, in any order; empty: constant.
  Rigid3 T_a_b;                    ///< The constant transform.
};

/// Returns the product of a chain of transforms, at the times of the one with most poses. The
/// others are interpolated. Times that another one does not have (before its first pose, after its
/// last pose, in a gap) are left out and counted.
/// @param chain at least one of them moves. If only one moves, its poses keep their order.
std::vector<StampedPose> productOf(std::vector<FrameMotion> chain, std::uint64_t& left_out);

/// The transforms between the frames of a recording: /tf and /tf_static of ROS. It keeps one
/// transform of each pair of frames, and reads the others when they are asked for.
class FrameTree {
 public:
  /// @param latched true for a transform of /tf_static.
  using Take = std::function<void(const FrameTransform& transform, bool latched)>;
  /// Passes all transforms to `take`. Returns the error of damage that ends them; empty: none.
  using Read = std::function<std::string(const Take& take)>;
  /// Frames; a transform joins each one to the next.
  using Way = std::vector<std::string>;

  /// Reads the transforms once.
  explicit FrameTree(Read read);

  const std::string& damage() const { return damage_; }
  std::vector<RecordedTransform> transforms() const;

  /// Returns the way between two frames: the transform of just these two, if there is one, else the
  /// only chain of transforms. @return an empty one if nothing joins them.
  /// @throws std::runtime_error listing the ways if there are several.
  Way way(const std::string& from, const std::string& to) const;
  /// Returns the way through frames "world->odom->camera", each joined to the next as in `way`.
  /// @throws std::runtime_error for unknown or unconnected frames; it lists all transforms.
  Way wayThrough(const std::string& frames) const;

  /// Returns the transforms along a way.
  /// @throws std::runtime_error for wrong numbers, a constant transform with several values, and
  /// two publishers of a moving one.
  std::vector<FrameMotion> along(const Way& way) const;

  /// Returns choices "world->camera" of poses that move: the frames above the camera's frame.
  /// @param camera empty, or not in the tree: all frames that have no frames below them.
  std::vector<std::string> choices(const std::string& camera) const;

 private:
  using Pair = std::pair<std::string, std::string>;  // parent and child
  struct Transform {
    FrameTransform first;
    bool latched = false;
    bool moves = false;
    std::uint64_t count = 0;
    std::optional<FrameTransform> other = {};  // another value of a latched transform
  };
  std::vector<std::string> neighbours(const std::string& frame) const;
  void extend(Way& way, const std::string& to, std::vector<Way>& found, int& steps) const;
  std::vector<std::string> above(const std::string& frame) const;
  std::string names() const;

  Read read_;
  std::string damage_;
  std::map<Pair, Transform> transforms_;
};

}  // namespace efm
