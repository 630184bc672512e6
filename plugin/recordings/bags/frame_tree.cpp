// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/bags/frame_tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "mapping/geometry/timestamp.h"

namespace efm {

/// @throws std::runtime_error naming the frames and the time of wrong numbers.
Rigid3 FrameTree::rigidAt(const Frames& frames, const Stamped& transform) {
  try {
    return rigidOf(transform.second);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("{}->{} of {}: {}", frames.first, frames.second,
                                         formatSeconds(transform.first), error.what()));
  }
}

void FrameTree::add(const FrameTransform& transform) {
  Transforms& all = transforms_[{transform.parent, transform.child}];
  all.stamped.emplace_back(transform.t_ns, transform.numbers);
  all.moving = all.moving || transform.numbers != all.stamped.front().second;
}

std::string FrameTree::names() const {
  std::string names;
  for (const auto& [frames, transforms] : transforms_) {
    names += fmt::format("{}{}->{}{}", names.empty() ? "" : ", ", frames.first, frames.second,
                         transforms.moving ? "" : " (constant)");
  }
  return names.empty() ? "none" : names;
}

/// Returns T_frame_x of all frames x that constant transforms connect with a frame.
std::map<std::string, Rigid3> FrameTree::connectedTo(const std::string& frame) const {
  std::map<std::string, Rigid3> connected = {{frame, {}}};
  for (std::size_t before = 0; before != connected.size();) {
    before = connected.size();
    for (const auto& [frames, transforms] : transforms_) {
      const auto& [parent, child] = frames;
      const bool from_parent = connected.count(parent) > 0;
      if (from_parent == (connected.count(child) > 0) || transforms.moving) continue;
      const Rigid3 T_parent_child = rigidAt(frames, transforms.stamped.front());
      if (from_parent) {
        connected[child] = connected[parent] * T_parent_child;
      } else {
        connected[parent] = connected[child] * T_parent_child.inverse();
      }
    }
  }
  return connected;
}

std::vector<StampedPose> FrameTree::posesOf(const std::string& frames) const {
  const std::size_t arrow = std::min(frames.find("->"), frames.size());
  const auto of_world = connectedTo(frames.substr(0, arrow));
  const auto of_body = connectedTo(frames.substr(std::min(arrow + 2, frames.size())));
  for (const auto& [pair, transforms] : transforms_) {
    const auto& [parent, child] = pair;
    if (!transforms.moving && parent + "->" + child != frames) continue;
    const bool forward = of_world.count(parent) > 0 && of_body.count(child) > 0;
    if (!forward && (of_world.count(child) == 0 || of_body.count(parent) == 0)) continue;
    const Rigid3 T_world_a = of_world.at(forward ? parent : child);
    const Rigid3 T_b_body = of_body.at(forward ? child : parent).inverse();
    std::vector<StampedPose> poses;
    for (const Stamped& transform : transforms.stamped) {
      const Rigid3 T_parent_child = rigidAt(pair, transform);
      const Rigid3 T_a_b = forward ? T_parent_child : T_parent_child.inverse();
      poses.push_back({transform.first, T_world_a * T_a_b * T_b_body});
    }
    return poses;
  }
  throw std::runtime_error(
      fmt::format("no moving transform between the frames '{}', with constant ones before and "
                  "after it: expected PARENT->CHILD, of {}",
                  frames, names()));
}

}  // namespace efm
