// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// Recordings in ROS bags: ROS 1 (.bag) and ROS 2 (.db3, .mcap, or the folder with metadata.yaml).
/// Several files are one recording: a topic that is in several of them continues.
///
/// Topics are found by their type (see RosType). Cameras are the topics with events, in the natural
/// order of their names, left before right: /cam2 before /cam10. Poses come from the only topic
/// with poses; where there are several, from the only one of geometry_msgs (nav_msgs/Odometry is
/// mostly an estimate beside them). If several remain, there are no poses, and the error of a
/// missing part names the topics. ReaderOptions::topics replaces this choice: its events topics are
/// the cameras, in this order; its pose topic gives the poses; a kind that it does not name is
/// found by type.
///
/// A camera's calibration is sensor_msgs/CameraInfo in the namespace of its events
/// (/davis/left/camera_info for /davis/left/events). It has no extrinsics, so only one camera takes
/// its calibration from there; several need a file.

/// Whether a file is a bag of ROS 1. Never throws.
bool looksLikeRosbag(const std::filesystem::path& file);
/// Whether it is a bag of ROS 2: a database, an MCAP file, either compressed as a whole, or a
/// folder with metadata.yaml. Never throws.
bool looksLikeRosbag2(const std::filesystem::path& source);

/// @throws std::runtime_error naming the file, topic or byte that is wrong, or the library that
/// this build lacks (EFM_READ_ROSBAG, EFM_READ_ROS2).
RecordingParts openBags(const std::vector<std::filesystem::path>& files,
                        const ReaderOptions& options);

}  // namespace efm
