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
/// order of their names, left before right: /cam2 before /cam10. Poses come from the densest topic
/// with poses that covers the events, by the times at which messages were recorded. Odometry
/// drifts: its density counts by half. If there are several topics, the warning `pose-topic` names
/// them. If two are alike in density and time, within 10 %, there are no poses.
/// ReaderOptions::topics replaces this choice. Its event topics are the cameras, in this order; its
/// pose topic gives the poses. If it has no topic of a kind, topics of this kind are found by type.
///
/// "/tf:world->body" in ReaderOptions::topics gives the poses of a frame from messages of
/// tf2_msgs/TFMessage: a chain of moving and constant transforms (`FrameTree`).
///
/// The poses are final poses T_world_rig if transforms join their frame to the frame of camera 0's
/// events, and the user gives no hand-eye transform. If nothing joins the two, the warning
/// `pose-frame` names them.
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
