// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <istream>
#include <ostream>
#include <string>
#include <vector>

#include "mapping/geometry/trajectory.h"

namespace efm {

/// Trajectories as text, the format of the TUM RGB-D benchmark: one pose `t tx ty tz qx qy qz qw` a
/// line, metres and decimal seconds; blank lines and what follows a `#` do not count.

/// The poses in the order of the file, times exact. Quaternions are normalised, which takes away
/// the rounding of few digits: one whose length is off 1 by more than 1 % is an error.
/// @throws std::runtime_error naming file and line, the value and what was expected.
std::vector<StampedPose> readTumTrajectory(const std::filesystem::path& file);
/// @param name what errors call the stream.
std::vector<StampedPose> readTumTrajectory(std::istream& stream, const std::string& name);

/// Nine decimals for times and 17 significant digits for the rest, so that reading gives back what
/// was written, up to the rounding of the normalisation.
/// @throws std::runtime_error naming the file where it cannot be written.
void writeTumTrajectory(const std::filesystem::path& file, const std::vector<StampedPose>& poses);
void writeTumTrajectory(std::ostream& stream, const std::vector<StampedPose>& poses);

}  // namespace efm
