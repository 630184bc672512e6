// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/keyframe_depth_map.h"

/// Keyframes as ROS 2 messages in CDR, for a session file.
namespace efm {

/// Returns x y z qx qy qz qw.
std::vector<double> numbersIn(const Rigid3& T);

/// Returns the definition of the message /efm/keyframe: one line per field, in this project's
/// terms.
std::string keyframeSchema();

/// Returns a keyframe as the message /efm/keyframe: everything that a map is made from, exactly.
/// Pixels without a depth have no confidence; there are no event images of single cameras.
std::string keyframeMessage(const KeyframeDepthMap& keyframe);
/// Returns the keyframe of a message. `evidence` is null.
/// @throws std::runtime_error naming the field that is missing or cannot be.
KeyframeDepthMap keyframeOf(std::string_view message);

/// The poses of a keyframe.
struct KeyframePoses {
  std::int64_t t_ref_ns = 0;
  Rigid3 T_world_ref, T_odom_ref;
};
/// Returns the poses of the message /efm/keyframe, without its images.
KeyframePoses posesIn(std::string_view message);

// Standard messages for viewers. Their times are limited to what ROS can say: 0 to 2^31 s.

/// Returns the time of a message in the file.
std::uint64_t logTime(std::int64_t t_ns);
/// sensor_msgs/PointCloud2 in the frame `keyframe`: x y z, intensity (confidence), sigma_m,
/// float32.
std::string pointsMessage(const KeyframeDepthMap& keyframe);
/// geometry_msgs/PoseStamped: T_world_ref.
std::string poseMessage(const StampedPose& pose);
/// tf2_msgs/TFMessage: the frame `keyframe` in the frame `world`.
std::string transformMessage(const StampedPose& pose);
/// nav_msgs/Path: T_world_ref of keyframes.
std::string pathMessage(const std::vector<StampedPose>& poses);
/// Returns the poses of `pathMessage`, exactly. Its times may be limited.
std::vector<Rigid3> pathOf(std::string_view message);
/// std_msgs/String, and its text.
std::string textMessage(std::string_view text);
std::string messageText(std::string_view message);

}  // namespace efm
