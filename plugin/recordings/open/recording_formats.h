// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "mapping/geometry/trajectory.h"
#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// Describes a file or folder that no reader takes, and what to do instead: "a PNG picture:
/// expected events"; std::nullopt if it is unknown. Formats are found by their first bytes, also
/// within compressed files. Never throws.
std::optional<std::string> unreadFormat(const std::filesystem::path& source);

/// Returns the formats that this build reads, in the order in which they are tried. A rawlog is
/// tried after them.
const std::vector<RecordingFormat>& readerFormats();

/// @throws std::invalid_argument for a unit of time that is none of s, ms, us, ns.
void requireUnits(const ReaderOptions& options);

/// Returns the format of a file or folder by its content; null if none of `readerFormats` fits.
const RecordingFormat* detectFormat(const std::filesystem::path& source);

/// Describes why the first bytes are not those of a rawlog: "it begins with …"; std::nullopt for a
/// rawlog and for a damaged gzip file.
std::optional<std::string> whyNoRawlog(const std::filesystem::path& file);

/// Checks the first bytes of a rawlog, compressed or not: the name of an object's class, as MRPT
/// writes it. Does not check for later damage.
void requireRawlog(const std::filesystem::path& file);

/// Reads poses T_world_body from a file, whose kind is found by its content:
///   text, also compressed   see `readPoseText` (text/)
///   JSON                    see `readPoseFrames`
///   a recording with poses  a bag, an HDF5 file, a folder: `detectFormat`
/// @return at least one pose, in the order of the file; and the reader's warnings and notes.
/// @throws std::runtime_error also for poses that are not one trajectory: see `PoseConflict`.
RecordingParts readPoseParts(const std::filesystem::path& file, const ReaderOptions& options);
/// Returns the poses of `readPoseParts`.
std::vector<StampedPose> readPoses(const std::filesystem::path& file,
                                   const ReaderOptions& options = {});

}  // namespace efm
