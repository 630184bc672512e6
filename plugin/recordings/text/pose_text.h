// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "mapping/geometry/trajectory.h"
#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// The error for a line of 12 numbers: KITTI's poses are the first three rows of a matrix.
inline constexpr const char* kPosesWithoutTimes =
    "12 numbers, as poses of KITTI have, which have no times: expected t tx ty tz qx qy qz qw; "
    "Python writes them: ef.write_poses('poses.txt', (times, T_world_rig))";

/// Reads text, also compressed, with a row per pose T_world_body:
///   t tx ty tz qx qy qz qw    decimal seconds, metres: the format of the TUM RGB-D benchmark;
///   columns in any order      if a header names them: EuRoC's CSV (#timestamp [ns], p_RS_R_x [m],
///                             …, q_RS_w [], …), TUM-VIE's mocap_data.txt (microseconds), topics
///                             of ROS (%time, field.header.stamp, sec and nanosec), PlotJuggler,
///                             OptiTrack's Motive, …; other columns are ignored.
/// Times are exact. If the header has no unit, whole numbers have the unit of the option: see
/// `findTimeUnit`. Rows whose pose is empty or NaN are left out.
/// So are those with wrong times, see `findWrongTimes`.
/// @param parts receives notes and warnings about these rows.
/// @return the poses in the order of the file, at least one.
std::vector<StampedPose> readPoseText(const std::filesystem::path& file,
                                      const ReaderOptions& options, RecordingParts& parts);

/// Reads the cameras' poses of nerfstudio's transforms.json: `frames`, each with transform_matrix,
/// 4 x 4, and a time (timestamp, time, t_ns, …). The matrix is of OpenGL's camera (y up, z
/// backward); the pose is that of ours (y down, z forward).
std::vector<StampedPose> readPoseFrames(const std::filesystem::path& file,
                                        const ReaderOptions& options, RecordingParts& parts);

/// Returns whether the complete lines at the beginning of a file are poses.
bool looksLikePoseLines(std::string_view beginning);

}  // namespace efm
