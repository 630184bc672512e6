// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "mapping/geometry/trajectory.h"
#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// Reads poses T_world_body from a file, whose kind is found by its content:
///   text, also compressed   see `readPoseText` (text/)
///   NumPy arrays            see `readPoseArrays`
///   a recording with poses  a bag, an HDF5 file, a folder: `detectFormat`
/// @return at least one pose, in the order of the file.
/// @throws std::runtime_error naming the file, the place, the value and what was expected.
std::vector<StampedPose> readPoses(const std::filesystem::path& file,
                                   const ReaderOptions& options = {});

/// Reads the poses of NumPy arrays:
///   one array N x 8           t tx ty tz qx qy qz qw
///   a .npz file with N times  and an array N x 7 (tx ty tz qx qy qz qw) or N x 4 x 4
///   (T_world_body).
/// Where several arrays of a .npz file have these shapes, those named t, time, timestamps … and
/// poses, pose, T_world_body, trajectory. A name may say the unit: t_ns, timestamps_us. Real times
/// are rounded to microseconds.
/// @throws std::runtime_error naming file, array, row, value and what was expected.
std::vector<StampedPose> readPoseArrays(const std::filesystem::path& file,
                                        const ReaderOptions& options);

}  // namespace efm
