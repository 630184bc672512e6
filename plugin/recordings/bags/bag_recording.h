// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// Recordings in ROS bags: ROS 1 (.bag) and ROS 2 (.db3, .mcap, or the folder with metadata.yaml).
/// Several files are one recording: a topic continues from one file to the next.
///
/// Topics are found by their type (see RosType). Cameras are the topics with events, in the natural
/// order of their names, left before right: /cam2 before /cam10. Poses come from the only topic
/// with poses. If there are several topics, poses come from the only topic of geometry_msgs
/// (nav_msgs/Odometry is mostly an additional estimate). If several topics remain, there are no
/// poses, and the error about missing poses names the topics. ReaderOptions::topics replaces this
/// choice. Its event topics are the cameras, in this order; its pose topic gives the poses. If it
/// has no topic of a kind, topics of this kind are found by type.
///
/// A camera's calibration is sensor_msgs/CameraInfo in the namespace of its events
/// (/davis/left/camera_info for /davis/left/events). It has no extrinsics, so it is used only if
/// there is one camera. Several cameras need a file.

/// Returns whether a file is a bag of ROS 1. Never throws.
bool looksLikeRosbag(const std::filesystem::path& file);
/// Returns whether a source is a bag of ROS 2: a database or an MCAP file (also compressed as a
/// whole), or a folder with metadata.yaml. Never throws.
bool looksLikeRosbag2(const std::filesystem::path& source);

/// @throws std::runtime_error naming the file, topic or byte that is wrong, or the library that
/// this build lacks (EFM_READ_ROSBAG, EFM_READ_ROS2).
RecordingParts openBags(const std::vector<std::filesystem::path>& files,
                        const ReaderOptions& options);

}  // namespace efm
