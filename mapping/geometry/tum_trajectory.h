// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <istream>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "mapping/geometry/trajectory.h"

namespace efm {

/// Trajectories in the text format of the TUM RGB-D benchmark: a line `t tx ty tz qx qy qz qw` for
/// each pose, in metres and decimal seconds. Blank lines and comments after `#` are skipped.

/// Reads the poses T_world_rig in the order of the file. Times are exact. Quaternions are
/// normalised, because files have few digits. A length that differs from 1 by more than 1 % is an
/// error.
/// @throws std::runtime_error naming file, line, value and the expected value.
std::vector<StampedPose> readTumTrajectory(const std::filesystem::path& file);
/// @param name of the stream, for errors.
std::vector<StampedPose> readTumTrajectory(std::istream& stream, const std::string& name);

/// The same for the poses of a recording: at least one.
/// @throws std::runtime_error naming the file that has no pose.
std::vector<StampedPose> readPosesFile(const std::filesystem::path& file);

/// The pose of a line.
/// @param fields t tx ty tz qx qy qz qw.
/// @param time_exponent of the unit of t: 10^time_exponent seconds, -9 to 0.
/// @throws std::runtime_error naming the field, its value and the expected value.
StampedPose parseTumPose(const std::vector<std::string_view>& fields, int time_exponent = 0);

/// Writes times with nine decimals and other numbers with 17 significant digits: the file is read
/// back exactly, up to the rounding of the normalisation.
/// @throws std::runtime_error naming the file that cannot be written.
void writeTumTrajectory(const std::filesystem::path& file, const std::vector<StampedPose>& poses);
void writeTumTrajectory(std::ostream& stream, const std::vector<StampedPose>& poses);
/// Writes the line of a pose.
void writeTumPose(std::ostream& stream, const StampedPose& pose);

}  // namespace efm
