// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mapping/geometry/trajectory.h"
#include "plugin/recordings/bags/ros_messages.h"
#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// Transforms T_a_b, T_b_c, … in a row: the poses of each one in any order. One pose: constant.
using FrameChain = std::vector<std::vector<StampedPose>>;

/// Returns the product of a chain at the times of its transform with most poses; the others are
/// interpolated. Poses at times that another transform does not have are left out and counted.
std::vector<StampedPose> productOf(const FrameChain& chain, std::uint64_t& left_out);

/// The transforms between the frames of a recording: /tf and /tf_static of ROS. It keeps one
/// transform of each pair of frames, and reads the others when `along` needs them.
class FrameTree {
 public:
  /// @param latched true for a transform of /tf_static.
  using Take = std::function<void(const FrameTransform& transform, bool latched)>;
  /// Passes all transforms to `take`. Returns the error of damage that ends them; empty: none.
  using Read = std::function<std::string(const Take& take)>;
  using Way = std::vector<std::string>;  // frames; a transform joins each one to the next

  /// Reads the transforms once.
  explicit FrameTree(Read read);

  const std::string& damage() const { return damage_; }
  /// Returns all pairs of frames; those from the world to the camera come first.
  std::vector<RecordedTransform> transforms(const std::string& camera) const;

  /// Returns the only chain of transforms between two frames; an empty one if nothing joins them.
  /// @throws std::runtime_error listing the ways if there are several.
  Way way(const std::string& from, const std::string& to) const;
  /// Returns the way through frames "world->odom->camera": each is joined to the next by the
  /// transform of just these two, if there is one, else as in `way`.
  /// @throws std::runtime_error for unknown or unconnected frames; it lists all transforms.
  Way wayThrough(const std::string& frames) const;
  /// Returns the transforms along a way, without those with wrong times: see `findWrongTimes`.
  /// @throws std::runtime_error for wrong numbers, a constant transform with several values, and
  /// two publishers of a moving one.
  FrameChain along(const Way& way, std::vector<Warning>& warnings) const;

  /// Returns whether a transform gives the pose of another frame in this one.
  bool hasBelow(const std::string& frame) const {
    const auto found = transforms_.lower_bound({frame, {}});
    return found != transforms_.end() && found->first.first == frame;
  }
  /// Returns choices "world->camera" of poses that move: the frames above the camera's frame.
  /// @param camera if it is not in the tree: all frames without frames below them.
  std::vector<std::string> choices(const std::string& camera) const;

 private:
  using Pair = std::pair<std::string, std::string>;  // parent and child
  struct Transform {
    FrameTransform first;
    std::uint64_t count = 0;
    bool latched = false;
    bool moves = false;                        // its numbers change, and it is not latched
    std::optional<FrameTransform> other = {};  // another value of a latched transform
  };
  void extend(Way& way, const std::string& to, std::vector<Way>& found, int& steps) const;
  std::vector<std::pair<std::string, bool>> above(const std::string& frame) const;

  Read read_;
  std::string damage_;
  std::map<Pair, Transform> transforms_;
};

}  // namespace efm
